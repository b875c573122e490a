# SPDX-License-Identifier: GPL-3.0-or-later
"""Stiffen sets the lowest bend stiffness at which guides hold their shape, and the panel counts guides that do not."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.dynamics import dynamics_notes, guide_simulation
from hair_addon.blender.settings import properties
from hair_addon.blender.ui import panels
from hair_addon.core.dynamics.rod.sag_free import GREENHILL
from hair_addon.core.dynamics.rod.stiffness_advice import weight_ratio
from tests.support.interface.layout import draw_all
from tests.support.reading import points


@pytest.fixture
def state(guides):
    """Return upright guides half a meter long, where a stiffness of 8 holds only 0.19 m."""
    guides.data.vellus.dynamics.bend_stiffness = 8.0
    return guides.data.vellus


def comb_straight(height):
    """Comb all guides straight up or down."""
    combed = np.repeat(points(bpy.data.objects["Guides"])[:, :1], 41, axis=1)
    combed[..., 2] += np.linspace(0.0, height, 41)
    positions = bpy.data.objects["Guides"].data.attributes["position"].data
    positions.foreach_set("vector", combed.astype(np.float32).ravel())


def needed(state):
    return guide_simulation.needed_stiffness(state.id_data, bpy.context.scene, bpy.context.evaluated_depsgraph_get())


def test_stiffen_sets_what_the_longest_standing_guide_needs(state):
    expected = needed(state).max()
    assert expected > 8.0
    assert bpy.ops.vellus.stiffen_dynamics() == {"FINISHED"}
    assert expected <= state.dynamics.bend_stiffness <= 1.1 * expected
    assert needed(state).max() == pytest.approx(expected, rel=1e-4)  # whatever the stiffness is
    before = state.dynamics.bend_stiffness
    assert bpy.ops.vellus.stiffen_dynamics() == {"FINISHED"}
    assert state.dynamics.bend_stiffness == before


def test_an_upright_guide_needs_what_greenhill_says(state):
    state.dynamics.bend_stiffness = 1.0
    comb_straight(0.5)
    expected = weight_ratio(properties.dynamics_of(state), 0.5, 9.81) / GREENHILL
    np.testing.assert_allclose(needed(state), expected, rtol=0.02)


def test_undo_takes_it_back(state):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.vellus.stiffen_dynamics("EXEC_DEFAULT", True)
    bpy.ops.ed.undo()
    assert bpy.data.objects["Guides"].data.vellus.dynamics.bend_stiffness == 8.0


def test_guides_that_hang_need_none(state):
    comb_straight(-0.5)
    assert needed(state).max() == 0.0
    assert bpy.ops.vellus.stiffen_dynamics() == {"FINISHED"}
    assert state.dynamics.bend_stiffness == 8.0


def test_the_panel_says_how_many_guides_are_too_soft(state):
    """After a simulation the panel shows the number, follows the settings and offers the button."""
    panel = [panels.dynamics.VELLUS_PT_dynamics_material]
    assert dynamics_notes.stiffness_note(state.id_data) == "" and not draw_all(panel)["vellus.stiffen_dynamics"]
    count, most = (needed(state) > 8.0).sum(), needed(state).max()
    note = dynamics_notes.stiffness_note(state.id_data)
    assert note.startswith(f"{count} of 60 guides cannot hold their shape")
    assert f"{dynamics_notes.rounded_up(float(most)):g}" in note
    assert draw_all(panel)["vellus.stiffen_dynamics"] == 1
    state.dynamics.weight = 2.0
    assert f"{dynamics_notes.rounded_up(2.0 * float(most)):g}" in dynamics_notes.stiffness_note(state.id_data)
    bpy.ops.vellus.stiffen_dynamics()
    assert dynamics_notes.stiffness_note(state.id_data) == ""


@pytest.mark.parametrize(("stiffness", "rounded"), [(8.01, 8.1), (8.0, 8.0), (123.0, 130.0), (0.0341, 0.035)])
def test_stiffness_is_rounded_up(stiffness, rounded):
    assert dynamics_notes.rounded_up(stiffness) == pytest.approx(rounded, rel=1e-9)


def test_more_than_there_is_is_refused(state):
    state.dynamics.weight, state.dynamics.fibre_radius = 10.0, 1e-6
    with pytest.raises(RuntimeError, match="shorten them, or use Hold"):
        bpy.ops.vellus.stiffen_dynamics()
    assert state.dynamics.bend_stiffness == 8.0
