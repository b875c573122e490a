# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools that add, remove, mirror and transfer guides, and any transform, carry the layers of guides."""

import bmesh
import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon import api
from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import pipeline, writing
from hair_addon.core.geometry.strands import from_numpy
from hair_addon.core.grooming import guide_count
from tests.support.reading import attribute, points, write_points


def update():
    bpy.context.view_layer.update()


def lengths(shape):
    return np.linalg.norm(np.diff(shape, axis=1), axis=2).sum(axis=1)


def comb(guides, by):
    """Lean guides as a brush does, most above the origin; segments keep their lengths."""
    shape = points(guides)
    steps = np.diff(shape.astype(np.float64), axis=1)
    sizes = np.linalg.norm(steps, axis=2, keepdims=True)
    share = np.exp(shape[:, :1, 2:] - 1.0) * np.linspace(0.0, 1.0, steps.shape[1])[None, :, None]
    steps = steps / sizes + share * np.asarray(by)
    steps *= sizes / np.linalg.norm(steps, axis=2, keepdims=True)
    combed = np.concatenate([shape[:, :1], shape[:, :1] + np.cumsum(steps, axis=1)], axis=1).astype(np.float32)
    write_points(guides, combed)
    guides.data.update_tag()
    update()
    return combed


def weigh(guides, *weights):
    """Set the weights of all layers, and return the points of the guides."""
    for item, weight in zip(guides.data.vellus.layers, weights, strict=True):
        item.weight = weight
    update()
    return points(guides)


@pytest.fixture
def layered(hair):
    """Return the guides' object with two combed layers: Combing, with a keyed weight, and Side."""
    guides = bpy.data.objects["Guides"]
    api.add_layer(guides)
    update()
    comb(guides, (0.0, 1.0, 0.0))
    api.add_layer(guides, "Side")
    update()
    comb(guides, (0.7, 0.0, -0.3))
    return guides


def test_change_guide_count_carries_layers(layered):
    """With 60, then 150, then 60 guides, remaining guides are exact, and layers comb new guides as they comb
    strands.
    """
    state = layered.data.vellus
    for frame, weight in ((1, 1.0), (11, 0.5)):
        state.layers[0].weight = weight
        layered.data.keyframe_insert("vellus.layers[0].weight", frame=frame)
    bare = weigh(layered, 0.0, 0.0)
    only = weigh(layered, 1.0, 0.0)
    shape = weigh(layered, 1.0, 1.0)
    before = {0: shape, 1: bare, 2: only}
    assert api.change_guides(layered, "COUNT", method="COUNT", guide_count=150) == 150
    update()
    many = points(layered)
    assert np.array_equal(many[:60], shape)
    for number, weights in ((1, (0.0, 0.0)), (2, (1.0, 0.0)), (0, (1.0, 1.0))):
        now = weigh(layered, *weights)
        np.testing.assert_allclose(now[:60], before[number], atol=2e-6)
        np.testing.assert_allclose(lengths(now), lengths(many), rtol=1e-3)
        # New guides are close to hair between the former guides.
        expected = between(layered, before[number])
        apart = np.linalg.norm(now[60:] - expected, axis=2).max(axis=1) / lengths(expected)
        assert np.median(apart) < 0.02
    random = attribute(layered, "id")
    assert api.change_guides(layered, "COUNT", method="COUNT", guide_count=60) == 60
    update()
    stay = np.isin(random, attribute(layered, "id")).nonzero()[0]
    assert np.array_equal(points(layered), now[stay])
    assert np.array_equal(weigh(layered, 0.0, 0.0)[:, 0], now[stay][:, 0])
    np.testing.assert_allclose(weigh(layered, 1.0, 1.0), now[stay], atol=2e-6)
    assert list(api.layers(layered)) == ["Combing", "Side"]
    bpy.context.scene.frame_set(11)
    assert api.layers(layered) == {"Combing": 0.5, "Side": 1.0}


def test_first_layer_keeps_guides_that_were_added(hair):
    """The first layer takes all points of the guides, also of added guides, and settings no longer grow its base."""
    guides = bpy.data.objects["Guides"]
    api.change_guides(guides, "COUNT", method="COUNT", guide_count=2 * len(guides.data.curves))
    update()
    before = points(guides)
    api.add_layer(guides)
    update()
    np.testing.assert_array_equal(points(guides), before)
    assert curves.is_combed(guides.data)
    np.testing.assert_array_equal(weigh(guides, 0.0), before)


def test_another_guide_count_carries_each_layer(layered):
    """After changing the count from 60 to 150 and back, each layer differs by 2 % of the length in the median."""
    weights = (1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)
    before = [weigh(layered, *pair) for pair in weights]
    weigh(layered, 1.0, 1.0)
    for count in (150, 60):
        layered.data.vellus.guides.guide_count = count
        update()
        assert len(layered.data.curves) == count
    for pair, shape in zip(weights, before, strict=True):
        apart = np.linalg.norm(weigh(layered, *pair) - shape, axis=2).max(axis=1) / lengths(shape)
        assert np.median(apart) < 0.02


