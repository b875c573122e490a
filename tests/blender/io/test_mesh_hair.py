# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of cards and tubes become hair where they are, with their colors; other meshes are refused with a sentence."""

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix

from hair_addon import api
from hair_addon.blender.data.strands import attributes, curves
from hair_addon.blender.io import mesh_hair
from hair_addon.core.errors import HairError
from hair_addon.core.long_work import no_progress
from tests.support import placed_hair
from tests.support.commands import run_here
from tests.support.exchange.card_meshes import card_object
from tests.support.exchange.imported import lines_on, select, world
from tests.support.pairs import share_of
from tests.support.placed_hair import PLACES, outward, seen, world_scale

COUNT, GUIDES = 24, 8
EXACT = {"reaches_surface": False, "strand_count": COUNT, "guide_count": GUIDES}


@pytest.fixture
def lines(sphere, rng):
    return list(lines_on(sphere, rng, COUNT, least=8, most=8))


@pytest.fixture
def cards(lines):
    return card_object(lines, 0.05)


def use(*chosen, **options):
    """Select objects and turn the last into hair, as with a click; returns the hair's object."""
    select(*chosen)
    assert bpy.ops.vellus.mesh_to_hair(**{"guide_count": GUIDES, **options}) == {"FINISHED"}
    return bpy.context.object


def colors_of(hair_object):
    """Return the colors (S, 3) of strands in the order of the cards."""
    return attributes.read(hair_object.data, "mesh_color", "FLOAT_COLOR", "CURVE")[:, :3]


