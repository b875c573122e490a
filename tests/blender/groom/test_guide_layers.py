# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers record combing, with weights and an order, and hold through everything that moves or grows guides again."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon import api
from hair_addon.blender.data.strands import attributes, curves, layer_attributes
from hair_addon.core.errors import HairError
from hair_addon.core.grooming import guide_layers, layer_kernels
from tests.support.pictures import render_probe
from tests.support.reading import points, write_points


def update():
    bpy.context.view_layer.update()


@pytest.fixture
def layered(hair):
    """Return the guides' object with an empty layer."""
    guides = bpy.data.objects["Guides"]
    api.add_layer(guides)
    update()
    return guides


def leaned(shape, by):
    """Bend guides sideways; segments keep their lengths."""
    steps = np.diff(shape.astype(np.float64), axis=1)
    lengths = np.linalg.norm(steps, axis=2, keepdims=True)
    steps = steps / lengths + np.linspace(0.0, 1.0, steps.shape[1])[None, :, None] * np.asarray(by)
    steps *= lengths / np.linalg.norm(steps, axis=2, keepdims=True)
    return np.concatenate([shape[:, :1], shape[:, :1] + np.cumsum(steps, axis=1)], axis=1).astype(np.float32)


def comb(guides, by=(0.0, 1.0, 0.0)):
    """Comb guides as a brush does, and return their points."""
    shape = leaned(points(guides), by)
    write_points(guides, shape)
    guides.data.update_tag()
    update()
    return shape


def lengths(shape):
    return np.linalg.norm(np.diff(shape, axis=1), axis=2).sum(axis=1)


def set_weight(guides, place, weight):
    guides.data.vellus.layers[place].weight = weight
    update()


def test_guides_without_layers_are_combed_as_before(hair):
    guides = bpy.data.objects["Guides"]
    shape = comb(guides)
    assert np.array_equal(points(guides), shape)
    assert curves.is_combed(guides.data)
    assert not [a.name for a in guides.data.attributes if a.name.startswith("layer_")]


def test_combing_is_recorded_and_a_weight_takes_it_back(layered):
    base, followed = points(layered), points(bpy.data.objects["Hair"])
    shape = comb(layered)
    assert np.array_equal(points(layered), shape)
    combed_hair = points(bpy.data.objects["Hair"])
    set_weight(layered, 0, 0.0)
    assert np.array_equal(points(layered), base)
    np.testing.assert_allclose(points(bpy.data.objects["Hair"]), followed, atol=1e-5)
    set_weight(layered, 0, 0.5)
    np.testing.assert_allclose(lengths(points(layered)), lengths(base), rtol=1e-5)
    assert 0.1 < np.abs(points(layered) - base).max() < np.abs(shape - base).max()
    set_weight(layered, 0, 1.0)
    np.testing.assert_allclose(points(layered), shape, atol=1e-6)
    np.testing.assert_allclose(points(bpy.data.objects["Hair"]), combed_hair, atol=1e-5)


def test_a_stroke_that_its_layer_can_have_composes_no_guides(layered, monkeypatch):
    comb(layered)
    api.add_layer(layered)
    update()
    counted, compose = [], layer_kernels.compose

    def counting(layers, guides=None, out=None):
        counted.append(len(layers.counts) if guides is None else len(guides))
        return compose(layers, guides, out)

    monkeypatch.setattr(layer_kernels, "compose", counting)
    shape, combed = points(layered), points(layered)
    combed[:2] = leaned(shape[:2], (1.0, 0.0, 0.0))
    write_points(layered, combed)
    layered.data.update_tag()
    update()
    assert not counted
    assert np.array_equal(points(layered), combed)
    set_weight(layered, 1, 0.0)
    np.testing.assert_allclose(points(layered), shape, atol=1e-6)


def stored(guides, place):
    """Return the attributes of a layer: turns (N, 4) and stretches (N,)."""
    identity = guides.data.vellus.layers[place].identity
    return [
        attributes.read(guides.data, f"layer_{identity}_{name}", data_type, "POINT")
        for name, data_type in (("turn", "QUATERNION"), ("stretch", "FLOAT"))
    ]


