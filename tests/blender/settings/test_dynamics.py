# SPDX-License-Identifier: GPL-3.0-or-later
"""Dynamics are properties: values are stored exactly, mark the guides, follow keyframes, and regenerate nothing."""

import math
import os
import subprocess
import sys

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom import pipeline
from hair_addon.blender.groom.transfer import groom_settings
from hair_addon.blender.settings import properties, setting_properties
from hair_addon.core.dynamics.collision.collider_settings import ColliderSettings
from hair_addon.core.dynamics.rod import presets
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.errors import HairError
from hair_addon.core.params import declared
from tests.support.commands import PYTHONPATH
from tests.support.reading import points

UNKEYED = ("vertex_count", "preroll", "start_frame", "size")


@pytest.fixture
def state(hair):
    """Return the settings of guides that hair follows, as they were saved."""
    return bpy.data.objects["Guides"].data.vellus


def others_of(default, details):
    """Return values of a setting other than its default: the ends of its range."""
    if isinstance(default, bool | str):
        return [not default] if isinstance(default, bool) else ["Body", "Köpfe"]
    least = [math.nextafter(details.above, math.inf)] if math.isfinite(details.above) else []
    return [v for v in (details.low, details.high, details.soft_high, *least) if math.isfinite(v) and v != default]


@pytest.mark.parametrize("settings_class", [DynamicsSettings, ColliderSettings])
def test_the_ends_of_all_ranges_come_back(state, settings_class):
    """Ends of ranges are restored: rounded to single precision they are still within the range, including zero."""
    group = state.dynamics if settings_class is DynamicsSettings else bpy.data.objects["Sphere"].vellus
    assert setting_properties.to_settings(group, settings_class) == settings_class()
    for name, default, details in declared(settings_class):
        for value in others_of(default, details):
            wanted = settings_class(**{name: value})
            setting_properties.assign(group, wanted)
            found = setting_properties.to_settings(group, settings_class)
            assert found == setting_properties.as_stored(wanted), (name, value)


def test_any_setting_marks_the_guides_and_regrows_nothing(state, hair, monkeypatch):
    guides = bpy.data.objects["Guides"]
    before = points(guides), points(hair)
    made = []
    monkeypatch.setattr(pipeline, "evaluate", lambda *args: made.append(args))
    monkeypatch.setattr(pipeline, "interpolate_hair", lambda *args: made.append(args))
    changes = [(state, "simulates", True)]
    for name, default, details in declared(DynamicsSettings):
        changes.append((state.dynamics, name, others_of(default, details)[0]))
    for owner, name, value in changes:
        state.is_dynamics_stale = False
        setattr(owner, name, value)
        assert state.is_dynamics_stale, name
        bpy.context.view_layer.update()
        assert not (state.is_stale or state.is_shading_stale or hair.data.vellus.is_stale), name
    assert not made
    np.testing.assert_array_equal((points(guides)), before[0])
    np.testing.assert_array_equal((points(hair)), before[1])


def test_the_same_settings_mark_nothing(state):
    wanted = DynamicsSettings(bend_stiffness=0.1, hold=3.0, colliders="Body")
    groom_settings.assign_dynamics(state.id_data, wanted)
    assert state.is_dynamics_stale and properties.dynamics_of(state) == wanted
    state.is_dynamics_stale = False
    groom_settings.assign_dynamics(state.id_data, wanted)
    assert not state.is_dynamics_stale


def test_a_setting_that_is_not_a_number_is_refused_in_a_sentence(state):
    state.dynamics.hold = math.nan
    with pytest.raises(HairError, match="Hold must be between 0 and 10000, not nan"):
        properties.dynamics_of(state)


# Keys.


def test_keys_and_drivers_are_followed(state, hair):
    """Keys and drivers mark the guides exactly in frames where a value changes, although Blender does not call
    `update`.
    """
    guides = bpy.data.objects["Guides"]
    for frame, hold in ((1, 0.0), (11, 100.0)):
        state.dynamics.hold = hold
        guides.data.keyframe_insert("vellus.dynamics.hold", frame=frame)
    driver = guides.data.driver_add("vellus.dynamics.gravity").driver
    driver.expression = "1 if frame < 15 else 2"
    scene = bpy.context.scene
    scene.frame_set(1)
    before = points(guides), points(hair)
    for frame, is_changed, hold, gravity in (
        (6, True, 50.0, 1.0),
        (11, True, 100.0, 1.0),
        (12, False, 100.0, 1.0),
        (15, True, 100.0, 2.0),
        (20, False, 100.0, 2.0),
        (1, True, 0.0, 1.0),
    ):
        state.is_dynamics_stale = False
        scene.frame_set(frame)
        found = properties.dynamics_of(state)
        assert (found.hold, found.gravity) == (pytest.approx(hold, abs=1e-3), gravity)
        assert state.is_dynamics_stale == is_changed, frame
        assert not (state.is_stale or hair.data.vellus.is_stale)
    np.testing.assert_array_equal(points(guides), before[0])
    np.testing.assert_array_equal(points(hair), before[1])


