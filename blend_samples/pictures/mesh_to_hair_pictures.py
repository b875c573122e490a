# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/manual/mesh_to_hair.png: hair cards, and the strands that they become."""

import colorsys
import os
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head
from blend_samples.pictures.transfer_picture import SIZE, drawn, dressed_head, light
from blend_samples.sheets import picture_files
from hair_addon import api

OUT = Path(__file__).resolve().parents[2] / "docs" / "manual" / "mesh_to_hair.png"
CARDS, STRANDS = 260, 12_000
CUT = 16  # pixels that are cut off either side of a picture
WIDTH = SIZE[0] - 2 * CUT
SAMPLE_COUNT = 16  # per pixel


def main():
    """Make cards of hair, give them colors, turn them into hair again, and draw both."""
    hair_addon.register()
    skull = dressed_head()
    own = {*bpy.context.scene.objects}
    guides, hair = head.grow(skull, guide_count=260, strand_count=4000)
    api.add_style(hair, "CLUMP", size=0.03, amount=0.5)
    (cards,) = api.make_hair_cards(hair, card_count=CARDS, segment_count=10, texture_size=512)
    for made in (guides, hair):
        bpy.data.objects.remove(made)
    color(cards)
    bpy.context.view_layer.update()
    light()
    bpy.context.scene.camera.data.lens = 118.0
    pictures = [drawn(own | {cards}, SAMPLE_COUNT)[:, CUT:-CUT]]
    used = api.mesh_to_hair(cards, skull, strand_count=STRANDS)
    used.hair.vellus.marschner.size = 64
    strands = {one for one in bpy.data.objects if one.data == used.hair}
    pictures.append(drawn(own | strands, SAMPLE_COUNT)[:, CUT:-CUT])
    words = f"{used.piece_count} cards", f"{len(used.hair.curves)} strands"
    titles = [(word, WIDTH * place + 8, picture_files.BASELINE) for place, word in enumerate(words)]
    picture_files.write(np.concatenate(pictures, axis=1), OUT, titles, picture_files.FEW_BITS)


def color(cards):
    """Give cards a texture with a color of its own for each card, from brown to blond."""
    count = len(cards.data.vertices) // 22  # two sides of eleven places
    shades = [
        (0.05 + 0.05 * (7 * index % 13) / 13.0, 0.65, 0.1 + 0.5 * (5 * index % 17) / 17.0) for index in range(count)
    ]
    image = bpy.data.images.new("Shades", count, 1, float_buffer=True)
    pixels = np.ones((count, 4), np.float32)
    pixels[:, :3] = [colorsys.hsv_to_rgb(*shade) for shade in shades]
    image.pixels.foreach_set(pixels.ravel())
    corners = len(cards.data.loops) // count
    uvs = np.repeat((np.arange(count) + 0.5) / count, corners)
    layer = cards.data.uv_layers.active
    layer.uv.foreach_set("vector", np.stack([uvs, np.full(len(uvs), 0.5)], axis=1).astype(np.float32).ravel())
    material = bpy.data.materials.new("Shades")
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    material.node_tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    cards.data.materials.clear()
    cards.data.materials.append(material)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