@pytest.mark.parametrize("place", share_of(PLACES, 2))
def test_hair_is_where_the_cards_are(blender, place):
    """The strand in the middle of each card is where it was in the world, whatever transforms both objects have."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    body = placed_hair.add_body()
    PLACES[place](body)
    bpy.context.view_layer.update()
    lines, size = outward(body, COUNT), world_scale(body)
    own = Matrix.LocRotScale((0.4, -3.0, 2.0), Euler((0.7, 0.2, -1.0)), (-0.01, 0.02, 0.01))
    cards = card_object(lines, 0.02 * size, matrix=own)
    hair = use(body, cards, reaches_surface=False, strand_count=len(lines))
    points, _radii, lengths = seen().strands[hair.name]
    starts, bound = curves.curve_offsets(hair.data), 4e-6 * (size + abs(points).max())
    for index, line in enumerate(lines):
        strand = points[starts[index] : starts[index + 1]]
        apart = np.linalg.norm(strand[:, None] - line[None], axis=-1)
        assert apart.min(axis=0).max() < bound and apart[0, 0] < bound and apart[-1, -1] < bound
    expected = [np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines]
    np.testing.assert_allclose(lengths, expected, rtol=0.0, atol=8.0 * bound)
    assert hair.parent == body and hair.data.vellus.guide_curves is not None


def test_roots_are_on_the_posed_surface_of_an_animated_one(head, rng):
    """Strands keep their roots when the surface moves."""
    lines = list(lines_on(head, rng, COUNT, least=8, most=8))
    hair = use(head, card_object(lines, 0.02), strand_count=60)
    starts = curves.curve_offsets(hair.data)[:-1]
    before = world(hair)[starts]
    head.location.x += 1.0
    bpy.context.view_layer.update()
    np.testing.assert_allclose(world(hair)[starts], before + np.array([1.0, 0.0, 0.0]), atol=1e-5)


def test_cards_of_hair_become_hair_within_the_width_of_cards(hair):
    """Hair that goes through cards and their textures comes back within the width of the cards."""
    before = world(hair).reshape(500, -1, 3)
    (cards,) = api.make_hair_cards(hair.data, card_count=40, texture_size=256)
    made = api.mesh_to_hair(cards, bpy.data.objects["Sphere"], strand_count=300, guide_count=GUIDES)
    found = next(one for one in bpy.data.objects if one.data == made.hair)
    points, starts = world(found), curves.curve_offsets(made.hair)
    assert (made.piece_count, made.skipped_count) == (40, 0) and 150 < len(starts) - 1 <= 300
    apart = np.array([np.linalg.norm(before.reshape(-1, 3) - place, axis=1).min() for place in points[::3]])
    corners = np.empty((len(cards.data.vertices), 3), np.float32)
    cards.data.vertices.foreach_get("co", corners.ravel())
    widths = np.linalg.norm(corners[1::2] - corners[::2], axis=1)
    assert apart.max() < widths.max() and np.median(apart) < 0.25 * np.median(widths)
    roots = np.linalg.norm(points[starts[:-1]], axis=1)
    tips = np.linalg.norm(points[starts[1:] - 1], axis=1)
    assert np.percentile(np.abs(roots - 1.0), 98) < 0.01 and (tips > roots).all()


def test_colors_of_the_mesh_become_those_of_strands(sphere, cards):
    """A strand has the mean of its card's color attribute, or the color of the texture, or of the material; a map
    passes it to the look.
    """
    wanted = np.random.default_rng(2).random((COUNT, 4)).astype(np.float32)
    layer = cards.data.color_attributes.new("Color", "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", np.repeat(wanted, 16, axis=0).ravel())
    cards.data.color_attributes.active_color = layer
    hair = use(sphere, cards, **EXACT)
    np.testing.assert_allclose(colors_of(hair), wanted[:, :3], atol=1e-6)
    (one,) = api.maps_of(hair)
    assert (one.setting, one.kind, one.source) == ("look.color", "CURVES", "mesh_color")
    assert api.settings_of(hair).appearance.parametrization == "COLOR"

    image = bpy.data.images.new("Cards", COUNT, 4, float_buffer=True)
    pixels = np.ones((4, COUNT, 4), np.float32)
    pixels[..., :3] = wanted[::-1, :3]
    image.pixels.foreach_set(pixels.ravel())
    material = bpy.data.materials.new("Cards")
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    cards.data.materials.append(material)
    cards.hide_set(False)
    np.testing.assert_allclose(colors_of(use(sphere, cards, **EXACT)), wanted[::-1, :3], atol=1e-3)

    # A computation in a thread reads none of Blender's data: the image may be removed in the meantime.
    work = mesh_hair.using_mesh(
        cards,
        sphere,
        bpy.context.evaluated_depsgraph_get(),
        api.MeshStrandSettings(strand_count=COUNT),
        api.DerivationSettings(guide_count=GUIDES),
    )
    compute = next(work)
    texture.image = bpy.data.images.new("Other", 1, 1)
    bpy.data.images.remove(image)
    np.testing.assert_allclose(compute(no_progress)[1], wanted[::-1, :3], atol=1e-3)
    work.close()

    links.remove(shader.inputs["Base Color"].links[0])
    cards.data.color_attributes.remove(layer)
    shader.inputs["Base Color"].default_value = (0.5, 0.25, 0.125, 1.0)
    cards.hide_set(False)
    np.testing.assert_allclose(colors_of(use(sphere, cards, **EXACT)), [(0.5, 0.25, 0.125)] * COUNT, atol=1e-6)


def test_strands_end_where_the_alpha_of_the_material_ends(sphere, cards, lines):
    """Alpha of a texture cuts strands at half of their length; without Use Alpha they keep their length."""
    image = bpy.data.images.new("Alpha", 1, 64, float_buffer=True, alpha=True)
    pixels = np.ones((64, 4), np.float32)
    pixels[32:, 3] = 0.0
    image.pixels.foreach_set(pixels.ravel())
    material = bpy.data.materials.new("Alpha")
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    material.node_tree.links.new(texture.outputs["Alpha"], shader.inputs["Alpha"])
    cards.data.materials.append(material)
    whole = np.mean([np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines])
    for uses_alpha, least, most in ((True, 0.35, 0.6), (False, 0.99, 1.01)):
        cards.hide_set(False)
        hair = use(sphere, cards, uses_alpha=uses_alpha, **EXACT)
        points = np.split(world(hair), curves.curve_offsets(hair.data)[1:-1])
        length = np.mean([np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in points])
        assert least < length / whole < most


def test_tubes_give_their_thickness_to_strands_that_fill_them(sphere, hair):
    tubes = api.make_hair_tubes(hair.data, tube_count=20, side_count=6, thickness=4.0)
    filled = api.mesh_to_hair(tubes, sphere, strand_count=20, guide_count=GUIDES, fills=True)
    thin = api.mesh_to_hair(tubes, sphere, strand_count=20, guide_count=GUIDES)
    widest = [attributes.read(made.hair, "radius", "FLOAT", "POINT").max() for made in (filled, thin)]
    expected = 4.0 * attributes.read(hair.data, "radius", "FLOAT", "POINT").max()
    assert abs(widest[0] / expected - 1.0) < 0.05 and filled.piece_count == 20 and widest[1] < 0.5 * widest[0]


def test_the_mesh_is_hidden_and_undo_shows_it(sphere, cards):
    assert use(sphere, cards, **EXACT).data.vellus.kind == "HAIR"
    assert cards.hide_render and cards.hide_get()
    cards.hide_render = False
    cards.hide_set(False)
    use(sphere, cards, hides_mesh=False, **EXACT)
    assert not (cards.hide_render or cards.hide_get())
    cards.parent = sphere
    use(cards, hides_mesh=False, **EXACT)


def test_what_is_no_hair_on_a_surface_is_one_sentence(sphere, cards):
    bpy.ops.mesh.primitive_uv_sphere_add(location=(3.0, 0.0, 0.0))
    ball = bpy.context.object
    empty = bpy.data.objects.new("Empty", bpy.data.meshes.new("Empty"))
    bpy.context.scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    for chosen, surface, sentence in [
        (ball, sphere, "no cards, tubes or slender locks"),
        (empty, sphere, "has no faces"),
        (cards, cards, "is the mesh of hair itself"),
        (cards, empty, "no faces"),
    ]:
        with pytest.raises(HairError, match=sentence) as refused:
            api.mesh_to_hair(chosen, surface, guide_count=GUIDES)
        assert str(refused.value).count(".") == 1 and not cards.hide_render
    with pytest.raises(HairError, match="Hide Mesh must be True or False"):
        api.mesh_to_hair(cards, sphere, hides_mesh="yes")
    select(cards)
    with pytest.raises(RuntimeError, match="Select the mesh that the hair grows on"):
        bpy.ops.vellus.mesh_to_hair()
    cards.scale.x = 0.0
    bpy.context.view_layer.update()
    with pytest.raises(HairError, match="scale of zero"):
        api.mesh_to_hair(cards, sphere)
    assert not bpy.data.hair_curves


def test_the_command_line_grooms_from_a_mesh(sphere, cards, lines, tmp_path):
    path = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    words = ("groom", path, "--surface", "Sphere", "--from-mesh", "Cards", "--strands", COUNT, "--guides", GUIDES)
    ended = run_here(*words, "--tilt", "0.2", "--out", "//kept.npz")
    assert (ended.status, f"{GUIDES} guides, {COUNT} strands" in ended.out) == (0, True), ended.errors
    assert "--tilt has no effect" in ended.errors
    with np.load(tmp_path / "kept.npz") as arrays:
        np.testing.assert_allclose(arrays["strand_points"][:, -1], [line[-1] for line in lines], atol=1e-5)
    for more, sentence in [
        (("--from-mesh", "Nope"), 'no mesh object "Nope"'),
        (("--from-mesh", "Cards", "--hair-from", path), "excludes"),
        (("--mesh-roots", "LOW_V"), "need --from-mesh"),
    ]:
        ended = run_here("groom", path, "--surface", "Sphere", *more, "--out", "//kept.npz")
        assert ended.status == 1 and sentence in ended.errors and len(ended.errors.splitlines()) == 1