def between(guides, shape):
    """Return guides interpolated like hair between the first guides, of the given shape, at the roots of the others."""
    surface = scene.read_surface(guides.data.surface, scene.present_depsgraph())
    roots = curves.read_roots(guides.data, surface, surface.from_local(points(guides)[:, 0]))
    settings = pipeline.inputs_of(bpy.data.objects["Hair"].data)[1]
    count = len(shape)
    others = roots[np.arange(count, len(roots))]
    return guide_count.grown_between(surface.mesh, from_numpy(shape, roots[np.arange(count)]), others, settings)[0]


def test_mirror_guides_mirrors_each_layer(layered):
    """The two sides are mirror images at any weights."""
    api.change_guides(layered, "MIRROR")
    update()
    for weights in ((1.0, 1.0), (0.0, 0.0), (1.0, 0.0), (0.4, 1.5)):
        shape = weigh(layered, *weights)
        right, left = shape[shape[:, 0, 0] > 0.15], shape[shape[:, 0, 0] < -0.15] * [-1.0, 1.0, 1.0]
        assert len(right) == len(left) > 10
        nearest = np.linalg.norm(right[:, None, 0] - left[None, :, 0], axis=2).argmin(axis=1)
        np.testing.assert_allclose(right, left[nearest], atol=5e-3)
    assert curves.is_combed(layered.data)


@pytest.mark.parametrize(
    "matrix",
    [
        Matrix.Translation((3, 0, 1)) @ Matrix.Rotation(0.7, 4, (1, 2, 1)) @ Matrix.Scale(1.6, 4),
        Matrix.Diagonal((-1, 1, 1, 1)),
    ],
    ids=["turned", "mirrored"],
)
def test_transferred_guides_have_the_same_layers(layered, matrix):
    """A turned copy of the mesh gets the same base and layers in its own coordinates, with the mask of a layer."""
    layered.data.vellus.layers[1].mask = "top"
    update()
    sphere = layered.data.surface
    target = sphere.copy()
    target.data = sphere.data.copy()
    bpy.context.scene.collection.objects.link(target)
    target.vertex_groups.clear()
    turn = Matrix.Rotation(1.2, 3, (1, 1, 3))
    target.data.transform(turn.to_4x4())
    target.matrix_world = matrix
    update()
    transferred = api.transfer_groom(layered, target, method="UV")
    made = next(one for one in bpy.data.objects if one.data == transferred.guides)
    update()
    assert made.data.surface == target and list(api.layers(made)) == ["Combing", "Side"]
    size = np.abs(points(layered)).max()
    for weights in ((1.0, 1.0), (0.0, 0.0), (0.5, 0.0), (0.5, 1.0)):
        expected = weigh(layered, *weights) @ np.array(turn).T
        np.testing.assert_allclose(weigh(made, *weights), expected, atol=2e-4 * size)


PLACES = {
    "small": Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(1, 4, (1, 2, 3)) @ Matrix.Scale(0.01, 4),
    "uneven": Matrix.Rotation(1, 4, (1, 2, 3)) @ Matrix.Diagonal((1, 2, 0.5, 1)),
    "mirrored": Matrix.Diagonal((1, -1, 1, 1)),
    "parented": None,
    "centimeters": Matrix.Identity(4),
}


@pytest.mark.parametrize("place", PLACES)
def test_layers_are_the_same_wherever_the_surface_is(hair, place):
    """Combing on a moved, parented or mirrored surface, or in centimeters, is recorded and weighed as anywhere."""
    guides, sphere = bpy.data.objects["Guides"], bpy.data.objects["Sphere"]
    if place == "parented":
        parent = bpy.data.objects.new("Parent", None)
        bpy.context.scene.collection.objects.link(parent)
        sphere.parent = parent
        parent.matrix_world = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(1, 4, (3, 1, 2)) @ Matrix.Scale(3, 4)
    else:
        sphere.matrix_world = PLACES[place]
    if place == "centimeters":
        bpy.context.scene.unit_settings.scale_length = 0.01
    update()
    base = points(guides)
    api.add_layer(guides)
    update()
    shape = comb(guides, (0.0, 1.0, 0.0))
    half = weigh(guides, 0.5)
    np.testing.assert_allclose(lengths(half), lengths(base), rtol=1e-4)
    turned = [np.linalg.norm(one[:, -1] - base[:, -1], axis=1).mean() for one in (half, shape)]
    assert 0.3 * turned[1] < turned[0] < 0.7 * turned[1]
    np.testing.assert_allclose(weigh(guides, 0.0), base, atol=1e-6)
    np.testing.assert_allclose(weigh(guides, 1.0), shape, atol=1e-5)
    matrix = np.array(guides.matrix_world)
    np.testing.assert_allclose(matrix, np.array(sphere.matrix_world), atol=1e-6)


