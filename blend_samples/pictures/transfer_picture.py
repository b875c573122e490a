# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/transfer.png: a groom, a second head of another topology and other proportions, and the groom on it.

The second head is the first one with other triangles, deformed: a broader jaw, a higher and longer skull, and a nod.
Its eyes, brows and bust go with it.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head, portrait
from blend_samples.library import head_grooms
from blend_samples.sheets import picture_files
from hair_addon import api

OUT = Path(__file__).resolve().parents[2] / "docs" / "transfer.png"
PAGE = OUT.parent / "manual" / "transfer_groom.png"
SIZE = 280, 320  # pixels of a picture
KEPT_TRIANGLES = 0.6  # of the first head's, subdivided

# Places on the first head [m] that both have by name: those on the middle, and those beside it on both sides.
_MIDDLE = {"nose": (-0.19, 0.72), "chin": (-0.15, 0.63), "forehead": (-0.16, 0.80), "crown": (-0.05, 0.87)}
_MIDDLE |= {"back": (0.06, 0.77), "nape": (0.05, 0.68)}
_BESIDE = {"temple": (0.075, -0.09, 0.78), "ear": (0.085, -0.03, 0.72), "jaw": (0.06, -0.07, 0.66)}
_SECOND = "Second"  # the collection of the second head


def main():
    """Groom, build the second head, transfer, and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--groom", default="Long Wavy", choices=list(head_grooms.GROOMS))
    parser.add_argument("--strands", type=int, default=24_000)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--page", type=Path, default=PAGE)
    given = parser.parse_args()
    hair_addon.register()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "second.blend"
        save_second_head(path)
        first = dressed_head()
        hair = head_grooms.GROOMS[given.groom](first, given.strands)
        second = append_second_head(path)
    mark(first, second)
    light()
    both = {*bpy.data.collections[_SECOND].objects}
    own = {*bpy.context.scene.objects} - both
    made = [api.transfer_groom(hair, second, method=method) for method in ("LANDMARKS", "NEAREST")]
    bpy.context.view_layer.update()
    shown = [own, both]
    for one in made:
        print(one.notes(), one.places.scale)
        shown.append(both | {o for o in bpy.data.objects if o.data in (one.guides, one.hair)})
    pictures = [drawn(objects, given.samples) for objects in shown]
    words = "Groom", "Second head", "Landmarks", "Bounding boxes"
    titles = [(word, SIZE[0] * place + 8, picture_files.BASELINE) for place, word in enumerate(words)]
    for path, columns in ((given.out, (0, 1, 2, 3)), (given.page, (0, 1, 2))):
        sheet = np.concatenate([pictures[column] for column in columns], axis=1)
        picture_files.write(sheet, path, titles[: len(columns)], picture_files.FEW_BITS)


def dressed_head():
    """Return the sample's head with a face and a bust, in an empty scene."""
    made = head.build()
    portrait.dress(made)
    return made


def save_second_head(path):
    """Build the second head and save it with all that belongs to it, in a collection."""
    made = dressed_head()
    made.modifiers.new("Subdivision", "SUBSURF").levels = 1
    made.modifiers.new("Triangles", "DECIMATE").ratio = KEPT_TRIANGLES
    for changed in (made, bpy.data.objects["Bust"]):
        bpy.context.view_layer.objects.active = changed
        for modifier in [one.name for one in changed.modifiers]:
            bpy.ops.object.modifier_apply(modifier=modifier)
    made.vertex_groups.clear()
    collection = bpy.data.collections.new(_SECOND)
    for owner in list(bpy.context.scene.objects):
        collection.objects.link(owner)
        _deform(owner.data)
    bpy.context.view_layer.update()
    bpy.data.libraries.write(str(path), {collection})


def append_second_head(path):
    """Add what `save_second_head` saved to the scene; returns the head."""
    with bpy.data.libraries.load(str(path)) as (_there, here):
        here.collections = [_SECOND]
    bpy.context.scene.collection.children.link(here.collections[0])
    bpy.context.view_layer.update()
    return next(one for one in here.collections[0].objects if one.name.startswith("Head"))


def _deform(data):
    """Move the points of a mesh or of Curves as `deformed` says."""
    places = data.attributes["position"].data
    points = np.empty((len(places), 3), np.float32)
    places.foreach_get("vector", points.ravel())
    moved = np.array([deformed(point) for point in points.tolist()], np.float32)
    places.foreach_set("vector", moved.ravel())
    data.update_tag()


def deformed(place):
    """Return the place on the second head of a point of the first head."""
    x, y, z = place
    high, low = max(z - 0.74, 0.0), max(0.70 - z, 0.0)
    jaw = 2.0 * min(low, 0.06) - 2.0 * min(max(low - 0.06, 0.0), 0.06)  # the neck is as narrow as it was
    moved = Vector((x * (1.05 + jaw), y * 1.08 + 0.012 * max(y, 0.0), z + 0.22 * high - 0.1 * low))
    pivot = Vector((0.0, 0.0, 0.70))
    nod = 0.1 * min(max((z - 0.58) / 0.06, 0.0), 1.0)  # of the head, not of the shoulders
    return Matrix.Rotation(nod, 3, "X") @ (moved - pivot) + pivot


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
    """The portrait's lights, and a camera aside in front."""
    portrait.light()
    camera = bpy.context.scene.camera
    camera.data.lens, camera.data.dof.use_dof = 112.0, False
    camera.location = (0.70, -1.28, 0.76)
    head.point_at(camera, (0.004, -0.04, 0.690))
    bpy.context.view_layer.update()


def drawn(objects, samples):
    """Only some objects of the scene, with room for words above them."""
    was = {one: one.hide_render for one in bpy.context.scene.objects if one.type in {"MESH", "CURVES"}}
    for other in was:
        other.hide_render = other.hide_render or other not in objects
    bpy.context.view_layer.update()
    picture = picture_files.drawn(*SIZE, sample_count=samples)
    for other, is_hidden in was.items():
        other.hide_render = is_hidden
    return picture_files.below_caption(picture)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