def test_recording_takes_what_layers_store_now_and_undo_steps_keep_theirs(layered):
    """Recording writes to the memory of Blender's attributes, which undo steps do not share, and keeps no copy."""
    comb(layered)
    api.add_layer(layered)
    comb(layered, (1.0, 0.0, 0.0))
    bpy.ops.ed.undo_push(message="Combed")
    before = [stored(layered, place) for place in (0, 1)]
    turns = before[0][0].copy()
    turns[:, 1:] *= -1.0
    name = f"layer_{layered.data.vellus.layers[0].identity}_turn"
    layered.data.attributes[name].data.foreach_set("value", turns.ravel())  # by a script, without a report
    combed = points(layered)
    combed[:2] = leaned(combed[:2], (0.0, 0.0, 2.0))
    write_points(layered, combed)
    layered.data.update_tag()
    update()
    assert np.array_equal(points(layered), combed)
    assert np.array_equal(stored(layered, 0)[0], turns)
    per_guide = combed.shape[1]
    assert not np.array_equal(stored(layered, 1)[0], before[1][0])
    assert np.array_equal(stored(layered, 1)[0][2 * per_guide :], before[1][0][2 * per_guide :])
    layers = layer_attributes.read(
        layered.data, [item.identity for item in layered.data.vellus.layers], np.ones((2, len(combed)))
    )
    np.testing.assert_allclose(guide_layers.composed(layers)[: 2 * per_guide], combed[:2].reshape(-1, 3), atol=1e-6)
    bpy.ops.ed.undo_push(message="Combed again")
    bpy.ops.ed.undo()
    guides = bpy.data.objects["Guides"]
    for place in (0, 1):
        assert all(map(np.array_equal, stored(guides, place), before[place]))


@pytest.mark.parametrize("data_type", [None, "FLOAT_VECTOR"])
def test_attributes_of_a_layer_that_are_missing_or_of_another_type_are_created(layered, data_type):
    shape = points(layered)
    name = f"layer_{layered.data.vellus.layers[0].identity}_turn"
    layered.data.attributes.remove(layered.data.attributes[name])
    if data_type:
        layered.data.attributes.new(name, data_type, "POINT")
    comb(layered)
    assert stored(layered, 0)[0].any()
    set_weight(layered, 0, 0.0)
    np.testing.assert_allclose(points(layered), shape, atol=1e-6)


def test_the_first_layer_takes_the_present_combing(hair):
    guides = bpy.data.objects["Guides"]
    base, shape = points(guides), comb(guides)
    api.add_layer(guides)
    assert api.layers(guides) == {"Combing": 1.0}
    assert np.array_equal(points(guides), shape)
    set_weight(guides, 0, 0.0)
    np.testing.assert_allclose(points(guides), base, atol=1e-5)
    assert not curves.is_combed(guides.data)


@pytest.mark.parametrize("change", ["hidden", "without weight"])
def test_a_layer_that_is_off_cannot_be_combed(layered, change):
    comb(layered)
    item = layered.data.vellus.layers[0]
    if change == "hidden":
        item.is_on = False
    else:
        item.weight = 0.0
    update()
    before = points(layered)
    comb(layered, (1.0, 0.0, 0.0))
    assert np.array_equal(points(layered), before)
    assert '"Combing"' in layered.data.vellus.status
    with pytest.raises(HairError, match="Combing"):
        api.change_guides(layered, "SMOOTH")
    item.is_on, item.weight = True, 1.0
    update()
    comb(layered, (1.0, 0.0, 0.0))
    assert layered.data.vellus.status == ""


def test_layers_are_moved_duplicated_merged_removed_and_applied(layered):
    base = points(layered)
    comb(layered)
    api.add_layer(layered, "Side")
    shape = comb(layered, (1.0, 0.0, 0.5))
    assert list(api.layers(layered)) == ["Combing", "Side"]
    bpy.context.view_layer.objects.active = layered
    bpy.ops.vellus.move_layer(direction="DOWN")
    assert list(api.layers(layered)) == ["Side", "Combing"]
    assert np.abs(points(layered) - shape).max() > 1e-3
    bpy.ops.vellus.move_layer(direction="UP")
    np.testing.assert_allclose(points(layered), shape, atol=1e-6)
    bpy.ops.vellus.duplicate_layer()
    doubled = points(layered)
    assert list(api.layers(layered)) == ["Combing", "Side", "Side.001"]
    bpy.ops.vellus.merge_layer_down()
    assert list(api.layers(layered)) == ["Combing", "Side"]
    np.testing.assert_allclose(points(layered), doubled, atol=1e-5)
    bpy.ops.vellus.remove_layer()
    bpy.ops.vellus.remove_layer()
    np.testing.assert_allclose(points(layered), base, atol=1e-6)
    assert api.layers(layered) == {}
    assert not [a.name for a in layered.data.attributes if a.name.startswith("layer_")]
    api.add_layer(layered)
    shape = comb(layered)
    assert api.apply_layers(layered) == 1
    update()
    assert np.array_equal(points(layered), shape)
    assert curves.is_combed(layered.data)


