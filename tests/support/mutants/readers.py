# SPDX-License-Identifier: GPL-3.0-or-later
"""All readers of the add-on in pure Python, each with a file to damage and a check of the values read.

For a damaged file, a reader must raise a `HairError` or return values that could have been written. Every new reader
needs a `Reader` here, or `tests/crossings/damage/test_mutants.py` fails.
"""

import argparse
import dataclasses
import hashlib
import io
import json
import math
import tempfile
import uuid
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hair_addon.blender.io import asset_catalogs, mesh_checks
from hair_addon.blender.io.pictures import sequence
from hair_addon.blender.settings import translations
from hair_addon.command_line import info, setting_pairs
from hair_addon.core.errors import HairError
from hair_addon.core.files import (
    alembic,
    array_file,
    array_grooms,
    curve_file,
    frame_manifest,
    settings_file,
)
from hair_addon.core.files.frame_cache import FrameCache
from hair_addon.core.files.strands import counted_points, hair, obj_lines, ply_strands, tressfx
from hair_addon.core.imaging import picture_checks
from hair_addon.core.kernels import compiled_kernels
from hair_addon.core.styling.curl import Settings as CurlSettings
from hair_addon.core.styling.kinds import KINDS
from tests.support.cached_frames import frame_bytes, manifest
from tests.support.exchange import strand_files
from tests.support.exchange.alembic_files import File

Check = Callable[[object, object], None]


@dataclass(frozen=True)
class Reader:
    """A reader: data: the intact file; read(path) returns its value; check(found, whole) asserts its validity.

    module: of the add-on; path: of the file in its folder, which contains other files that it needs.
    """

    module: str
    data: bytes
    read: Callable[[Path], object]
    check: Check
    path: str = "file"
    is_text: bool = False
    others: dict[str, bytes] = dataclasses.field(default_factory=dict)


def is_equal(found, whole):
    """Check for files with a digest or checksum: damage is detected."""
    assert _plain(found) == _plain(whole)


def anything(_found, _whole):
    """Accept any value, for readers with few possible results."""


def _plain(value):
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    return (value.dtype.str, value.shape, value.tobytes()) if isinstance(value, np.ndarray) else value


# ------------------------------------------------------------------------------------------------------- settings


def _settings():
    styles = tuple(kind() for kind in KINDS.values())
    return settings_file.GroomSettings(styles=styles, style_names=tuple(f"style {n}" for n in range(len(styles))))


def _can_be_written(found, _whole):
    text = settings_file.text_of(settings_file.to_object(found))
    assert settings_file.from_object(settings_file.object_of_text(text, "again"), "again") == found


def _partial_is_valid(found, _whole):
    found.changed(settings_file.GroomSettings())


# ---------------------------------------------------------------------------------------------------------- curves


def _archive(arrays, save):
    stream = io.BytesIO()
    save(stream, **arrays)
    return stream.getvalue()


def _groom_arrays():
    rng = np.random.default_rng(1)
    points = {
        name: rng.random((count, 5, 3), np.float32) for name, count in (("guide_points", 3), ("strand_points", 7))
    }
    widths = {
        name.replace("points", "widths"): np.full(array.shape[:2], 1e-4, np.float32) for name, array in points.items()
    }
    return {"roots": points["strand_points"][:, 0], **points, **widths, "up": np.array("Z")}


def _alembic():
    file, rng = File(), np.random.default_rng(2)
    widths = file.writer.array("width", "float32", np.float32([0.1, 0.2]))
    points = rng.normal(size=(3, 5, 3)).astype(np.float32)
    still = file.curves("still", points[0], [2, 3], extra=[widths])
    moving = file.curves("moving", file.moving("P", "float32", 3, points, is_array=True), [2, 3])
    placed = file.transform("placed", [still, moving], [1, 4, 0], [1, 2, 3, 90, 2, 2, 2])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.abc"
        file.write(path, placed)
        return path.read_bytes()


def are_curves(found, _whole):
    """Check that counts match points, and that non-finite numbers are reported for drawing."""
    for one in found.sets:
        assert one.points.shape == (one.counts.sum(), 3) and one.counts.min(initial=2) >= 1
        assert len(one.is_smooth) == len(one) and (one.radii is None or len(one.radii) == len(one.points))
        for values in (one.ids, one.root_uvs, one.guide_ids, one.guide_weights):
            assert values is None or len(values) == len(one)
        if one.motion is not None:
            for index in range(len(one.motion.times)):
                assert one.motion.points_at(index).shape == one.points.shape