@pytest.mark.parametrize("change", ["emptied", "faces deleted", "removed"])
def test_layers_stay_when_the_surface_is_gone(layered, change):
    """Without faces to grow on, weights still change the guides, and adding guides is refused in one sentence."""
    shape = points(layered)
    sphere = bpy.data.objects["Sphere"]
    if change == "emptied":
        sphere.data.clear_geometry()
    elif change == "faces deleted":
        mesh = bmesh.new()
        mesh.from_mesh(sphere.data)
        bmesh.ops.delete(mesh, geom=mesh.faces[:], context="FACES_ONLY")
        mesh.to_mesh(sphere.data)
        mesh.free()
    else:
        bpy.data.objects.remove(sphere)
    update()
    bare = weigh(layered, 0.0, 0.0)
    assert np.abs(bare - shape).max() > 0.1
    np.testing.assert_allclose(weigh(layered, 1.0, 1.0), shape, atol=1e-5)
    with pytest.raises(api.HairError):
        api.change_guides(layered, "COUNT", factor=2.0)
    layered.data.vellus.layers[1].mask = "top"
    update()
    comb(layered, (0.0, 0.5, 0.0))
    assert np.isfinite(points(layered)).all()


@pytest.mark.parametrize("is_updated", [False, True])
def test_guides_are_grown_once_if_they_are_tagged_meanwhile(layered, monkeypatch, is_updated):
    """An update during their evaluation, which marks them again, does not begin it again."""
    grown = []
    evaluate, keep = pipeline.evaluate, writing.size_fitting.keep

    def counted(target, depsgraph):
        grown.append(target.name)
        assert len(grown) < 9
        evaluate(target, depsgraph)

    def keep_and_tag(target, fits):
        keep(target, fits)
        target.vellus.is_stale = True
        target.update_tag()
        if is_updated:
            update()

    monkeypatch.setattr(pipeline, "evaluate", counted)
    monkeypatch.setattr(writing.size_fitting, "keep", keep_and_tag)
    layered.data.vellus.guides.length = 0.7
    update()
    assert grown == [layered.data.name]


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_random_variation_of_layered_guides_stays_on_the_surface(hair, mirror):
    """With twice and four times the guides, strands stay where they are; back again, and with another seed, too."""
    guides, strands = bpy.data.objects["Guides"], bpy.data.objects["Hair"]
    guides.data.surface.matrix_world = Matrix.Diagonal((mirror, 1.0, 1.0, 1.0))
    settings = guides.data.vellus.guides
    settings.tilt, settings.length_variation, settings.gravity = 0.3, 0.2, 0.0
    grown = []
    for count in (120, 60, 120, 60):
        settings.guide_count = count
        update()
        grown.append(points(guides))
    plain, fresh = grown[:2]
    before = points(strands)
    np.testing.assert_array_equal(points(guides), fresh)  # without layers, settings determine guides
    api.add_layer(guides)
    update()
    for count in (120, 240, 60):
        settings.guide_count = count
        update()
        assert len(guides.data.curves) == count
        apart = np.linalg.norm(points(strands) - before, axis=2).mean(axis=1) / lengths(before)
        assert np.median(apart) < 0.04 and (apart < 0.05).mean() > 0.7
    np.testing.assert_array_equal(points(guides), fresh)
    settings.guide_count = 120
    settings.seed += 1
    update()
    settings.seed -= 1
    update()
    np.testing.assert_allclose(points(guides), plain, atol=1e-5)


@pytest.mark.parametrize("scale", [0.01, 1.0, 100.0])
def test_random_variation_of_layered_guides_stays_on_a_turned_surface(hair, scale):
    """With as many guides as before, on a surface that was turned and scaled, each has its own length."""
    guides = bpy.data.objects["Guides"]
    settings = guides.data.vellus.guides
    settings.guide_count, settings.length_variation, settings.gravity = 120, 0.5, 0.0
    update()

    def sizes():
        found = lengths(points(guides))
        return found / found.mean()

    plain = sizes()
    api.add_layer(guides)
    settings.guide_count = 240
    update()
    guides.data.surface.matrix_world = Matrix.Rotation(2.0, 4, (1.0, 0.5, 0.3)) @ Matrix.Scale(scale, 4)
    settings.guide_count = 120
    update()
    np.testing.assert_allclose(sizes(), plain, rtol=1e-3)


def test_another_seed_gives_layered_guides_its_own_variation(hair):
    """After each change of the seed, layers without combing leave guides as they grow without layers."""
    guides = bpy.data.objects["Guides"]
    settings = guides.data.vellus.guides
    settings.length_variation, settings.gravity = 0.5, 0.0
    grown = {}
    for seed in (6, 7, 5):
        settings.seed = seed
        update()
        grown[seed] = points(guides)
    api.add_layer(guides)
    for seed in (6, 7, 5):
        settings.seed = seed
        update()
        np.testing.assert_allclose(points(guides), grown[seed], atol=1e-5)
