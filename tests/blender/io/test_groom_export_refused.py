# SPDX-License-Identifier: GPL-3.0-or-later
"""Refused or canceled exports of grooms keep an existing file; messages report what importers do."""

import resource

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom import bindings
from hair_addon.blender.io import groom_export, groom_sources
from hair_addon.core.errors import HairError
from hair_addon.core.files.export_settings import ExportSettings
from hair_addon.core.long_work import Stopped, run_now
from tests.support.exchange import alembic_reader
from tests.support.exchange.exported import LAST, bake, export, shape
from tests.support.reading import evaluated_points, write_points


@pytest.fixture
def baked(hair, tmp_path):
    """Return guides that simulate on a swinging sphere, with baked frames."""
    return bake(tmp_path)


def test_frames_that_are_not_baked_are_asked_for(baked, tmp_path):
    bpy.context.scene.frame_end = LAST + 9
    with pytest.raises(HairError, match="is not baked"):
        export(tmp_path / "groom.abc", animation="GUIDES")
    assert not (tmp_path / "groom.abc").exists()


@pytest.mark.parametrize("ending", [".abc", ".usdc"])
def test_points_that_are_not_finite_leave_the_file_that_was_there(hair, tmp_path, ending):
    path = tmp_path / f"groom{ending}"
    path.write_bytes(b"before")
    bpy.data.objects["Hair"].data.vellus.is_live = False
    points = evaluated_points(hair)
    points[7, 3, 1] = np.nan
    write_points(hair, points)
    with pytest.raises(HairError, match="non-finite"):
        export(path)
    assert path.read_bytes() == b"before" and [*tmp_path.iterdir()] == [path]


@pytest.mark.parametrize("ending", [".abc", ".usdc"])
@pytest.mark.parametrize("animation", ["NONE", "ALL"])
def test_a_full_disk_leaves_the_file_that_was_there(hair, tmp_path, ending, animation):
    bpy.context.scene.frame_end = 3
    path = tmp_path / f"groom{ending}"
    export(path, animation=animation)
    before = path.read_bytes()
    _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    for part in (0.0, 0.5, 0.95):
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(part * len(before)), hard))
        try:
            with pytest.raises(HairError, match="cannot be written"):
                export(path, animation=animation)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
        assert path.read_bytes() == before and [*tmp_path.iterdir()] == [path]


@pytest.mark.parametrize("ending", [".abc", ".usdc"])
def test_a_stopped_export_leaves_nothing_and_the_frame_where_it_was(baked, tmp_path, ending):
    bpy.context.scene.frame_set(2)

    def stop(_step, part):
        if part > 0.5:
            raise Stopped

    work = groom_export.exporting(
        tmp_path / f"groom{ending}", groom_sources.all_hair(), ExportSettings(animation="ALL"), bpy.context.scene
    )
    with pytest.raises(Stopped):
        run_now(work, stop)
    assert bpy.context.scene.frame_current == 2 and not [*tmp_path.glob("*groom*")]


def test_what_cannot_be_exported_is_one_sentence(hair, tmp_path):
    with pytest.raises(HairError, match=r"exported as \.abc"):
        export(tmp_path / "groom.fbx")
    with pytest.raises(HairError, match="choose one"):
        export(tmp_path / "groom.abc", has_hair=False, has_guides=False)
    with pytest.raises(HairError, match="no hair"):
        run_now(groom_export.exporting(tmp_path / "groom.abc", [], ExportSettings(), bpy.context.scene))


def test_what_importers_do_is_reported(hair, tmp_path):
    sphere = bpy.data.objects["Sphere"]
    sphere.data.uv_layers.remove(sphere.data.uv_layers[0])
    hair.data.vellus.root_key = "of other strands"
    bindings.invalidate(hair.data)
    notes = [str(note) for note in export(tmp_path / "groom.abc").notes]
    assert sum("no UV coordinates" in note for note in notes) == 2
    assert any("has no guide weights" in note for note in notes)
    found = shape(alembic_reader.read(tmp_path / "groom.abc"), "Hair")
    assert not {"groom_root_uv", "groom_closest_guides", "groom_guide_weights"} & set(found)