def test_what_would_start_the_simulation_again_takes_no_keys(state):
    for name in UNKEYED:
        with pytest.raises(TypeError, match="not animatable"):
            state.id_data.keyframe_insert(f"vellus.dynamics.{name}")
    with pytest.raises(TypeError, match="not animatable"):
        state.id_data.keyframe_insert("vellus.simulates")
    for name, default, _details in declared(DynamicsSettings):
        if name not in UNKEYED and not isinstance(default, str):
            assert state.id_data.keyframe_insert(f"vellus.dynamics.{name}"), name


# Colliders.


def test_a_collider_marks_the_guides_that_collide_with_it(state):
    """A change of a collider marks the guides that collide with it: with their surface, a collection or its meshes."""
    sphere = bpy.data.objects["Sphere"]
    bpy.ops.mesh.primitive_cube_add()
    body, scene = bpy.context.object, bpy.context.scene
    outer, inner = (bpy.data.collections.new(name) for name in ("Outer", "Inner"))
    scene.collection.children.link(outer)
    outer.children.link(inner)

    def is_marked(collider):
        state.is_dynamics_stale = False
        collider.vellus.friction = 0.7 if collider.vellus.friction < 0.5 else 0.2
        return state.is_dynamics_stale

    assert is_marked(sphere) and not is_marked(body)
    state.dynamics.collides_with_surface = False
    assert not is_marked(sphere)
    inner.objects.link(body)
    assert not is_marked(body)
    state.dynamics.colliders = "Outer"
    assert is_marked(body) and not is_marked(sphere)
    state.dynamics.colliders = "Gone"
    assert not is_marked(body)


# Presets, files, registration.


@pytest.mark.parametrize("active", ["Sphere", "Guides", "Hair"])
def test_one_undo_takes_a_preset_back(state, active):
    bpy.context.view_layer.objects.active = bpy.data.objects[active]
    state.dynamics.colliders, state.dynamics.damping = "Body", 0.1
    bpy.ops.ed.undo_push(message="before")

    def settings():
        return properties.dynamics_of(bpy.data.objects["Guides"].data.vellus)

    before = settings()
    for identifier in presets.PRESETS:
        bpy.ops.vellus.apply_dynamics_preset("EXEC_DEFAULT", True, preset=identifier)
        after = settings()
        assert after == presets.applied(before, identifier) != before
        bpy.ops.ed.undo()
        assert settings() == before
        bpy.ops.ed.redo()
        assert settings() == after
        bpy.ops.ed.undo()


def test_presets_are_for_guides(sphere):
    assert not bpy.ops.vellus.apply_dynamics_preset.poll()


def test_settings_are_kept_in_a_file_and_in_copies(state, tmp_path):
    wanted = DynamicsSettings(hold=20.0, colliders="Body", vertex_count=33)
    groom_settings.assign_dynamics(state.id_data, wanted)
    state.simulates = True
    bpy.data.objects["Sphere"].vellus.is_double_sided = True
    copied = state.id_data.copy()
    assert properties.dynamics_of(copied.vellus) == wanted and copied.vellus.simulates
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    read = bpy.data.objects["Guides"].data.vellus
    assert properties.dynamics_of(read) == wanted and read.simulates
    assert bpy.data.objects["Sphere"].vellus.is_double_sided


@pytest.mark.farm
def test_properties_come_and_go_with_the_add_on():
    """Registering twice in a separate Blender leaves no property group on objects and Curves."""
    program = (
        "import bpy, hair_addon\n"
        "for _ in range(2):\n"
        "    hair_addon.register()\n"
        "    mesh_object = bpy.data.objects.new('Mesh', bpy.data.meshes.new('Mesh'))\n"
        "    curves = bpy.data.hair_curves.new('Guides')\n"
        "    mesh_object.vellus.overrides_friction = curves.vellus.simulates = True\n"
        "    assert curves.vellus.dynamics.bend_stiffness == 8.0\n"
        "    hair_addon.unregister()\n"
        "    assert not hasattr(mesh_object, 'vellus') and not hasattr(curves, 'vellus')\n"
    )
    environment = os.environ | {"PYTHONPATH": PYTHONPATH}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
