# SPDX-License-Identifier: GPL-3.0-or-later
"""The Dynamics panel has a row for each setting in effect, and notes on the effect of settings."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.dynamics import dynamics_notes, frame_folders
from hair_addon.blender.groom.guides import guide_tools
from hair_addon.blender.ui import panels
from hair_addon.core.dynamics.collision.collider_settings import ColliderSettings
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.dynamics.rod.stiffness_advice import bend_under_weight
from hair_addon.core.params import declared
from tests.support.interface.layout import draw, draw_all
from tests.support.reading import points, write_points

OURS = [panel for panel in panels.CLASSES if panel.bl_idname.startswith("VELLUS_PT_dynamics")]


@pytest.fixture
def state(hair):
    return bpy.data.objects["Guides"].data.vellus


def drawn():
    return draw_all(OURS)


@pytest.mark.parametrize("active", ["Sphere", "Guides", "Hair"])
def test_every_setting_has_a_row(state, active):
    bpy.context.view_layer.objects.active = bpy.data.objects[active]
    state.dynamics.hold = 1.0
    names = [name for name, *_ in declared(DynamicsSettings)]
    found = drawn()
    assert {name: found[name] for name in names} == dict.fromkeys(names, 1)
    assert found["simulates"] == found["vellus.apply_dynamics_preset"] == 1


HIDDEN = {
    "nothing to collide with": (
        {"collides_with_surface": False},
        {"collision_distance", "friction", "keeps_hair_outside"},
    ),
    "a collection": ({"collides_with_surface": False, "colliders": "Body"}, set()),
    "no forces between strands": ({"hair_friction": 0.0, "hair_pressure": 0.0}, {"cell_size"}),
    "friction alone": ({"hair_pressure": 0.0}, set()),
    "no pull": ({"hold": 0.0}, {"hold_tip"}),
}


@pytest.mark.parametrize("case", HIDDEN)
def test_settings_without_effect_are_hidden(state, case):
    changes, hidden = HIDDEN[case]
    for name, value in ({"hold": 1.0} | changes).items():
        setattr(state.dynamics, name, value)
    found = drawn()
    assert {name for name, *_ in declared(DynamicsSettings) if not found[name]} == hidden


def test_colliders_are_picked_among_collections(state):
    assert draw(bpy.types.VELLUS_PT_dynamics_collision).picked == {"colliders": bpy.data.collections}


def test_the_panel_draws_where_no_folder_can_hold_frames(state):
    """The panel is drawn in a new file, which has no folder for frames."""
    assert not bpy.data.filepath and state.cache_folder.startswith("//")
    state.simulates = True
    assert frame_folders.frames_of(bpy.data.objects["Guides"].data) is None
    assert drawn()["cache_folder"] == 1


def test_only_guides_have_dynamics(sphere):
    assert [panel for panel in OURS if panel.bl_idname == "VELLUS_PT_dynamics" and draw(panel) is not None] == []


def test_meshes_have_a_panel_where_there_are_guides(sphere):
    """Meshes have a panel of overrides where guides use it."""
    panel, collider = bpy.types.VELLUS_PT_collider, sphere.vellus
    assert draw(panel) is None
    bpy.ops.vellus.distribute_guides(guide_count=10)
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    assert draw(panel) is None
    bpy.context.view_layer.objects.active = sphere
    assert {*draw(panel).drawn} == {"overrides_friction", "overrides_distance", "is_double_sided", "label"}
    collider.overrides_friction = collider.overrides_distance = True
    found = draw(panel).drawn
    assert all(found[name] == 1 for name, *_ in declared(ColliderSettings))
    bpy.context.view_layer.objects.active = None
    assert draw(panel) is None


# The effect of settings.


def bends(length, **settings):
    return bend_under_weight(DynamicsSettings(**settings), length, 9.81)


def sentence(state):
    return dynamics_notes.bend_note(state.id_data, bpy.context.scene)


def test_the_bend_is_that_of_the_guides_length(state):
    bpy.data.objects["Hair"].data.vellus.is_live = state.is_live = False
    scene = bpy.context.scene
    state.guides.length = 0.15
    assert sentence(state) == f"A 15 cm guide of this material bends by {100 * bends(0.15):.1f} cm under its weight."
    state.dynamics.bend_stiffness = 1000.0
    stiff = 1000 * bends(0.15, bend_stiffness=1000.0)
    assert sentence(state) == f"A 15 cm guide of this material bends by {stiff:.2g} mm under its weight."
    scene.unit_settings.system = "IMPERIAL"
    assert sentence(state).startswith('A 5.9" guide')
    scene.unit_settings.system = "NONE"
    assert sentence(state).startswith("A 15 cm guide")
    scene.unit_settings.scale_length = 0.1
    assert sentence(state).startswith("A 1.5 cm guide")
    state.dynamics.size = 10.0
    assert sentence(state).startswith("A 15 cm guide")
    assert sentence(state) in " ".join(draw(bpy.types.VELLUS_PT_dynamics_material).texts)


def test_without_gravity_nothing_bends(state):
    upright = sentence(state)
    state.dynamics.gravity = -1.0
    assert sentence(state) == upright
    state.dynamics.gravity = 0.0
    assert sentence(state) == ""
    state.dynamics.gravity = 1.0
    bpy.context.scene.use_gravity = False
    assert sentence(state) == ""


def test_what_cannot_be_read_is_reported(state):
    state.dynamics.damping = float("nan")
    assert sentence(state) == "Damping must be between 0 and 0.5, not nan."


def test_guides_too_long_for_hair_are_told_to_be_scaled(state):
    state.is_live = False
    title = bpy.types.VELLUS_PT_dynamics
    before = draw(title).texts
    state.guides.length = 4.0
    assert "Guides of 4 m move slowly: decrease Size" in " ".join(draw(title).texts)
    state.dynamics.size = 0.1
    assert draw(title).texts == before


def test_hand_made_guides_have_a_length_of_their_own(imported):
    """Hand-made guides have their own length, which no setting gives."""
    imported.select_set(True)
    bpy.context.view_layer.objects.active = imported
    bpy.ops.vellus.use_as_guides()
    guides = imported.data
    guides.vellus.guides.length = 4.0
    length = guide_tools.median_length(guides)
    assert sentence(guides.vellus).startswith(f"A {100 * length:.2g} cm guide")
    assert dynamics_notes.size_note(guides, bpy.context.scene) == ""


def test_combed_guides_bend_by_the_length_that_they_have(state):
    """The panel states how far combed guides bend by their actual length, before a slider is moved."""
    guides = bpy.data.objects["Guides"]
    bpy.context.view_layer.objects.active = guides
    before = draw(bpy.types.VELLUS_PT_guides)
    assert not any("Combed" in text for text in before.texts)
    curves = guides.data
    xyz = points(guides)
    write_points(guides, xyz[:, :1] + np.float32(0.3) * (xyz - xyz[:, :1]))
    bpy.context.view_layer.update()
    length = guide_tools.median_length(curves)
    assert length == pytest.approx(0.3 * state.guides.length, rel=0.1)
    assert sentence(state).startswith(f"A {100 * length:.2g} cm guide")
    drawn = draw(bpy.types.VELLUS_PT_guides)
    reported = " ".join(drawn.texts)
    assert "Guide Tools change guides" in reported and f"Median length: {100 * length:.3g}" in reported
    assert drawn.drawn["length"] == drawn.drawn["guide_count"] == 1  # gray, as they are for guides to come
    assert curves.vellus.status == ""
    bpy.ops.vellus.distribute_guides()
    bpy.context.view_layer.update()
    assert not any("Combed" in text for text in draw(bpy.types.VELLUS_PT_guides).texts)
