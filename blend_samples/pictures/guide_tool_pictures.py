# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/manual/guide_tools.png: one combed head and what the guide tools make of it, drawn by Vellus.

The hair of one side was combed to waves, that of the other is short and stands out.
"""

import os
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head, portrait
from blend_samples.sheets import picture_files
from hair_addon.blender.data.strands import curves

OUT = Path(__file__).resolve().parents[2] / "docs" / "manual" / "guide_tools.png"
WIDTH, HEIGHT = 160, 180  # pixels of a picture
COLUMNS = 4
RIM = 8.0  # [W]: less than the sample's, which whitens short hair that stands out
SIDE_GROUP = "side"  # of the combed half of the head

TOOLS = (
    ("Combed", None, {}),
    ("Guide Length", "guide_length", {"factor": 0.5}),
    ("Trim Guides", "trim_guides", {"cutter": "Plane"}),
    ("Smooth Guides", "smooth_guides", {"strength": 1.0, "iterations": 60}),
    ("Lift Guides", "lift_guides", {"amount": 0.6, "reach": 0.7}),
    ("Attract Guides", "attract_guides", {"amount": 0.8, "clearance": 0.006}),
    ("Mirror Guides", "mirror_guides", {}),
    ("Copy Guide Shape", "copy_guide_shape", {"source": SIDE_GROUP, "mapping": "NEAREST"}),
)


def main():
    """Comb, use each tool on the combed guides, and draw."""
    hair_addon.register()
    skull = head.build()
    portrait.dress(skull, portrait.AHEAD)
    guides, hair = head.grow(skull, guide_count=240, strand_count=24_000)
    hair.data.vellus.hair.radius = 1.1e-4
    hair.data.vellus.marschner.size = 64
    comb(guides)
    add_side(skull)
    add_plane()
    light()
    pictures = []
    with tempfile.TemporaryDirectory() as folder:
        combed = os.path.join(folder, "combed.blend")
        bpy.context.view_layer.objects.active = guides
        bpy.ops.wm.save_as_mainfile(filepath=combed)
        for _title, name, values in TOOLS:
            bpy.ops.wm.open_mainfile(filepath=combed)
            if name is not None:
                getattr(bpy.ops.vellus, name)(**values)
            bpy.context.view_layer.update()
            pictures.append(picture_files.below_caption(picture_files.drawn_at_once(WIDTH, HEIGHT, 4)))
    words = [
        (
            title,
            WIDTH * (place % COLUMNS) + 8,
            (HEIGHT + picture_files.CAPTION) * (place // COLUMNS) + picture_files.BASELINE,
        )
        for place, (title, _name, _values) in enumerate(TOOLS)
    ]
    picture_files.write(picture_files.rows(pictures, COLUMNS), OUT, words, picture_files.FEW_BITS)


def comb(guides):
    """Waves on the +X side; on the other, short guides that stand out."""
    strands = curves.read_points(guides.data).reshape(len(guides.data.curves), -1, 3)
    along = np.linspace(0.0, 1.0, strands.shape[1])[:, None]
    is_combed = strands[:, 0, 0] > -0.012
    waves = 0.012 * along * np.sin(26.0 * along) * np.array([1.0, 0.0, 0.0])
    out = strands[:, :1] - np.array([0.0, -0.02, 0.74])
    short = strands[:, :1] + 0.06 * along * out / np.linalg.norm(out, axis=2, keepdims=True)
    strands = np.where(is_combed[:, None, None], strands + waves, short)
    guides.data.attributes["position"].data.foreach_set("vector", strands.astype(np.float32).ravel())
    guides.data.update_tag()
    bpy.context.view_layer.update()


def add_side(skull):
    """The vertex group of the combed side."""
    group = skull.vertex_groups.new(name=SIDE_GROUP)
    group.add([vertex.index for vertex in skull.data.vertices if vertex.co.x > 0.0], 1.0, "REPLACE")


def add_plane():
    """Add an empty that cuts hair on its +Z side: below the mouth, and higher at the back."""
    plane = bpy.data.objects.new("Plane", None)
    plane.location, plane.rotation_euler = (0.0, 0.0, 0.66), (np.pi - 0.15, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(plane)


def light():
    """The sample's lights, and a camera in front."""
    head.light()
    camera = bpy.context.scene.camera
    camera.data.lens = 118.0
    camera.location = (0.0, -1.35, 0.76)
    head.point_at(camera, (0.0, -0.04, 0.735))
    bpy.data.lights["Rim"].energy = RIM
    background = next(n for n in bpy.context.scene.world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.22, 0.22, 0.22, 1.0)
    bpy.context.view_layer.update()


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
