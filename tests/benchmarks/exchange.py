# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of docs/manual/output.md: sizes of groom files, times, and errors of reading them back.

    .venv/bin/python tests/benchmarks/exchange.py [STRANDS]

Independent code reads the files: Alembic by the tests' own reader, USD by Blender's library. Seconds are
processor time of all cores.
"""

import math
import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from hair_addon import api
from tests.benchmarks.hair_peers import head_with_guides
from tests.support.exchange import alembic_reader
from tests.support.exchange.exported import shape

# Blender takes Alembic files as Y up and in meters: ours for Unreal are Z up, in centimeters.
_IMPORTERS = {".abc": {"as_background_job": False, "scale": 0.01}, ".usdc": {}}


def main(strand_count):
    """Print the rows: file, megabytes, seconds, errors of reading."""
    hair_addon.register()
    head, guides = head_with_guides()
    hair = api.interpolate_hair(guides, strand_count=strand_count)
    bpy.context.view_layer.update()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        api.export_groom(folder / "warm.abc", [hair]), api.export_groom(folder / "warm.usdc", [hair])
        for ending in (".abc", ".usdc", ".usda"):
            path = folder / f"hair{ending}"
            print(path.name, *_timed(lambda path=path: api.export_groom(path, [hair]), path), _errors(path, hair))
        path = folder / "library"
        path.mkdir()
        seconds, saved = _worked(lambda: api.save_groom(hair, path, name="Groom", picture=np.zeros((2, 2, 4))))
        print(".blend of a library:", _megabytes(saved), seconds)
        (guides_back, _hair), expected = api.apply_groom(head, saved), api.points(guides.data)
        print("  guides:", _far(api.points(guides_back), expected))
        for ending, options in _IMPORTERS.items():
            print(ending, *_used_as_hair(folder / f"hair{ending}", options, head, strand_count))
        seconds, tubes = _worked(lambda: api.make_hair_tubes(hair, tube_count=strand_count, point_count=6))
        print("tubes:", seconds, len(tubes.data.polygons), "polygons")


def _worked(call):
    """Return (processor time in seconds, as text; the result)."""
    before = time.process_time()
    made = call()
    return f"{time.process_time() - before:.1f} s", made


def _timed(call, path):
    seconds, _made = _worked(call)
    return _megabytes(path), seconds


def _megabytes(path):
    return f"{path.stat().st_size / 1e6:.0f} MB"


def _errors(path, hair):
    """Return the largest differences between a file and the hair."""
    if path.suffix == ".abc":
        found = shape(alembic_reader.read(path), hair.name)
        arrays, per_meter = {name: one.only for name, one in found.items() if one.samples}, 100.0
    else:
        arrays, per_meter = _of_usd(path, hair.name), 1.0
    points = api.points(hair).reshape(-1, 3)
    widths = _values(hair, "radius") * 2.0 * np.float32(per_meter)
    weights = np.asarray(arrays["groom_guide_weights"]).reshape(-1, 3).sum(axis=1)
    return {
        "points": _far(np.asarray(arrays["P"]).reshape(-1, 3) / per_meter, points),
        "widths": f"{np.abs(np.ravel(arrays['groom_width']) / widths - 1.0).max():.1e} of them",
        "weights": f"{np.abs(weights - 1.0).max():.1e}",
        "root UVs": float(
            np.abs(np.ravel(arrays["groom_root_uv"]) - _values(hair, "surface_uv_coordinate", 2).ravel()).max()
        ),
    }


def _values(curves, name, width=1):
    data = curves.attributes[name].data
    values = np.empty(len(data) * width, np.float32)
    data.foreach_get("vector" if width > 1 else "value", values)
    return values


def _of_usd(path, name):
    """Return {name: array} of the strands in a USD file, named as in Alembic."""
    bpy.utils.expose_bundled_modules()
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(path))
    prim = stage.GetPrimAtPath(f"/groom/{name}/strands")
    found = {p.GetPrimvarName(): p.Get() for p in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues()}
    curves = UsdGeom.BasisCurves(prim)
    return found | {"P": curves.GetPointsAttr().Get(), "groom_width": curves.GetWidthsAttr().Get()}


def _far(found, expected):
    """Return the largest distance, as text."""
    return f"{1e6 * np.abs(np.asarray(found) - expected).max():.2f} µm"


def _used_as_hair(path, options, head, strand_count):
    """Import strands and use them as hair.

    Returns the times of both [s], the largest movement of points, and the errors of the guides.
    """
    before = set(bpy.data.objects)
    reader = bpy.ops.wm.alembic_import if path.suffix == ".abc" else bpy.ops.wm.usd_import
    imported, _done = _worked(lambda: reader(filepath=str(path), **options))
    came = set(bpy.data.objects) - before
    for root in came if path.suffix == ".abc" else ():
        if root.parent is None:
            root.rotation_euler.x -= math.pi / 2
    bpy.context.view_layer.update()
    strands = next(o for o in came if o.type == "CURVES" and len(o.data.curves) == strand_count)
    matrix, points = np.array(strands.matrix_world), np.empty((len(strands.data.points), 3), np.float32)
    strands.data.attributes["position"].data.foreach_get("vector", points.ravel())
    expected = points @ matrix[:3, :3].T + matrix[:3, 3]
    seconds, used = _worked(lambda: api.use_as_hair(strands, head, guide_count=1000))
    back = api.points(used.hair).reshape(-1, 3)
    errors = f"guides: {100 * used.mean_error:.1f} % ({100 * used.high_error:.1f} %)"
    return f"imported {imported}, used {seconds}", _far(back, expected), errors


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
