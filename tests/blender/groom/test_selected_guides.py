# SPDX-License-Identifier: GPL-3.0-or-later
"""Selections of guides are saved by name and selected again."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import attributes, selection_sets
from hair_addon.blender.settings import selection_names
from hair_addon.blender.ui import panels
from tests.support.interface.layout import draw


@pytest.fixture
def guides(hair):
    """Return the active guides, whose points or curves Blender selects."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    return bpy.data.objects["Guides"].data


def choose(guides, indices, domain="CURVE"):
    count = len(guides.curves) if domain == "CURVE" else len(guides.points)
    attributes.write(guides, ".selection", "BOOLEAN", domain, np.isin(np.arange(count), indices))


@pytest.mark.parametrize("domain", ["POINT", "CURVE"])
def test_a_saved_selection_comes_back(guides, domain):
    """Selections come back exactly, extend the present one, or are taken away from it."""
    guides.selection_domain = domain
    expected = {}
    for name, indices in (("Left", [1, 2, 5]), ("Fringe", [5, 7])):
        choose(guides, indices, domain)
        expected[name] = selection_sets.selected(guides)
        assert bpy.ops.vellus.save_selection(name=name) == {"FINISHED"}
    assert selection_names.names_of(guides) == ["Fringe", "Left"]
    left, fringe = expected["Left"], expected["Fringe"]
    for name, mode, wanted in (
        ("Left", "SET", left),
        ("Fringe", "ADD", left | fringe),
        ("Left", "REMOVE", fringe & ~left),
        ("Fringe", "SET", fringe),
    ):
        bpy.ops.vellus.select_saved(name=name, mode=mode)
        np.testing.assert_array_equal(selection_sets.selected(guides), wanted)
    layout = draw(panels.guides.VELLUS_PT_guides_selections)
    assert layout.drawn["vellus.select_saved"] == 2 and "Fringe" in layout.buttons
    bpy.ops.vellus.remove_selection(name="Left")
    assert selection_names.names_of(guides) == ["Fringe"]


def test_all_and_no_selected_points_are_extended_and_reduced_as_others(guides):
    """All points stay selected when a set extends them; a set is taken away from all, and not from none."""
    choose(guides, [1, 2])
    bpy.ops.vellus.save_selection(name="Left")
    left = selection_sets.selected(guides)
    for is_stored in (True, False):
        for mode, wanted in (("ADD", np.ones_like(left)), ("REMOVE", ~left)):
            choose(guides, range(len(guides.curves)))
            if not is_stored:  # Blender stores no selection if all is selected
                guides.attributes.remove(guides.attributes[".selection"])
            bpy.ops.vellus.select_saved(name="Left", mode=mode)
            np.testing.assert_array_equal(selection_sets.present(guides), wanted)
    choose(guides, [])
    with pytest.raises(RuntimeError, match="No point"):
        bpy.ops.vellus.select_saved(name="Left", mode="REMOVE")
    bpy.ops.vellus.select_saved(name="Left", mode="ADD")
    np.testing.assert_array_equal(selection_sets.selected(guides), left)


def test_selections_move_no_guide_and_outlast_removed_guides(guides):
    """Saving and selecting changes no point; guides that stay are in the same sets after others are removed."""
    before = attributes.read(guides, "position", "FLOAT_VECTOR", "POINT")
    choose(guides, [3, 4])
    bpy.ops.vellus.save_selection(name="Top")
    bpy.ops.vellus.select_saved(name="Top")
    np.testing.assert_array_equal(attributes.read(guides, "position", "FLOAT_VECTOR", "POINT"), before)
    guides.remove_curves(indices=[0, 3])
    bpy.ops.vellus.select_saved(name="Top")
    found = selection_sets.selected(guides).reshape(len(guides.curves), -1)
    assert found.all(axis=1).nonzero()[0].tolist() == [2] == found.any(axis=1).nonzero()[0].tolist()


def test_what_cannot_be_saved_or_selected_is_one_sentence(guides):
    for call, sentence in [
        (lambda: bpy.ops.vellus.save_selection(name="All"), "Select guides"),
        (lambda: bpy.ops.vellus.select_saved(name="None"), 'no selection "None"'),
        (lambda: bpy.ops.vellus.remove_selection(name="None"), 'no selection "None"'),
        (lambda: bpy.ops.vellus.save_selection(name="x" * 60), "at most 40 letters"),
        (lambda: bpy.ops.vellus.save_selection(name="é" * 30), "at most 20 letters"),
    ]:
        with pytest.raises(RuntimeError, match=sentence):
            call()
    choose(guides, [1])
    bpy.ops.vellus.save_selection(name="One")
    with pytest.raises(RuntimeError, match="No point"):
        bpy.ops.vellus.select_saved(name="One", mode="REMOVE")