def _are_the_arrays(found, whole):
    """Check arrays; the members of the archive have checksums."""
    are_curves(found, whole)
    points = {one.points.tobytes() for one in whole.sets}
    assert all(one.points.tobytes() in points for one in found.sets)


# --------------------------------------------------------------------------------------------------------- frames


def _frame(path):
    cache = FrameCache(path.parent)
    frame = cache.read_frame(1)
    complaints = cache.take_errors()
    if frame is None:
        assert complaints
        raise complaints[0]
    return frame.points.tobytes()


def _manifest_is_small(found, _whole):
    assert array_file.size_of(found.frame_layout) <= array_file.MOST_BYTES
    assert array_file.size_of(found.state_file_layout) <= array_file.MOST_BYTES


# --------------------------------------------------------------------------------------------- languages, kernels


def _are_texts(found, _whole):
    assert all(isinstance(text, str) for pair in found.items() for text in pair)


def _is_uuid(found, _whole):
    uuid.UUID(found)


_RECORD = {"input": "0123", "engine": "vellus", "settings": {"width": 8}, "files": {"a.png": "12 8"}}


def _record(path):
    sequence._require_same(path, _RECORD)
    return True


def _record_is_the_same(found, _whole):
    assert found


class _Module:
    name = "hair_addon.core.geometry.transform"

    def get_module_hash(self, _block_dim):
        return bytes(4)

    def load(self, _device, **_files):
        pass


class _Device:
    is_cpu = True


def _index(path):
    compiled_kernels._fitting.cache_clear()
    before, compiled_kernels.FOLDER = compiled_kernels.FOLDER, path.parent
    try:
        return compiled_kernels.load(_Module(), _Device())
    finally:
        compiled_kernels.FOLDER = before
        compiled_kernels._fitting.cache_clear()


def _index_files():
    binary, meta = compiled_kernels.file_names("core.geometry.transform", "any")
    return {binary: b"code", meta: b"{}"}


def _index_data():
    files = {"any": hashlib.sha256(b"code{}").hexdigest()}
    modules = {"core.geometry.transform": {"hash": bytes(4).hex(), "files": files}}
    index = {"compiler": compiled_kernels.compiler(), "processors": [{"name": "any", "features": []}]}
    return json.dumps(index | {"modules": modules, "gpus": [], "gpu_modules": {}}, indent=1).encode()


# ------------------------------------------------------------------------------------------------- words of a command


def _pairs(path):
    try:
        return setting_pairs.parsed(path.read_text(encoding="utf-8", errors="replace"), CurlSettings, "a style")
    except argparse.ArgumentTypeError as error:
        raise HairError(f"{error}.") from error


def _unit(path):
    return curve_file.parsed_unit(path.read_text(encoding="utf-8", errors="replace"))


def _is_positive(found, _whole):
    assert 0.0 < found < math.inf


# ------------------------------------------------------------------------------------------------------------- meshes


def _ply(is_text):
    rows = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    header = f"ply\nformat {'ascii' if is_text else 'binary_little_endian'} 1.0\nelement vertex 3\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz")
    header += "element face 1\nproperty list uchar uint vertex_indices\nend_header\n"
    if is_text:
        return (header + "".join("{} {} {}\n".format(*row) for row in rows) + "3 0 1 2\n").encode()
    return header.encode() + np.float32(rows).tobytes() + b"\x03" + np.uint32([0, 1, 2]).tobytes()


def _png():
    return b"\x89PNG\r\n\x1a\n" + bytes(40) + b"\0\0\0\0IEND\xaeB`\x82"


def _picture(path):
    return picture_checks.is_whole(path), picture_checks.is_broken(path)