def test_guide_tools_are_recorded(layered):
    base = points(layered)
    api.change_guides(layered, "LENGTH", factor=0.5)
    update()
    np.testing.assert_allclose(lengths(points(layered)), 0.5 * lengths(base), rtol=1e-4)
    set_weight(layered, 0, 0.5)
    np.testing.assert_allclose(lengths(points(layered)), np.sqrt(0.5) * lengths(base), rtol=1e-4)
    set_weight(layered, 0, 0.0)
    assert np.array_equal(points(layered), base)


def test_a_mask_limits_a_layer(layered):
    base = points(layered)
    shape = comb(layered)
    layered.data.vellus.layers[0].mask = "top"
    update()
    height = base[:, 0, 2]
    np.testing.assert_allclose(points(layered)[height > 0.2], shape[height > 0.2], atol=1e-6)
    assert np.array_equal(points(layered)[height < -0.2], base[height < -0.2])


def test_the_status_names_a_missing_mask_until_it_is_restored(layered):
    """The status names a missing mask until it is restored, also after combing, and adds that a weightless layer is
    not combed.
    """
    layered.data.vellus.layers[0].mask = "top"
    update()
    sphere = bpy.data.objects["Sphere"]
    sphere.vertex_groups["top"].name = "gone"
    set_weight(layered, 0, 0.5)
    comb(layered)
    assert '"top"' in layered.data.vellus.status
    api.add_layer(layered)
    set_weight(layered, 1, 0.0)
    comb(layered, (1.0, 0.0, 0.0))
    assert "has no weight" in layered.data.vellus.status and '"top"' in layered.data.vellus.status
    sphere.vertex_groups["gone"].name = "top"
    set_weight(layered, 1, 1.0)
    comb(layered)
    assert not layered.data.vellus.status


