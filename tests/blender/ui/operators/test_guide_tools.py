# SPDX-License-Identifier: GPL-3.0-or-later
"""Guide tools keep combing, let hair follow, and support selection, masks, undo and redo."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import curves
from hair_addon.blender.host import running
from hair_addon.blender.live import invalidation, live_hair
from tests.support.counting import counts_of
from tests.support.dynamics.following import update
from tests.support.guide_tools import CHOSEN, SHAPING, TOOLS, grown_from_nothing, lengths_of, select_guides, use_tool
from tests.support.interface.layout import draw_all, redo_panel
from tests.support.pairs import pairs, share_of
from tests.support.reading import points, snapshot


@pytest.mark.parametrize(("name", "active"), pairs(TOOLS, ["Sphere", "Guides", "Hair"], 6))
def test_hair_follows_whatever_is_active(waved, name, active):
    before, strands = points(bpy.data.objects["Guides"]), points(waved)
    bpy.context.view_layer.objects.active = bpy.data.objects[active]
    after, grown = use_tool(name)
    assert len(after) != len(before) or not np.array_equal(after, before)
    assert not np.array_equal(grown, strands)
    assert np.array_equal(grown, grown_from_nothing(waved))
    assert bpy.context.object.name == active


@pytest.mark.parametrize("name", TOOLS)
def test_undo_and_redo(waved, name):
    before = points(bpy.data.objects["Guides"]), points(waved)
    after = use_tool(name)
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
def test_other_values_in_the_redo_panel_begin_with_the_guides_as_they_were(waved, name, values):
    wanted = use_tool(name, **values)
    bpy.ops.ed.undo()
    update()
    use_tool(name)
    bpy.ops.ed.undo()  # as the panel does before it calls the tool again
    found = use_tool(name, **values)
    assert all(map(np.array_equal, found, wanted))


@pytest.mark.parametrize("name", share_of(TOOLS, 2))
def test_guides_count_as_combed_and_settings_leave_them_alone(waved, name):
    guides = bpy.data.objects["Guides"].data
    after, _strands = use_tool(name)
    assert curves.is_combed(guides) and not curves.is_hand_made(guides)
    guides.vellus.guides.length = 0.9
    update()
    assert np.array_equal(points(bpy.data.objects["Guides"]), after)
    assert "Regenerate Guides" in guides.vellus.status


@pytest.mark.parametrize(("domain", "kind"), [("CURVE", "BOOLEAN"), ("POINT", "BOOLEAN"), ("CURVE", "FLOAT")])
@pytest.mark.parametrize("name", sorted(set(CHOSEN) & SHAPING.keys()))
def test_only_selected_guides_change(waved, name, domain, kind):
    guides = bpy.data.objects["Guides"]
    chosen = np.arange(60) % 3 == 0
    select_guides(guides, chosen, domain, kind)
    before = points(guides)
    after, _strands = use_tool(name)
    has_changed = (after != before).any(axis=(1, 2))
    assert not has_changed[~chosen].any() and has_changed[chosen].any()
    bpy.ops.ed.undo()
    every, _strands = use_tool(name, selected_only=False)
    # Falling guides are counted in masses and from a place that all of them have in common.
    np.testing.assert_allclose(every[chosen], after[chosen], rtol=0.0, atol=1e-5 if name == "drape_guides" else 0.0)
    assert (every != before).any(axis=(1, 2))[~chosen].any()


@pytest.mark.parametrize("name", share_of(sorted(set(CHOSEN) & SHAPING.keys()), 2))
def test_without_a_selection_all_guides_change(waved, name):
    guides = bpy.data.objects["Guides"]
    every, _strands = use_tool(name)
    bpy.ops.ed.undo()
    guides = bpy.data.objects["Guides"]
    select_guides(guides, np.zeros(60, bool))
    found, _strands = use_tool(name)
    assert np.array_equal(found, every)


@pytest.mark.parametrize("name", sorted(set(CHOSEN) & SHAPING.keys()))
def test_a_mask_scales_the_effect(waved, name):
    before = points(bpy.data.objects["Guides"])
    after, _strands = use_tool(name, mask="top")
    low, high = before[:, 0, 2] < -0.2, before[:, 0, 2] > 0.2
    has_changed = (after != before).any(axis=(1, 2))
    assert not has_changed[low].any() and has_changed[high].any()


def test_a_half_selected_guide_changes_by_half(waved):
    guides = bpy.data.objects["Guides"]
    before = lengths_of(points(guides))
    select_guides(guides, np.full(60, 0.5), kind="FLOAT")
    after, _strands = use_tool("guide_length", factor=0.5)
    np.testing.assert_allclose(lengths_of(after), 0.75 * before, rtol=1e-4)


@pytest.mark.parametrize(("name", "mode"), pairs(TOOLS, ["SCULPT_CURVES", "EDIT"], 4))
def test_tools_work_where_artists_select(waved, name, mode):
    outside, _strands = use_tool(name)
    bpy.ops.ed.undo()
    update()
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    bpy.data.objects["Guides"].select_set(True)
    bpy.ops.object.mode_set(mode=mode)
    before = points(bpy.data.objects["Guides"])
    bpy.ops.ed.undo_push(message="mode")
    inside, _strands = use_tool(name)
    np.testing.assert_allclose(inside, outside, atol=1e-6)
    bpy.ops.ed.undo()
    update()
    assert np.array_equal(points(bpy.data.objects["Guides"]), before)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(points(bpy.data.objects["Hair"]), grown_from_nothing(bpy.data.objects["Hair"]))


def test_tools_are_not_there_in_modes_of_the_surface(waved):
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    for mode, is_there in (("EDIT", False), ("OBJECT", True)):
        bpy.ops.object.mode_set(mode=mode)
        assert {getattr(bpy.ops.vellus, name).poll() for name in TOOLS} == {is_there}


def test_nothing_else_is_made(waved):
    before = snapshot()
    for name in TOOLS:
        use_tool(name)
    assert snapshot() == before


@pytest.mark.parametrize("active", ["Sphere", "Guides", "Hair"])
def test_the_panel_and_the_menu_offer_each_tool_once(waved, active):
    bpy.context.view_layer.objects.active = bpy.data.objects[active]
    for drawn in (draw_all([bpy.types.VELLUS_PT_guides_tools]), draw_all([bpy.types.VELLUS_MT_guide_tools])):
        assert {name: drawn[f"vellus.{name}"] for name in TOOLS} == dict.fromkeys(TOOLS, 1)


@pytest.mark.parametrize("name", sorted(SHAPING.keys() - {"copy_guide_shape"}))  # it looks for the nearest guides
def test_hair_follows_as_it_follows_a_brush(waved, monkeypatch, name):
    """Hair follows a tool as it follows a brush, without a search among guides and without binding again."""
    calls = counts_of(monkeypatch)
    use_tool(name)
    assert (calls["searches"], calls["writes"]) == (0, 1)


@pytest.mark.parametrize("name", share_of(TOOLS, 2))
def test_undo_in_a_window_keeps_hair_and_guides_together(waved, monkeypatch, name):
    """Undo in a window keeps hair and guides together, although hair is written after the undo step was pushed."""
    monkeypatch.setattr(running, "has_window", lambda: True)
    before = points(bpy.data.objects["Guides"]), points(waved)
    use_tool(name)
    live_hair.write_all()
    after = points(bpy.data.objects["Guides"]), points(bpy.data.objects["Hair"])
    assert np.array_equal(after[1], grown_from_nothing(bpy.data.objects["Hair"]))
    for operator, wanted in ((bpy.ops.ed.undo, before), (bpy.ops.ed.redo, after)):
        operator()
        update()
        live_hair.write_all()
        for found, strands in zip(("Guides", "Hair"), wanted, strict=True):
            assert np.array_equal(points(bpy.data.objects[found]), strands)
    live_hair.cancel_writing()
    invalidation.data_replaced()


# Names of choices → the settings that a tool shows with them.
SHOWN = {
    "guide_length": ({"method": "SET"}, {"method", "length", "shorten"}, {"method", "factor", "shorten"}),
    "change_guide_count": ({"method": "COUNT"}, {"method", "guide_count"}, {"method", "factor"}),
    "trim_guides": ({}, {"cutter"}, {"cutter"}),
    "mirror_guides": ({}, {"direction"}, {"direction"}),
    "smooth_guides": ({}, {"strength", "iterations"}, {"strength", "iterations"}),
    "lift_guides": ({}, {"amount", "reach"}, {"amount", "reach"}),
    "attract_guides": ({}, {"amount", "clearance"}, {"amount", "clearance"}),
}


@pytest.mark.parametrize("name", SHOWN)
def test_the_redo_panel_shows_what_has_an_effect(waved, name):
    values, chosen, default = SHOWN[name]
    for given, wanted in ((values, chosen), ({}, default)):
        drawn = redo_panel(name, **given)
        shown = {row for row in drawn.drawn if row != "label"}
        assert shown == wanted | {"selected_only", "mask"}
        assert drawn.picked["mask"] == bpy.data.objects["Sphere"].vertex_groups


def test_the_redo_panel_of_copies_picks_groups(waved):
    drawn = redo_panel("copy_guide_shape")
    assert {row for row in drawn.drawn if row != "label"} == {"source", "target", "mapping", "copy_length", "amount"}
    assert drawn.picked["source"] == drawn.picked["target"] == bpy.data.objects["Sphere"].vertex_groups


def test_no_attraction_says_why_nothing_changes(waved, capfd):
    """At an amount of 0, with which the redo panel may begin, a message says why nothing changes."""
    before = points(bpy.data.objects["Guides"])
    use_tool("attract_guides", amount=0.0)
    assert np.array_equal(points(bpy.data.objects["Guides"]), before)
    assert "No guides changed: the amount is 0" in capfd.readouterr().out
