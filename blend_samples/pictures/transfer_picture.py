# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/transfer.png: a combed head, a second head of another topology and other proportions, and the groom on it.

The second head is the first one, remeshed in voxels and deformed: a broader jaw, a higher and longer skull, and a nod.
"""

import os
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head
from blend_samples.sheets import picture_files
from hair_addon import api

OUT = Path(__file__).resolve().parents[2] / "docs" / "transfer.png"
PAGE = OUT.parent / "manual" / "transfer_groom.png"
WIDTH, HEIGHT = 280, 320  # pixels of a picture
VOXEL = 0.0042  # [m]

# Places on the first head [m] that both have by name: those on the middle, and those beside it on both sides.
_MIDDLE = {"nose": (-0.19, 0.72), "chin": (-0.15, 0.63), "forehead": (-0.16, 0.80), "crown": (-0.05, 0.87)}
_MIDDLE |= {"back": (0.06, 0.77), "nape": (0.05, 0.68)}
_BESIDE = {"temple": (0.075, -0.09, 0.78), "ear": (0.085, -0.03, 0.72), "jaw": (0.06, -0.07, 0.66)}


def main():
    """Groom, build the second head, transfer, and draw."""
    hair_addon.register()
    first = head.build()
    guides, hair = head.grow(first, guide_count=260, strand_count=14_000)
    hair.data.vellus.hair.radius = 1.3e-4
    hair.data.vellus.marschner.size = 64
    api.add_style(hair, "CLUMP", size=0.02, amount=0.6)
    api.add_style(hair, "WAVE", radius=0.006, pitch=0.06)
    second = second_head(first)
    mark(first, second)
    light()
    words = ("Groom", "Second head", "Landmarks", "Bounding boxes")
    shown = (first, guides, hair), (second,)
    made = [api.transfer_groom(hair, second, method="LANDMARKS"), api.transfer_groom(hair, second, method="NEAREST")]
    bpy.context.view_layer.update()
    for one in made:
        print(one.notes(), one.places.scale)
        shown += ((second, *(o for o in bpy.data.objects if o.data in (one.guides, one.hair))),)
    pictures = [drawn(objects) for objects in shown]
    titles = [(word, WIDTH * place + 8, picture_files.BASELINE) for place, word in enumerate(words)]
    for path, columns in ((OUT, (0, 1, 2, 3)), (PAGE, (0, 1, 2))):
        sheet = np.concatenate([pictures[column] for column in columns], axis=1)
        picture_files.write(sheet, path, titles[: len(columns)], picture_files.FEW_BITS)


def second_head(first):
    """A new object: the first head's shape as voxels see it, in other proportions."""
    second = first.copy()
    second.data = first.data.copy()
    second.name = second.data.name = "Second"
    bpy.context.scene.collection.objects.link(second)
    second.vertex_groups.clear()
    bpy.context.view_layer.objects.active = second
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.fill_holes(sides=0)  # voxels have no inside where the neck is open
    bpy.ops.object.mode_set(mode="OBJECT")
    remesh = second.modifiers.new("Remesh", "REMESH")
    remesh.mode, remesh.voxel_size, remesh.use_smooth_shade = "VOXEL", VOXEL, True
    bpy.ops.object.modifier_apply(modifier=remesh.name)
    for vertex in second.data.vertices:
        vertex.co = deformed(vertex.co)
    second.data.materials.clear()
    second.data.materials.append(head.skin())
    bpy.context.view_layer.update()
    return second


def deformed(place):
    """Where a point of the first head is on the second."""
    x, y, z = place
    high, low = max(z - 0.74, 0.0), max(0.70 - z, 0.0)
    moved = Vector((x * (1.05 + 2.0 * low), y * 1.08 + 0.012 * max(y, 0.0), z + 0.22 * high - 0.1 * low))
    pivot = Vector((0.0, 0.0, 0.70))
    return Matrix.Rotation(0.1, 3, "X") @ (moved - pivot) + pivot


def mark(first, second):
    """Landmarks of the same names on both heads, as an artist would set empties."""
    places = {name: Vector((0.0, y, z)) for name, (y, z) in _MIDDLE.items()}
    for name, (x, y, z) in _BESIDE.items():
        places |= {f"{name} left": Vector((x, y, z)), f"{name} right": Vector((-x, y, z))}
    for name, near in places.items():
        at = first.closest_point_on_mesh(near)[1]
        for owner, place in ((first, at), (second, deformed(at))):
            empty = bpy.data.objects.new(f"Landmark {name}", None)
            bpy.context.scene.collection.objects.link(empty)
            empty.parent, empty.location, empty.hide_render = owner, place, True
    bpy.context.view_layer.update()


def light():
    """The sample's lights, and a camera aside in front."""
    head.light()
    camera = bpy.context.scene.camera
    camera.data.lens = 128.0
    camera.location = (0.75, -1.15, 0.80)
    head.point_at(camera, (0.0, -0.03, 0.72))
    background = next(n for n in bpy.context.scene.world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.22, 0.22, 0.22, 1.0)
    bpy.context.view_layer.update()


def drawn(objects):
    """Only some objects of the scene, with room for words above them."""
    for other in bpy.context.scene.objects:
        if other.type in {"MESH", "CURVES"}:
            other.hide_render = other.hide_viewport = other not in objects
    bpy.context.view_layer.update()
    return picture_files.below_caption(picture_files.drawn_at_once(WIDTH, HEIGHT, 3))


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
