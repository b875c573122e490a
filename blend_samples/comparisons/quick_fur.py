# SPDX-License-Identifier: GPL-3.0-or-later
"""Unchanged hair of *Add Hair* beside Blender's *Quick Fur*, in Blender's initial scene.

.venv/bin/python blend_samples/comparisons/quick_fur.py

Draws docs/manual/quick_fur.jpg: in each column a model (default cube, Suzanne, sample head, cat), above with Quick Fur
rendered by Cycles, below with hair of Vellus rendered by Vellus.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import cat, head
from blend_samples.sheets import picture_files

ROOT = Path(__file__).resolve().parents[2]

TILE = (300, 300)  # pixels
SAMPLES = 24
MODELS = ("cube", "monkey", "head", "cat")
MARGINS = {"cube": 0.78, "monkey": 0.72, "head": 0.9, "cat": 0.74}  # around models, for their hair
TOWARDS = Vector((0.62, -0.72, 0.30))  # from the model to the camera


def build(model):
    """Open Blender's initial scene with a model instead of the cube, and return the model."""
    meshes = {}
    if model in ("head", "cat"):
        made = {"head": head, "cat": cat}[model].build()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "model.blend"
            bpy.data.libraries.write(str(path), {made.data})
            name = made.data.name
            bpy.ops.wm.read_factory_settings()
            with bpy.data.libraries.load(str(path), link=False) as (_there, wanted):
                wanted.meshes = [name]
            meshes[model] = wanted.meshes[0]
    else:
        bpy.ops.wm.read_factory_settings()
    if model == "cube":
        found = bpy.data.objects["Cube"]
    else:
        bpy.data.objects.remove(bpy.data.objects["Cube"])
        if model == "monkey":
            bpy.ops.mesh.primitive_monkey_add()
            bpy.ops.object.shade_smooth()
            found = bpy.context.object
        else:
            found = bpy.data.objects.new(model, meshes[model])
            bpy.context.scene.collection.objects.link(found)
            unwrap(found)
    bpy.context.view_layer.update()
    for one in bpy.context.view_layer.objects:
        one.select_set(one is found)
    bpy.context.view_layer.objects.active = found
    bpy.context.view_layer.update()
    return found


def unwrap(model):
    """Add a UV map, which Quick Fur requires."""
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = model
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project()
    bpy.ops.object.mode_set(mode="OBJECT")


def look_at(model, margin):
    """Place the camera and the lamp at the same distances as from the cube, relative to the size of the model."""
    corners = [model.matrix_world @ Vector(corner) for corner in model.bound_box]
    middle = 0.125 * sum(corners, Vector())
    radius = max((corner - middle).length for corner in corners)
    camera = bpy.context.scene.camera
    camera.location = middle + margin * 4.4 * radius * TOWARDS.normalized()
    camera.rotation_euler = (middle - camera.location).to_track_quat("-Z", "Y").to_euler()
    camera.data.clip_start = 0.01 * radius
    lamp = bpy.data.objects["Light"]
    scale = radius / 3.0**0.5  # of the model, relative to the cube
    lamp.location = middle + scale * Vector((4.08, 1.0, 5.9))
    lamp.data.energy *= scale * scale
    lamp.data.shadow_soft_size *= scale


def render(engine, path):
    """Render the scene to a file."""
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.render.resolution_x, scene.render.resolution_y = TILE
    scene.render.resolution_percentage = 100
    scene.cycles.samples, scene.vellus.sample_count = SAMPLES, SAMPLES
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def main():
    """Draw the sheet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "manual" / "quick_fur.jpg")
    parser.add_argument("--models", nargs="+", default=MODELS, choices=MODELS)
    parser.add_argument("--only", choices=("VELLUS", "CYCLES"), help="draw one row")
    options = parser.parse_args()
    hair_addon.register()
    adders = {"CYCLES": bpy.ops.object.quick_fur, "VELLUS": bpy.ops.vellus.add_hair}
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for engine, add in adders.items():
            tiles = []
            for model in options.models if options.only in (None, engine) else ():
                found = build(model)
                look_at(found, MARGINS[model])
                add()
                bpy.context.view_layer.update()
                path = Path(folder) / f"{engine}_{model}.png"
                render(engine, path)
                tiles.append(picture_files.read(path)[..., :3])
                print(f"{model} by {engine}", flush=True)
            if tiles:
                rows.append(np.concatenate(tiles, axis=1))
    picture_files.write(np.concatenate(rows), options.out)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)
