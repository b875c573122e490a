# SPDX-License-Identifier: GPL-3.0-or-later
"""Delivered hair in Blender without the add-on, and as exported by Blender, in a separate process."""

import os
import subprocess
import sys

import bpy
import numpy as np

PROGRAM = """
import sys
import bpy
import numpy as np

path, out, *times = sys.argv[1:]
bpy.ops.wm.open_mainfile(filepath=path)
assert "hair_addon" not in sys.modules and not hasattr(bpy.types.Curves, "vellus")
scene, hair = bpy.context.scene, bpy.data.objects["Hair"]
found = {}
for time in map(float, times):
    scene.frame_set(int(time // 1), subframe=time % 1)
    curves = hair.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    points = np.empty((len(curves.points), 3), np.float32)
    curves.attributes["position"].data.foreach_get("vector", points.ravel())
    found[str(time)] = points
np.savez(out, **found)
scene.render.filepath = out + ".png"
bpy.ops.render.render(write_still=True)
bpy.ops.wm.usd_export(filepath=out + ".usdc", export_animation=True)
"""


def without_addon(path, folder, times):
    """Read the object Hair of a .blend in another process.

    Returns ({time: (N, 3) float32}, a picture at the last time, {frame: (N, 3)} as exported at whole frames).
    """
    out = folder / "elsewhere.npz"
    words = [sys.executable, "-c", PROGRAM, str(path), str(out), *map(str, times)]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    subprocess.run(words, check=True, cwd=folder, env=environment, capture_output=True, timeout=1200)
    with np.load(out) as found:
        points = {float(name): found[name] for name in found}
    picture, stage = (out.with_name(out.name + ending) for ending in (".png", ".usdc"))
    return points, picture, _exported(stage, [time for time in times if time == int(time)])


def _exported(path, frames):
    """Return {frame: (N, 3)} of the curves Hair of a USD file, in the coordinates of their object."""
    bpy.utils.expose_bundled_modules()
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(path))
    prim = next(p for p in stage.Traverse() if p.IsA(UsdGeom.BasisCurves) and p.GetName() == "Hair")
    points = UsdGeom.BasisCurves(prim).GetPointsAttr()
    return {frame: np.array(points.Get(frame)) for frame in frames}
