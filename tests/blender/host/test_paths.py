# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths of a .blend that lead to another computer on Windows are recognized in every spelling."""

import itertools
import ntpath

import bpy
import pytest

from hair_addon import api
from hair_addon.blender.groom.dynamics import frame_folders
from hair_addon.blender.host import notices, paths
from hair_addon.core.errors import HairError

SLASHES = ["".join(row) for count in range(1, 5) for row in itertools.product("/\\", repeat=count)]


def leads_elsewhere(path):
    """Whether Windows would treat the path as a network share, by `bpy.path.abspath` with Python's Windows rules."""
    whole = ntpath.join("C:\\shot", path[2:]) if path.startswith("//") else path
    return ntpath.splitdrive(ntpath.normpath(whole))[0].startswith("\\\\")


@pytest.mark.parametrize("slashes", SLASHES)
def test_every_spelling_of_a_share_is_told(slashes):
    for rest in ("host/share", "host\\share\\folder", "?/UNC/host/share", "./pipe/x"):
        assert paths.names_other_computer(slashes + rest) == leads_elsewhere(slashes + rest), slashes + rest


def test_a_device_of_windows_is_one_and_folders_are_not():
    assert paths.names_other_computer(r"\??\UNC\host\share") and paths.names_other_computer("/??/UNC/host/share")
    for path in ("//haircache", "//../haircache", "/data/a/b", "C:\\hair", "C:/hair", "relative", "//", "/"):
        assert not paths.names_other_computer(path), path


@pytest.mark.parametrize("path", [r"\\host\share", r"/\host\share", r"\/host/share", "////host/share"])
def test_no_folder_of_a_file_is_looked_up_there(hair, path, monkeypatch, tmp_path, capsys):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    seen = []
    monkeypatch.setattr(paths.bpy.path, "abspath", lambda given, **_: seen.append(given) or str(tmp_path))
    notices.printed_cache.clear()
    data = bpy.data.hair_curves["Hair"]
    data.vellus.table_folder = path
    bpy.ops.object.camera_add(location=(0.0, -4.0, 0.0), rotation=(1.57, 0.0, 0.0))
    bpy.context.scene.camera = bpy.context.object
    for _twice in range(2):
        assert api.draw(width=8, height=8)[..., 3].max() > 0.0
    data.vellus.guide_curves.vellus.cache_folder = path
    with pytest.raises(HairError, match="on another computer"):
        frame_folders.folder_of(data.vellus.guide_curves)
    assert path not in seen
    assert capsys.readouterr().err.count("on another computer, where Vellus neither reads nor writes") == 1
