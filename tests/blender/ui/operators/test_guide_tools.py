# SPDX-License-Identifier: GPL-3.0-or-later
"""Guide tools in Blender: combing is kept, hair follows, and selection, masks, undo and redo do what artists expect."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import curves
from hair_addon.blender.groom import guide_tools, pipeline
from tests.support.following import assert_follows, update
from tests.support.layout import draw_all
from tests.support.reading import attribute, points, snapshot, write_points

# Tools that move points and add none, each with values that change every guide.
SHAPING = {
    "guide_length": {"factor": 0.5},
    "trim_guides": {"cutter": "Cutter"},
    "smooth_guides": {"strength": 0.9, "iterations": 30},
    "lift_guides": {"amount": 0.8},
    "attract_guides": {"amount": 0.8, "clearance": 0.02},
    "copy_guide_shape": {"source": "top"},
}
TOOLS = SHAPING | {"change_guide_count": {"factor": 1.5}, "mirror_guides": {}}
CHOSEN = sorted(TOOLS.keys() - {"copy_guide_shape"})  # that selection and mask choose the guides of


@pytest.fixture
def groom(hair):
    """Hair whose guides were combed to waves, and a mesh that cuts every guide."""
    comb(bpy.data.objects["Guides"])
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=1.2)
    bpy.context.object.name = "Cutter"
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    bpy.ops.ed.undo_push(message="combed")
    return bpy.data.objects["Hair"]


def comb(guides):
    combed = points(guides)
    along = np.linspace(0.0, 1.0, combed.shape[1])[:, None]
    waves = 0.05 * np.sin(9.0 * along + np.arange(len(combed))[:, None, None]) * np.roll(combed[:, :1], 1, axis=2)
    write_points(guides, combed + along * waves)


def use(name, **values):
    """Call a tool as a click does, with an undo step; returns guides and hair afterwards."""
    assert getattr(bpy.ops.vellus, name)("EXEC_DEFAULT", True, **TOOLS[name] | values) == {"FINISHED"}
    update()
    return points(bpy.data.objects["Guides"]), points(bpy.data.objects["Hair"])


def refused(name, **values):
    """What a tool says that does nothing."""
    with pytest.raises(RuntimeError) as error:
        getattr(bpy.ops.vellus, name)(**TOOLS[name] | values)
    assert "Traceback" not in str(error.value)
    return str(error.value)


def select(guides, chosen, domain="CURVE", kind="BOOLEAN"):
    """As Sculpt Mode stores a selection."""
    attributes = guides.data.attributes
    if ".selection" in attributes:
        attributes.remove(attributes[".selection"])
    values = np.repeat(chosen, 41) if domain == "POINT" else chosen
    made = attributes.new(".selection", kind, domain)
    made.data.foreach_set("value", np.asarray(values, np.float32 if kind == "FLOAT" else bool))


def grown_from_nothing(hair):
    """(S, P, 3) that interpolation makes of the guides as they are now."""
    return pipeline.bind_hair(*pipeline.inputs_of(hair.data), bpy.context.evaluated_depsgraph_get()).points


def lengths(strands):
    return np.linalg.norm(np.diff(strands.astype(np.float64), axis=1), axis=2).sum(axis=1)


@pytest.mark.parametrize("active", ["Sphere", "Guides", "Hair"])
@pytest.mark.parametrize("name", TOOLS)
def test_hair_follows_whatever_is_active(groom, name, active):
    before, strands = points(bpy.data.objects["Guides"]), points(groom)
    bpy.context.view_layer.objects.active = bpy.data.objects[active]
    after, grown = use(name)
    assert len(after) != len(before) or not np.array_equal(after, before)
    assert not np.array_equal(grown, strands)
    assert np.array_equal(grown, grown_from_nothing(groom))
    assert bpy.context.object.name == active


@pytest.mark.parametrize("name", TOOLS)
def test_undo_and_redo(groom, name):
    before = points(bpy.data.objects["Guides"]), points(groom)
    after = use(name)
    bpy.ops.ed.undo()
    update()
    for found, wanted in zip(("Guides", "Hair"), before, strict=True):
        assert np.array_equal(points(bpy.data.objects[found]), wanted)
    bpy.ops.ed.redo()
    update()
    for found, wanted in zip(("Guides", "Hair"), after, strict=True):
        assert np.array_equal(points(bpy.data.objects[found]), wanted)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("guide_length", {"method": "SET", "length": 0.2}),
        ("smooth_guides", {"iterations": 5}),
        ("lift_guides", {"amount": 0.3}),
        ("attract_guides", {"amount": 0.2}),
        ("change_guide_count", {"method": "COUNT", "guide_count": 25}),
        ("mirror_guides", {"direction": "FROM_NEGATIVE"}),
        ("copy_guide_shape", {"mapping": "NEAREST"}),
    ],
)
def test_other_values_in_the_redo_panel_begin_with_the_guides_as_they_were(groom, name, values):
    wanted = use(name, **values)
    bpy.ops.ed.undo()
    update()
    use(name)
    bpy.ops.ed.undo()  # as the panel does before it calls the tool again
    found = use(name, **values)
    assert all(map(np.array_equal, found, wanted))


@pytest.mark.parametrize("name", TOOLS)
def test_guides_count_as_combed_and_settings_leave_them_alone(groom, name):
    guides = bpy.data.objects["Guides"].data
    after, _strands = use(name)
    assert curves.is_combed(guides) and not curves.is_hand_made(guides)
    guides.vellus.guides.length = 0.9
    update()
    assert np.array_equal(points(bpy.data.objects["Guides"]), after)
    assert "Regenerate Guides" in guides.vellus.status


@pytest.mark.parametrize(("domain", "kind"), [("CURVE", "BOOLEAN"), ("POINT", "BOOLEAN"), ("CURVE", "FLOAT")])
@pytest.mark.parametrize("name", sorted(set(CHOSEN) & SHAPING.keys()))
def test_only_selected_guides_change(groom, name, domain, kind):
    guides = bpy.data.objects["Guides"]
    chosen = np.arange(60) % 3 == 0
    select(guides, chosen, domain, kind)
    before = points(guides)
    after, _strands = use(name)
    has_changed = (after != before).any(axis=(1, 2))
    assert not has_changed[~chosen].any() and has_changed[chosen].any()
    bpy.ops.ed.undo()
    every, _strands = use(name, selected_only=False)
    assert np.array_equal(every[chosen], after[chosen])
    assert (every != before).any(axis=(1, 2))[~chosen].any()


@pytest.mark.parametrize("name", sorted(set(CHOSEN) & SHAPING.keys()))
def test_without_a_selection_all_guides_change(groom, name):
    guides = bpy.data.objects["Guides"]
    every, _strands = use(name)
    bpy.ops.ed.undo()
    guides = bpy.data.objects["Guides"]
    select(guides, np.zeros(60, bool))
    found, _strands = use(name)
    assert np.array_equal(found, every)


@pytest.mark.parametrize("name", sorted(set(CHOSEN) & SHAPING.keys()))
def test_a_mask_scales_the_effect(groom, name):
    before = points(bpy.data.objects["Guides"])
    after, _strands = use(name, mask="top")
    low, high = before[:, 0, 2] < -0.2, before[:, 0, 2] > 0.2
    has_changed = (after != before).any(axis=(1, 2))
    assert not has_changed[low].any() and has_changed[high].any()


def test_a_half_selected_guide_changes_by_half(groom):
    guides = bpy.data.objects["Guides"]
    before = lengths(points(guides))
    select(guides, np.full(60, 0.5), kind="FLOAT")
    after, _strands = use("guide_length", factor=0.5)
    np.testing.assert_allclose(lengths(after), 0.75 * before, rtol=1e-4)


@pytest.mark.parametrize("mode", ["SCULPT_CURVES", "EDIT"])
@pytest.mark.parametrize("name", TOOLS)
def test_tools_work_where_artists_select(groom, name, mode):
    outside, _strands = use(name)
    bpy.ops.ed.undo()
    update()
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    bpy.data.objects["Guides"].select_set(True)
    bpy.ops.object.mode_set(mode=mode)
    before = points(bpy.data.objects["Guides"])
    bpy.ops.ed.undo_push(message="mode")
    inside, _strands = use(name)
    np.testing.assert_allclose(inside, outside, atol=1e-6)
    bpy.ops.ed.undo()
    update()
    assert np.array_equal(points(bpy.data.objects["Guides"]), before)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(points(bpy.data.objects["Hair"]), grown_from_nothing(bpy.data.objects["Hair"]))


def test_tools_are_not_there_in_modes_of_the_surface(groom):
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    for mode, is_there in (("EDIT", False), ("OBJECT", True)):
        bpy.ops.object.mode_set(mode=mode)
        assert {getattr(bpy.ops.vellus, name).poll() for name in TOOLS} == {is_there}


def test_nothing_else_is_made(groom):
    before = snapshot()
    for name in TOOLS:
        use(name)
    assert snapshot() == before


@pytest.mark.parametrize("active", ["Sphere", "Guides", "Hair"])
def test_the_panel_and_the_menu_offer_each_tool_once(groom, active):
    bpy.context.view_layer.objects.active = bpy.data.objects[active]
    for drawn in (draw_all([bpy.types.VELLUS_PT_guides_tools]), draw_all([bpy.types.VELLUS_MT_guide_tools])):
        assert {name: drawn[f"vellus.{name}"] for name in TOOLS} == dict.fromkeys(TOOLS, 1)


# Surfaces that are scaled, deformed, or gone.


@pytest.fixture
def turned(groom):
    """The groom on a turned, moved object of twice the size."""
    surface = bpy.data.objects["Sphere"]
    surface.location, surface.rotation_euler, surface.scale = (1.0, 2.0, 3.0), (0.3, 0.2, 0.5), (2.0, 2.0, 2.0)
    cutter = bpy.data.objects["Cutter"]
    cutter.location, cutter.scale = surface.location, surface.scale
    update()
    return groom


@pytest.mark.parametrize("name", SHAPING)
def test_roots_keep_their_bits_on_any_object(turned, name):
    before = points(bpy.data.objects["Guides"])
    after, _strands = use(name)
    assert np.array_equal(after[:, 0], before[:, 0])
    np.testing.assert_allclose(points(turned), grown_from_nothing(turned), atol=2e-6)


def test_lengths_are_those_of_the_world(turned):
    after, _strands = use("guide_length", method="SET", length=0.3)
    np.testing.assert_allclose(2.0 * lengths(after), 0.3, rtol=1e-4)
    assert guide_tools.median_length(bpy.data.objects["Guides"].data) == pytest.approx(0.3, rel=1e-4)


def test_a_cutter_cuts_where_it_is_in_the_world(turned):
    before = points(bpy.data.objects["Guides"])
    after, _strands = use("trim_guides")
    # Twice as large, the cutter has a radius of 1.2 in the coordinates of the sphere.
    reaches = np.linalg.norm(before, axis=2).max(axis=1)
    crosses, stays = reaches > 1.21, reaches < 1.18
    assert min(crosses.sum(), stays.sum()) > 3
    np.testing.assert_allclose(np.linalg.norm(after[crosses, -1], axis=1), 1.2, atol=0.01)
    assert np.array_equal(after[stays], before[stays])


def an_empty(location, rotation=(0.0, 0.0, 0.0)):
    made = bpy.data.objects.new("Plane", None)
    made.location, made.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(made)
    update()
    return made


def test_an_empty_cuts_off_what_is_on_its_z_side(turned):
    before = points(bpy.data.objects["Guides"])
    plane = an_empty((1.0, 2.0, 3.3), (np.pi + 0.4, -0.3, 0.0))
    after, _strands = use("trim_guides", cutter="Plane")
    to_plane = np.array(plane.matrix_world.inverted() @ bpy.data.objects["Sphere"].matrix_world)
    was, now = (p @ to_plane[:3, :3].T + to_plane[:3, 3] for p in (before, after))
    is_below = was[:, 0, 2] < 0.0
    assert was[is_below, :, 2].max() > 0.1 and now[is_below, :, 2].max() < 1e-5
    assert np.array_equal(after[~is_below], before[~is_below])


def test_a_deformed_surface_is_cut_where_it_is_seen(groom):
    """The sphere is stretched by a modifier: what Blender renders ends at the plane, roots still follow."""
    surface = bpy.data.objects["Sphere"]
    modifier = surface.modifiers.new("Stretch", "SIMPLE_DEFORM")
    modifier.deform_method, modifier.factor, modifier.deform_axis = "STRETCH", 0.6, "Z"
    update()
    an_empty((0.0, 0.0, 0.5), (np.pi, 0.0, 0.0))
    guides = bpy.data.objects["Guides"]
    seen = evaluated(guides)
    use("trim_guides", cutter="Plane")
    now = evaluated(guides)
    is_above = seen[:, 0, 2] > 0.5
    assert seen[is_above, :, 2].min() < 0.4 and now[is_above, :, 2].min() > 0.5 - 1e-3
    assert_follows(guides, groom)


def evaluated(curves_object):
    found = curves_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty((len(found.points), 3), np.float32)
    found.attributes["position"].data.foreach_get("vector", positions.ravel())
    return positions.reshape(len(found.curves), -1, 3)


@pytest.mark.parametrize("name", TOOLS)
def test_hair_follows_on_a_deformed_surface(groom, name):
    modifier = bpy.data.objects["Sphere"].modifiers.new("Bend", "SIMPLE_DEFORM")
    modifier.deform_method, modifier.angle = "BEND", 0.9
    update()
    use(name)
    assert_follows(bpy.data.objects["Guides"], groom)


def test_errors_change_nothing(groom):
    guides = bpy.data.objects["Guides"]
    before, everything = points(guides), snapshot()
    assert "no vertex group" in refused("smooth_guides", mask="none")
    assert "Pick the object that cuts" in refused("trim_guides", cutter="")
    assert "There is no object" in refused("trim_guides", cutter="none")
    assert "is the surface" in refused("trim_guides", cutter="Sphere")
    assert "Select the guides to copy from" in refused("copy_guide_shape", source="")
    assert "no vertex group" in refused("copy_guide_shape", target="none")
    select(guides, before[:, 0, 2] < -0.2)
    assert "both selected and inside the mask" in refused("lift_guides", mask="top")
    bpy.data.objects["Cutter"].scale = (0.0, 0.0, 0.0)
    update()
    assert "scale of zero" in refused("trim_guides")
    assert np.array_equal(points(guides), before) and snapshot() == everything


@pytest.mark.parametrize("name", TOOLS)
def test_guides_without_a_surface_or_with_broken_points_are_refused(groom, name):
    guides = bpy.data.objects["Guides"]
    broken = points(guides)
    broken[5, 3] = np.nan
    guides.data.attributes["position"].data.foreach_set("vector", broken.ravel())
    assert "non-finite" in refused(name)
    bpy.data.objects.remove(bpy.data.objects["Sphere"])
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    assert "The surface is missing" in refused(name)


def test_no_guides_left(groom):
    bpy.data.objects["Guides"].data.remove_curves(indices=list(range(60)))
    for name in TOOLS:
        assert "has no guides" in refused(name)


@pytest.fixture
def ragged(imported):
    """Curves of 2 to 12 points used as guides, some smooth, with hair."""
    bpy.context.view_layer.objects.active = imported
    bpy.ops.vellus.use_as_guides(surface="Sphere", strand_count=300)
    imported.data.set_types(type="CATMULL_ROM", indices=list(range(0, len(imported.data.curves), 2)))
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=2.3, location=(1.0, 2.0, 3.0))
    bpy.context.object.name = "Cutter"
    bpy.context.view_layer.objects.active = imported
    update()
    return imported


@pytest.mark.parametrize("name", TOOLS)
def test_guides_of_any_point_counts(ragged, name):
    counts, firsts = curves.point_counts(ragged.data), curves.first_points(ragged.data)
    before = curves.read_points(ragged.data)
    named = attribute(ragged, "clump")
    assert getattr(bpy.ops.vellus, name)(**TOOLS[name]) == {"FINISHED"}
    update()
    after = curves.read_points(ragged.data)
    assert np.isfinite(after).all() and curves.is_hand_made(ragged.data)
    if name in SHAPING:
        assert np.array_equal(curves.point_counts(ragged.data), counts)
        assert np.array_equal(curves.first_points(ragged.data), firsts)
        assert not np.array_equal(after, before)
    elif name == "change_guide_count":
        assert np.array_equal(after[: len(before)], before)
        assert np.array_equal(attribute(ragged, "clump")[: len(named)], named)
    hair = next(o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR")
    assert hair.data.vellus.status == "" and np.array_equal(points(hair), grown_from_nothing(hair))


def test_any_tools_in_any_order(groom, rng):
    """Tools with any values, undone now and then: guides stay finite, and hair is what they make it."""
    names = sorted(TOOLS)
    for _ in range(40):
        name = names[rng.integers(len(names))]
        values = {"factor": float(rng.choice([0.3, 0.9, 1.0, 1.4]))} if "factor" in TOOLS[name] else {}
        if name in CHOSEN and rng.random() < 0.3:
            values["mask"] = "top"
        if rng.random() < 0.2:
            guides = bpy.data.objects["Guides"]
            select(guides, rng.random(len(guides.data.curves)) < 0.5)
        try:
            use(name, **values)
        except RuntimeError as error:
            assert "Traceback" not in str(error)
        if rng.random() < 0.3:
            bpy.ops.ed.undo()
            update()
        assert np.isfinite(points(bpy.data.objects["Guides"])).all()
    hair = bpy.data.objects["Hair"]
    assert np.array_equal(points(hair), grown_from_nothing(hair))
