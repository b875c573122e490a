# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking continues, or ends with one message, if guides, the scene or settings change meanwhile."""

import math

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.dynamics import frame_folders, guide_baking
from hair_addon.blender.host import running
from hair_addon.core.errors import HairError
from hair_addon.core.long_work import run_now
from tests.support.dynamics.swung import simulate, swing
from tests.support.interface.modal import TIMER, Operator
from tests.support.pairs import share_of
from tests.support.reading import points

LAST, PRESENT = 8, 3


@pytest.fixture
def guides(hair, tmp_path):
    """Return guides that swing; the scene is in a frame of its own."""
    guides = bpy.data.objects["Guides"]
    swing(bpy.data.objects["Sphere"])
    simulate(guides, tmp_path / "frames")
    bpy.context.scene.frame_set(PRESENT)
    return guides


def bake(guides, disturb=lambda: None, at=4):
    """Bake, and call a function after each written frame."""
    told = []

    def tell(frame):
        told.append(frame.frame)
        if frame.frame == at:
            disturb()

    return run_now(guide_baking.baking([guides.data], LAST, bpy.context.scene, tell=tell)), told


def rename():
    bpy.data.objects["Guides"].name = bpy.data.hair_curves["Guides"].name = "Renamed"


def duplicate():
    bpy.context.scene.collection.objects.link(bpy.data.objects["Guides"].copy())
    bpy.data.hair_curves["Guides"].copy().use_fake_user = True


def undo():
    bpy.ops.ed.undo_push(message="One")
    bpy.ops.ed.undo_push(message="Other")
    assert bpy.ops.ed.undo() == {"FINISHED"}


def redo():
    undo()
    assert bpy.ops.ed.redo() == {"FINISHED"}


@pytest.mark.parametrize("disturb", share_of([rename, duplicate, undo, redo], 2))
def test_baking_goes_on_to_the_same_frames(guides, disturb):
    bake(guides)
    folder = frame_folders.folder_of(guides.data)
    whole = {path.name: path.read_bytes() for path in folder.glob("*.npz")}
    guides.data.vellus.dynamics.damping = 0.1
    bake(guides)
    guides.data.vellus.dynamics.damping = 0.005
    bpy.ops.ed.undo_push(message="Before")
    (_baked,), told = bake(guides, disturb)
    assert told == list(range(2, LAST + 2))
    assert {path.name: path.read_bytes() for path in folder.glob("*.npz")} == whole
    assert bpy.context.scene.frame_current == PRESENT


def leave_edit_mode():
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


@pytest.fixture
def ball(guides):
    """Return the object that guides collide with."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.5, location=(0.9, 0.0, 0.0))
    body = bpy.data.collections.new("Body")
    body.objects.link(bpy.context.object)
    guides.data.vellus.dynamics.colliders = "Body"
    return bpy.context.object


@pytest.mark.parametrize("name", ["Sphere", "Icosphere"])
def test_meshes_may_be_edited_while_guides_bake_and_play(guides, ball, name, request, capfd):
    """Meshes may be edited while guides bake and play, although their evaluated mesh has no attributes then."""
    request.addfinalizer(leave_edit_mode)
    bpy.context.view_layer.objects.active = guides.data.surface if name == "Sphere" else ball
    bpy.ops.object.mode_set(mode="EDIT")
    bake(guides)
    for frame in (2, 3):
        bpy.context.scene.frame_set(frame)
    assert guides.data.vellus.dynamics_status == "" and "Traceback" not in "".join(capfd.readouterr())


@pytest.mark.parametrize(
    "disturb",
    [
        lambda ball: setattr(ball, "hide_viewport", True),
        lambda ball: bpy.data.objects.remove(ball),
        lambda ball: ball.data.clear_geometry(),
        lambda ball: setattr(ball.location, "x", math.nan),
        lambda ball: bpy.data.collections.remove(bpy.data.collections["Body"]),
    ],
    ids=["hidden", "deleted", "without faces", "nowhere", "no collection"],
)
def test_baking_goes_on_whatever_becomes_of_a_collider(guides, ball, disturb):
    (_baked,), told = bake(guides, lambda: disturb(ball))
    assert told == list(range(2, LAST + 2))
    bpy.context.scene.frame_set(LAST)
    assert np.isfinite(points(guides)).all()


def test_baking_ends_with_the_addon(guides, window):
    """Disabling the add-on ends a bake while the settings still exist, and restores the scene's frame."""
    folder, operator = frame_folders.folder_of(guides.data), Operator(guide_baking.baking([guides.data], 500, scene()))
    assert operator.begin(window) == {"RUNNING_MODAL"}
    while len([*folder.glob("+*.npz")]) < 4:
        running.job().wait()
        operator.modal(window, TIMER)
    assert guide_baking.is_baking() and scene().frame_current != PRESENT
    running.end(window)
    assert scene().frame_current == PRESENT and not guide_baking.is_baking()
    assert window.status[-1] is None


def scene():
    return bpy.context.scene


def delete():
    bpy.data.hair_curves.remove(bpy.data.hair_curves["Guides"])


def lose_faces():
    bpy.data.objects["Sphere"].data.clear_geometry()


def set_to_no_number():
    bpy.data.hair_curves["Guides"].vellus.dynamics.hold = math.nan


@pytest.mark.parametrize(
    ("disturb", "sentence"), [(delete, "deleted"), (lose_faces, "Sphere|surface"), (set_to_no_number, "Hold must be")]
)
def test_baking_ends_with_a_sentence_and_keeps_its_frames(guides, disturb, sentence):
    folder = frame_folders.folder_of(guides.data)
    with pytest.raises(HairError, match=sentence):
        bake(guides, disturb)
    assert bpy.context.scene.frame_current == PRESENT and not guide_baking.is_baking()
    assert sorted(path.name for path in folder.glob("+*.npz")) == [f"+{frame:08d}.npz" for frame in range(1, 5)]


@pytest.mark.usefixtures("made_anew")
def test_a_keyed_setting_that_becomes_no_number_is_reported_and_hair_stays(guides, hair, monkeypatch):
    """A keyed setting that becomes non-finite is reported, and guides keep their baked or combed shape until it is
    finite.
    """
    combed = points(hair)
    bake(guides)
    bpy.context.scene.frame_set(LAST)
    shown = points(hair)
    guides.data.vellus.dynamics.hold = math.nan
    bpy.context.scene.frame_set(LAST - 1)
    bpy.context.scene.frame_set(LAST)
    np.testing.assert_array_equal(points(hair), shown)
    assert "Hold must be" in guides.data.vellus.dynamics_status
    bpy.context.scene.frame_set(40)
    np.testing.assert_array_equal(points(hair), combed)
    guides.data.vellus.dynamics.hold = 0.0
    bpy.context.scene.frame_set(LAST)
    np.testing.assert_array_equal(points(hair), shown)
    assert guides.data.vellus.dynamics_status == ""