def test_a_mask_can_be_painted_later(layered):
    """Guides follow a mask that is painted later, and keep its weights when their surface is gone."""
    base, shape = points(layered), comb(layered)
    layered.data.vellus.layers[0].mask = "top"
    update()
    sphere = bpy.data.objects["Sphere"]

    def paint(weight):
        sphere.vertex_groups["top"].add([vertex.index for vertex in sphere.data.vertices], weight, "REPLACE")
        sphere.data.update_tag()
        update()

    paint(0.0)
    assert np.array_equal(points(layered), base)
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    paint(1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    update()
    np.testing.assert_allclose(points(layered), shape, atol=1e-6)
    combed = comb(layered, (1.0, 0.0, 0.0))
    np.testing.assert_allclose(points(layered), combed, atol=1e-6)
    sphere.data.clear_geometry()
    update()
    np.testing.assert_allclose(points(layered), combed, atol=1e-6)
    layered.data.vellus.layers[0].weight = 0.0
    update()
    np.testing.assert_allclose(points(layered), base, atol=1e-6)


def test_weights_are_animated(layered):
    base, shape = points(layered), comb(layered)
    state = layered.data.vellus
    for frame, weight in ((1, 0.0), (11, 1.0)):
        state.layers[0].weight = weight
        layered.data.keyframe_insert("vellus.layers[0].weight", frame=frame)
    scene = bpy.context.scene
    scene.frame_set(1)
    np.testing.assert_allclose(points(layered), base, atol=1e-6)
    at_rest = points(bpy.data.objects["Hair"])
    scene.frame_set(11)
    np.testing.assert_allclose(points(layered), shape, atol=1e-6)
    assert np.abs(points(bpy.data.objects["Hair"]) - at_rest).max() > 0.05
    api.add_layer(layered)
    bpy.context.view_layer.objects.active = layered
    bpy.ops.vellus.move_layer(direction="DOWN")
    scene.frame_set(1)
    np.testing.assert_allclose(points(layered), base, atol=1e-6)


def test_renders_show_and_hide_layers_by_keys(layered):
    """A render has its own animated values."""
    state, is_on = layered.data.vellus, {}
    comb(layered)
    for frame in (1, 2):
        state.layers[0].is_on = frame == 1
        update()
        is_on[frame] = points(bpy.data.objects["Hair"])
        state.layers[0].keyframe_insert("is_on", frame=frame)
    bpy.context.scene.frame_set(1)
    with render_probe.reading(lambda depsgraph: curves.read_points(depsgraph.objects["Hair"].data)) as render:
        shown = render(frames=(1, 2, 1))
    for frame, strands in is_on.items():
        np.testing.assert_allclose(shown[frame - 1].reshape(strands.shape), strands, atol=1e-5)
    assert np.abs(is_on[1] - is_on[2]).max() > 0.05


def test_combing_survives_other_settings_and_another_number_of_guides(layered):
    """With 60, then 120, then 60 guides, the combing is the same, and settings still apply to the base."""
    base, shape = points(layered), comb(layered)
    turn = shape[:, -1] - shape[:, 0] - (base[:, -1] - base[:, 0])
    group = layered.data.vellus.guides
    group.guide_count = 120
    update()
    assert len(layered.data.curves) == 120
    more = points(layered)
    assert np.abs(more[:, -1, 1] - more[:, 0, 1]).mean() > 0.0
    weights = layered.data.vellus.layers[0]
    weights.weight = 0.0
    update()
    bare = points(layered)
    assert np.linalg.norm(more[:, -1] - bare[:, -1], axis=1).mean() > 0.5 * np.linalg.norm(turn, axis=1).mean()
    weights.weight = 1.0
    group.guide_count = 60
    update()
    apart = np.linalg.norm(points(layered) - shape, axis=2).max(axis=1) / lengths(shape)
    assert np.median(apart) < 0.05
    group.length *= 0.5
    update()
    np.testing.assert_allclose(lengths(points(layered)), 0.5 * lengths(shape), rtol=1e-2)


@pytest.mark.parametrize("matrix", [Matrix.Scale(100.0, 4), Matrix.Diagonal((1.0, 2.0, 0.5, 1.0)), Matrix.Scale(-1, 4)])
def test_layers_follow_applied_transforms(layered, matrix):
    base, shape = points(layered), comb(layered)
    sphere = bpy.data.objects["Sphere"]
    sphere.matrix_world = matrix
    update()
    bpy.context.view_layer.objects.active = sphere
    for one in bpy.context.view_layer.objects:
        one.select_set(one == sphere)
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    update()
    change, size = np.array(matrix.to_3x3()), max(abs(v) for v in matrix.to_scale())
    np.testing.assert_allclose(points(layered), shape @ change.T, atol=1e-4 * size)
    set_weight(layered, 0, 0.0)
    np.testing.assert_allclose(points(layered), base @ change.T, atol=1e-4 * size)
    set_weight(layered, 0, 1.0)
    np.testing.assert_allclose(points(layered), shape @ change.T, atol=1e-4 * size)


def test_layers_follow_an_edited_mesh(layered):
    base, shape = points(layered), comb(layered)
    turn = np.array(Matrix.Rotation(0.7, 3, "Y"))
    sphere = bpy.data.objects["Sphere"]
    sphere.data.transform(Matrix.Rotation(0.7, 4, "Y"))
    sphere.data.update_tag()
    update()
    np.testing.assert_allclose(points(layered), shape @ turn.T, atol=1e-4)
    set_weight(layered, 0, 0.0)
    np.testing.assert_allclose(points(layered), base @ turn.T, atol=1e-4)


def test_layers_are_saved_undone_and_linked(layered, tmp_path):
    shape = comb(layered)
    bpy.ops.ed.undo_push(message="combed")
    set_weight(layered, 0, 0.5)
    half = points(layered)
    bpy.ops.ed.undo_push(message="half")
    bpy.ops.ed.undo()
    update()
    guides = bpy.data.objects["Guides"]
    np.testing.assert_allclose(points(guides), shape, atol=1e-6)
    assert guides.data.vellus.layers[0].weight == 1.0
    set_weight(guides, 0, 0.5)
    path = str(tmp_path / "layers.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    guides = bpy.data.objects["Guides"]
    assert np.array_equal(points(guides), half)
    set_weight(guides, 0, 1.0)
    np.testing.assert_allclose(points(guides), shape, atol=1e-6)
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_there, here):
        here.objects = ["Guides", "Sphere"]
    for one in here.objects:
        bpy.context.scene.collection.objects.link(one)
    update()
    linked = bpy.data.objects["Guides"]
    assert np.array_equal(points(linked), half)
    with pytest.raises(HairError, match="linked"):
        api.add_layer(linked)


def test_brushes_may_add_and_delete_guides(layered):
    shape = comb(layered)
    layered.data.add_curves([41])
    added = np.concatenate([points_flat(layered)[:-41], [[0.0, 0.0, 1.0 + 0.01 * i] for i in range(41)]])
    layered.data.attributes["position"].data.foreach_set("vector", added.astype(np.float32).ravel())
    layered.data.update_tag()
    update()
    np.testing.assert_allclose(points_flat(layered), added, atol=1e-6)
    layered.data.remove_curves(indices=[0, 5])
    update()
    kept = np.delete(shape, [0, 5], axis=0)
    np.testing.assert_allclose(points(layered)[:-1], kept, atol=1e-6)
    set_weight(layered, 0, 0.0)
    np.testing.assert_allclose(points_flat(layered)[-41:], added[-41:], atol=1e-6)


def points_flat(guides):
    return curves.read_points(guides.data)
