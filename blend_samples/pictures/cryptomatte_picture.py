# SPDX-License-Identifier: GPL-3.0-or-later
"""Three hair systems of a head out of focus, each picked by Blender's Cryptomatte node and colored by the compositor.

Writes docs/manual/cryptomatte.png: the render, beside the composite.
"""

import argparse
import math
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head, portrait
from blend_samples.sheets import picture_files

OUT = Path(__file__).resolve().parents[2] / "docs" / "manual" / "cryptomatte.png"
SIZE = 280, 300  # pixels of a picture

# Hair system → (least, largest place across the head [m], color).
SYSTEMS = {
    "Right": (-1.0, 0.0, (0.10, 0.35, 1.00, 1.0)),
    "Middle": (0.0, 0.05, (1.00, 0.75, 0.10, 1.0)),
    "Left": (0.05, 1.0, (1.00, 0.12, 0.15, 1.0)),
}


def main():
    """Groom, render, pick, and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, default=9_000, help="of each system")
    parser.add_argument("--samples", type=int, default=48)
    parser.add_argument("--out", type=Path, default=OUT)
    given = parser.parse_args()
    hair_addon.register()
    head_object = head.build()
    portrait.dress(head_object)
    for name, (low, high, _color) in SYSTEMS.items():
        grow(head_object, name, low, high, given.strands)
    head.light()
    scene = bpy.context.scene
    scene.render.engine, scene.vellus.sample_count = "VELLUS", given.samples
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.camera.data.lens = 110.0
    lens = scene.camera.data.dof
    lens.use_dof, lens.focus_distance, lens.aperture_fstop = True, 1.3, 1.2
    bpy.context.view_layer.use_pass_cryptomatte_object = True
    before = picture_files.rendered()
    pick(scene)
    after = picture_files.rendered()
    picture_files.write(np.hstack([before, after]), given.out, kept_bits=picture_files.PAGE_BITS)


def grow(head_object, name, low, high, strand_count):
    """Add a hair system to the part of the scalp between two places across the head [m]."""
    group, scalp = head_object.vertex_groups.new(name=name), head_object.vertex_groups["scalp"].index
    for vertex in head_object.data.vertices:
        weight = next((one.weight for one in vertex.groups if one.group == scalp), 0.0)
        if weight and low <= vertex.co.x <= high:
            group.add([vertex.index], weight, "REPLACE")
    bpy.context.view_layer.objects.active = head_object
    known = set(bpy.data.objects)
    bpy.ops.vellus.distribute_guides(
        guide_count=70, density_group=name, length=0.2, length_variation=0.1, tilt=math.radians(8.0), gravity=0.85
    )
    (guides,) = set(bpy.data.objects) - known
    head.comb(guides, head_object)
    known = set(bpy.data.objects)
    bpy.context.view_layer.objects.active = guides
    bpy.ops.vellus.interpolate_hair(strand_count=strand_count, density_group=name, radius=6e-5)
    (hair,) = set(bpy.data.objects) - known
    hair.name = name


def pick(scene):
    """Multiply the light of each hair system with a color where its matte is."""
    tree = bpy.data.node_groups.new("Mattes", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    picture = tree.nodes.new("CompositorNodeRLayers").outputs["Image"]
    for name, (_low, _high, color) in SYSTEMS.items():
        matte, mix = tree.nodes.new("CompositorNodeCryptomatteV2"), tree.nodes.new("ShaderNodeMix")
        matte.source, matte.scene, matte.layer_name = "RENDER", scene, "ViewLayer.CryptoObject"
        matte.matte_id = name
        mix.data_type, mix.blend_type = "RGBA", "COLOR"
        colors = [one for one in mix.inputs if one.type == "RGBA"]
        tree.links.new(matte.outputs["Matte"], mix.inputs[0])
        tree.links.new(picture, colors[0])
        colors[1].default_value = color
        picture = next(one for one in mix.outputs if one.type == "RGBA")
    tree.links.new(picture, tree.nodes.new("NodeGroupOutput").inputs["Image"])
    scene.compositing_node_group = tree


if __name__ == "__main__":
    sys.exit(main())