def readers():
    """Return {name: `Reader`}."""
    settings = settings_file.text_of(settings_file.to_object(_settings())).encode()
    manifest_data = json.dumps(
        {"format": frame_manifest.FORMAT, "version": 1} | dataclasses.asdict(manifest())
    ).encode()
    po = (Path(translations.__file__).parent / "languages" / "de_DE.po").read_bytes()[:3000]
    po = po[: po.rindex(b"\n\n")] + b"\n"
    catalogs = f"# Comment\n\nVERSION 1\n\n{uuid.UUID(int=5)}:Hair/Short:Hair-Short\n".encode()
    abc = _alembic()
    obj = b"o A\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    stl = bytes(80) + (1).to_bytes(4, "little") + bytes(50)
    frames = {"manifest.json": manifest_data}
    groom, packed = (_archive(_groom_arrays(), save) for save in (np.savez, np.savez_compressed))
    lines = strand_files.lines()
    style = b"radius=0.01,pitch=0.3,seed=4,shape=0.5,invert_mask=yes"
    return {
        "settings": Reader("core/files/settings_file.py", settings, settings_file.read, _can_be_written, is_text=True),
        "part of the settings": Reader(
            "core/files/settings_file.py", settings, settings_file.read_partial, _partial_is_valid, is_text=True
        ),
        "manifest": Reader(
            "core/files/frame_manifest.py",
            manifest_data,
            lambda path: frame_manifest.read(path.parent),
            _manifest_is_small,
            path="manifest.json",
            is_text=True,
        ),
        "frame": Reader(
            "core/files/array_file.py", frame_bytes(), _frame, is_equal, path="+00000001.npz", others=frames
        ),
        "arrays": Reader("core/files/array_grooms.py", groom, array_grooms.read, _are_the_arrays),
        "compressed arrays": Reader("core/files/untrusted_arrays.py", packed, array_grooms.read, _are_the_arrays),
        "list of arrays": Reader("command_line/info.py", groom, info._arrays, anything),
        "foreign arrays": Reader("core/files/array_layouts.py", strand_files.npz(lines), array_grooms.read, are_curves),
        "HAIR": Reader("core/files/strands/hair.py", strand_files.hair(lines), hair.read, are_curves),
        "HairSalon": Reader(
            "core/files/strands/counted_points.py", strand_files.data(lines), counted_points.read_data, are_curves
        ),
        "CT2Hair": Reader(
            "core/files/strands/counted_points.py", strand_files.bin_file(lines), counted_points.read_bin, are_curves
        ),
        "TressFX": Reader("core/files/strands/tressfx.py", strand_files.tfx(lines), tressfx.read, are_curves),
        "strands in PLY": Reader(
            "core/files/strands/contents.py", strand_files.ply(lines), ply_strands.read, are_curves
        ),
        "strands in PLY as text": Reader(
            "core/files/strands/ply_table.py", strand_files.ply_text(lines), ply_strands.read, are_curves, is_text=True
        ),
        "lists in PLY": Reader(
            "core/files/strands/ply_table.py", strand_files.ply_lists(lines), ply_strands.read, are_curves
        ),
        "edges in PLY": Reader(
            "core/files/strands/ply_strands.py", strand_files.ply_edges(lines), ply_strands.read, are_curves
        ),
        "lines in OBJ": Reader(
            "core/files/strands/obj_lines.py", strand_files.obj(lines), obj_lines.read, are_curves, is_text=True
        ),
        "Alembic": Reader("core/files/alembic/reader.py", abc, alembic.grooms.read, are_curves),
        "whole Alembic": Reader("core/files/alembic/reader.py", abc, alembic.reader.require_whole, anything),
        "language": Reader("blender/settings/translations.py", po, translations.read_po, _are_texts, is_text=True),
        "catalogs": Reader(
            "blender/io/asset_catalogs.py",
            catalogs,
            lambda path: asset_catalogs.read(path.parent, "Hair/Short").identifier,
            _is_uuid,
            path=asset_catalogs.FILE,
            is_text=True,
        ),
        "record of a sequence": Reader(
            "blender/io/pictures/sequence.py", json.dumps(_RECORD).encode(), _record, _record_is_the_same, is_text=True
        ),
        "index of kernels": Reader(
            "core/kernels/compiled_kernels.py",
            _index_data(),
            _index,
            anything,
            path=compiled_kernels.INDEX,
            is_text=True,
            others=_index_files(),
        ),
        "settings of a style": Reader(
            "command_line/setting_pairs.py",
            style,
            _pairs,
            anything,
            is_text=True,
        ),
        "unit": Reader("core/files/curve_file.py", b"0.0254", _unit, _is_positive, is_text=True),
        "PLY": Reader("blender/io/mesh_checks.py", _ply(False), mesh_checks.require_ply, anything),
        "PLY as text": Reader("blender/io/mesh_checks.py", _ply(True), mesh_checks.require_ply, anything, is_text=True),
        "OBJ": Reader("blender/io/mesh_checks.py", obj, mesh_checks.require_obj, anything, is_text=True),
        "STL": Reader("blender/io/mesh_checks.py", stl, mesh_checks.require_stl, anything),
        "mesh in Alembic": Reader("blender/io/mesh_checks.py", abc, mesh_checks.require_alembic, anything),
        "picture": Reader("core/imaging/picture_checks.py", _png(), _picture, anything, path="a.png"),
    }
