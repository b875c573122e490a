# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair in EEVEE is thin and lit approximately as in Cycles, and materials of artists are not changed."""

import bpy
import numpy as np
import pytest

from tests.support.pictures.rendering import configure, light_up
from tests.support.scenes import even_guides

SIZE = 40


def rendered_hair(engine, folder):
    """Return (3,) mean light of the hair on a holdout, and the part of the picture that it covers."""
    configure(engine=engine, film_transparent=True, resolution_x=SIZE, resolution_y=SIZE)
    render = bpy.context.scene.render
    render.image_settings.media_type, render.image_settings.file_format = "IMAGE", "OPEN_EXR"
    render.image_settings.color_mode, render.image_settings.color_depth = "RGBA", "32"
    render.filepath = str(folder / "hair.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath, check_existing=False)
    pixels = np.empty(4 * SIZE**2, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    pixels = pixels.reshape(-1, 4)
    return pixels[:, :3].sum(axis=0) / pixels[:, 3].sum(), pixels[:, 3].mean()


@pytest.mark.farm
@even_guides
def test_it_is_lit_about_as_by_cycles(lit, tmp_path):
    """EEVEE lights and covers hair approximately as Cycles does; strands at least a pixel wide would cover five
    times as much.
    """
    scene = bpy.context.scene
    lit.data.vellus.hair.strand_count, lit.data.vellus.appearance.melanin = 3000, 0.15
    bpy.data.objects["Sphere"].is_holdout = True
    light_up((0.3, 0.3, 0.3))
    bpy.context.view_layer.update()
    scene.cycles.samples, scene.cycles.use_denoising, scene.eevee.taa_render_samples = 16, False, 4
    (cycles, cover), (eevee, eevee_cover) = (rendered_hair(name, tmp_path) for name in ("CYCLES", "BLENDER_EEVEE"))
    assert eevee_cover == pytest.approx(cover, rel=0.25)
    np.testing.assert_allclose(np.log(eevee / cycles), 0.0, atol=np.log(1.6))


def test_strands_are_strips_unless_an_artist_chose_otherwise(sphere):
    render = bpy.context.scene.render
    assert render.hair_type == "STRAND"
    bpy.ops.vellus.add_hair(guide_count=20, strand_count=50)
    assert render.hair_type == "STRIP"
    render.hair_type = "CYLINDER"
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.vellus.add_hair(guide_count=20, strand_count=50)
    assert render.hair_type == "CYLINDER"


def test_an_artist_s_own_nodes_for_eevee_are_left_alone(hair):
    tree = hair.data.materials[0].node_tree
    count = len(tree.nodes)
    own = tree.nodes.new("ShaderNodeOutputMaterial")
    own.target = "EEVEE"
    hair.data.vellus.appearance.melanin = 0.9
    bpy.context.view_layer.update()
    outputs = [n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial" and n.target == "EEVEE"]
    assert outputs == [own]
    tree.nodes.remove(own)
    hair.data.vellus.appearance.melanin = 0.5
    bpy.context.view_layer.update()
    assert len(tree.nodes) == count


def test_random_colors_are_shown_too(hair):
    tree = hair.data.materials[0].node_tree
    assert not tree.nodes["EEVEE Color"].inputs[0].is_linked
    for random_color in (0.4, 0.0):
        hair.data.vellus.appearance.random_color = random_color
        bpy.context.view_layer.update()
        assert tree.nodes["EEVEE Color"].inputs[0].is_linked == (random_color > 0.0)


def test_strands_are_as_thick_for_light_as_they_are(hair):
    """EEVEE gets the strands' own thickness; with the thickness of the bounding box no strand would shade another."""
    thickness = hair.data.materials[0].node_tree.nodes["EEVEE Output"].inputs["Thickness"]
    assert [link.from_socket.name for link in thickness.links] == ["Thickness"]
