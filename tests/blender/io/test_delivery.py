# SPDX-License-Identifier: GPL-3.0-or-later
"""Delivered hair equals live hair in Blender without the add-on; removing the delivery restores everything."""

import resource
import shutil

import bpy
import pytest

from hair_addon.blender.data.strands import follow_nodes
from hair_addon.blender.groom.dynamics import dynamics_notes, frame_folders, guide_baking
from hair_addon.blender.host import paths, running
from hair_addon.blender.io import delivery
from hair_addon.core.errors import HairError
from hair_addon.core.files import frame_cache
from hair_addon.core.long_work import Stopped, run_now
from tests.support.dynamics.following import grow
from tests.support.dynamics.swung import simulate
from tests.support.exchange.delivered import without_addon
from tests.support.interface.modal import Operator, drive
from tests.support.pictures.rendering import light_up
from tests.support.reading import evaluated_points, everything, read_picture

LAST = 5


@pytest.fixture(scope="module")
def shots(tmp_path_factory):
    """Return a folder in which the first test creates a shot."""
    return tmp_path_factory.mktemp("shots")


@pytest.fixture
def shot(request, shots, tmp_path):
    """Return a saved file of hair on an arm that bends, moves and blurs, with baked guides; its guides."""
    if not [*shots.iterdir()]:
        save_baked(request.getfixturevalue("arm"), shots)
    shutil.copytree(shots, tmp_path, dirs_exist_ok=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    return bpy.data.hair_curves["Guides"]


def save_baked(arm, folder):
    for frame, x in ((1, 1.0), (11, 3.0)):
        arm.location.x = x
        arm.keyframe_insert("location", frame=frame)
    guides, hair = grow(arm, guide_count=20, strand_count=100)
    hair.data.vellus.hair.radius = 0.03
    quick = {"automatic_substeps": False, "substeps": 2, "collides_with_surface": False}
    simulate(guides, "//frames", **quick)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.5
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "shot.blend"))
    run_now(guide_baking.baking([guides.data], LAST, scene))


def deliver(guides):
    return run_now(delivery.delivering(guides, delivery.path_of(guides), bpy.context.scene))


def live(times):
    scene, found = bpy.context.scene, {}
    for time in times:
        scene.frame_set(int(time // 1), subframe=time % 1)
        found[time] = evaluated_points(bpy.data.objects["Hair"]).reshape(-1, 3)
    return found


def largest_difference(some, others):
    return max(abs(some[time] - others[time]).max() for time in some)


@pytest.mark.farm
@pytest.mark.gate(id="V23")
def test_a_blender_without_the_addon_has_the_same_hair_and_picture(shot, tmp_path):
    """A Blender without the add-on has the same hair and picture, and its own exporter writes the same hair."""
    set_up_camera()
    times = (0.75, 1.0, 1.25, 4.75, LAST + 0.25, LAST, 4.0)
    before, blurred = live(times), rendered(tmp_path / "live.png", 4)
    bpy.context.scene.render.use_motion_blur = False
    sharp = rendered(tmp_path / "sharp.png", 4)
    bpy.context.scene.render.use_motion_blur = True
    made = deliver(shot)
    assert made.path == tmp_path / "shot_Guides.usdc" and made.byte_count == made.path.stat().st_size
    assert largest_difference(live(times), before) < 1e-6
    assert largest_difference(dict.fromkeys(times, before[4.0]), before) > 0.01
    bpy.ops.wm.save_mainfile()
    found, picture, exported = without_addon(tmp_path / "shot.blend", tmp_path, times)
    assert largest_difference(found, before) < 1e-6
    assert exported.keys() == {1.0, 4.0, LAST} and largest_difference(exported, before) < 1e-6
    assert abs(blurred - read_picture(picture)).max() <= 1.0 / 255.0 + 1e-6
    assert abs(blurred - sharp).max() > 0.05


def set_up_camera():
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (2.0, -7.0, 0.5), (1.5, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine, scene.cycles.samples, scene.cycles.seed = "CYCLES", 4, 1
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 48, 100
    light_up((1.0, 1.0, 1.0))


def rendered(path, frame):
    scene = bpy.context.scene
    scene.frame_set(frame)
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return read_picture(path)


def test_hair_in_slow_motion_is_delivered_as_it_moves(shot):
    """Delivered hair in an animation that is stretched in time moves in the animation's time."""
    scene = bpy.context.scene
    scene.render.frame_map_old, scene.render.frame_map_new = 100, 250
    run_now(guide_baking.baking([shot], LAST, scene))
    times = (2.0, 3.75, float(LAST))
    before = live(times)
    deliver(shot)
    assert largest_difference(live(times), before) < 1e-5  # time is rounded
    assert largest_difference(dict.fromkeys(times, before[2.0]), before) > 0.01


# Taken off.


def test_taken_off_and_undone_hair_follows_its_guides_again(shot):
    before = live((4.0, 4.3))
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    bpy.context.view_layer.objects.active.modifiers.new("Artist's", "NODES")
    names = everything()
    bpy.ops.ed.undo_push(message="baked")
    for leave in (bpy.ops.vellus.remove_delivery, bpy.ops.ed.undo):
        assert not bpy.ops.vellus.remove_delivery.poll()
        assert bpy.ops.vellus.deliver_dynamics() == {"FINISHED"}
        bpy.ops.ed.undo_push(message="delivered")
        hair = bpy.data.objects["Hair"]
        assert [m.name for m in hair.modifiers] == ["Delivered Hair", "Follow Surface", "Artist's"]
        assert not follow_nodes.modifier_of(hair).show_render
        assert {name for name, kept in everything().items() if kept != names[name]} == {"cache_files"}
        leave()
        bpy.ops.ed.undo_push(message="left")
        hair = bpy.data.objects["Hair"]
        assert [m.name for m in hair.modifiers] == ["Follow Surface", "Artist's"]
        assert follow_nodes.modifier_of(hair).show_render
        assert largest_difference(live((4.0, 4.3)), before) == 0.0


def test_hair_that_is_delivered_again_plays_the_new_frames(shot):
    deliver(shot)
    shot.vellus.dynamics.damping = 0.2
    hair = bpy.data.objects["Hair"].data
    run_now(guide_baking.baking([shot], LAST, bpy.context.scene))
    frame_folders.frames_of(shot)
    assert dynamics_notes.is_delivery_outdated(hair)
    deliver(shot)
    assert not dynamics_notes.is_delivery_outdated(hair)
    assert len(bpy.data.cache_files) == 1
    played = live((4.0, 4.75))
    delivery.take_off(shot)
    assert largest_difference(live((4.0, 4.75)), played) < 1e-6


# A delivery that is refused or ends early changes nothing.


def state():
    hair = bpy.data.objects["Hair"]
    shown = [(m.name, m.show_viewport, m.show_render) for m in hair.modifiers]
    return everything(), shown, bpy.context.scene.frame_current_final


def refuse(guides, sentence):
    before = state()
    with pytest.raises(HairError, match=sentence):
        deliver(guides)
    assert state() == before


def test_a_file_that_hair_of_other_guides_plays_is_not_replaced(shot):
    """A file that hair of other guides plays is not replaced; file names are compared without case, as by some
    systems.
    """
    made, other, third = deliver(shot), bpy.data.hair_curves.new("guides"), bpy.data.hair_curves.new("Grün (2)")
    names = [delivery.path_of(guides).name for guides in (shot, other, third)]
    assert names == ["shot_Guides.usdc", "shot_guides.001.usdc", "shot_Grün (2).usdc"] and names[0] == made.path.name
    delivery.take_off(shot)
    assert delivery.path_of(other).name == "shot_guides.usdc"


def test_what_cannot_be_delivered_is_refused(shot, tmp_path):
    path = delivery.path_of(shot)
    (tmp_path / "frames").chmod(0o700)
    path.write_bytes(b"#usda 1.0\n")
    refuse(shot, "not made by Deliver Hair")
    path.write_bytes(b"PXR-USDC" + bytes(50))
    refuse(shot, "not made by Deliver Hair")
    path.unlink()
    bpy.context.scene.frame_end = LAST + 1
    refuse(shot, f"Frame {LAST + 2} of the guides .* is not baked")
    bpy.context.scene.frame_end = LAST
    damaged = next((tmp_path / "frames").rglob("+00000004.npz"))
    whole = damaged.read_bytes()
    damaged.write_bytes(b"damaged")
    refuse(shot, "Frame .* cannot be read")
    damaged.write_bytes(whole)
    shot.vellus.simulates = False
    refuse(shot, "are not simulated")
    shot.vellus.simulates = True
    assert not [*tmp_path.glob(".vellus*"), *tmp_path.glob("*.usdc")]


def test_guides_that_begin_after_the_last_frame_need_none(shot):
    """Guides that start after the last frame are delivered without baked frames, in their combed shape."""
    frame_cache.remove(frame_folders.folder_of(shot))
    frame_folders.have_changed(shot)
    shot.vellus.dynamics.start_frame = LAST + 10
    made = deliver(shot)
    assert made.path.exists() and (made.first, made.last) == (1, LAST)


def test_a_blender_without_usd_is_reported_at_once(shot, monkeypatch):
    monkeypatch.setattr(paths, "has_operator", lambda name: name != "wm.usd_export")
    before = state()
    with pytest.raises(HairError, match="lacks USD"):
        next(delivery.delivering(shot, delivery.path_of(shot), bpy.context.scene))
    assert state() == before


def test_without_a_saved_file_there_is_no_place_for_it(hair):
    with pytest.raises(HairError, match="save the file first"):
        delivery.path_of(bpy.data.objects["Guides"].data)


def test_stopped_delivery_leaves_all_as_it_was(shot, tmp_path):
    bpy.context.scene.frame_set(2, subframe=0.5)
    before = state()

    def stop(step, _part):
        if step == "Frame 2.25":
            raise Stopped

    with pytest.raises(Stopped):
        run_now(delivery.delivering(shot, delivery.path_of(shot), bpy.context.scene), stop)
    assert state() == before
    assert not [*tmp_path.glob(".vellus*"), *tmp_path.glob("*.usdc")]


def test_a_full_disk_is_reported(shot, tmp_path):
    """A full disk, simulated by a limit on the size of files, is reported."""
    deliver(shot)
    path = delivery.path_of(shot)
    size, before = path.stat().st_size, state()
    _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    for part in (0.0, 0.3, 0.9):
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(part * size), hard))
        try:
            with pytest.raises(HairError, match="cannot be written"):
                deliver(shot)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
        assert state() == before and path.stat().st_size == size
        assert not [*tmp_path.glob(".vellus*")]


def test_all_hair_of_the_guides_is_delivered_whatever_its_name_and_the_frame_rate(shot):
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    bpy.ops.vellus.interpolate_hair(strand_count=30)
    other = next(o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.hair.strand_count == 30)
    other.name = other.data.name = "9 Härchen/é"
    other.hide_viewport = True
    scene = bpy.context.scene
    scene.render.fps_base, scene.unit_settings.scale_length = 1.001, 0.01
    before = live((4.0, 4.75))
    made = deliver(shot)
    assert (
        made.strand_count == 130 and other.modifiers[0].object_path != bpy.data.objects["Hair"].modifiers[0].object_path
    )
    other.hide_viewport = False
    assert largest_difference(live((4.0, 4.75)), before) < 1e-5  # time in seconds is rounded
    delivered = evaluated_points(other)
    delivery.take_off(shot)
    assert abs(evaluated_points(other) - delivered).max() < 1e-5
    scene.frame_set(1)
    assert abs(evaluated_points(other) - delivered).max() > 0.01


def test_in_a_window_hair_is_followed_although_an_operator_runs(window, shot, monkeypatch):
    """In a window, hair follows for viewports even while an operator runs."""
    before = live((4.0, 4.75))
    monkeypatch.setattr(running, "has_window", lambda: True)
    operator = Operator(delivery.delivering(shot, delivery.path_of(shot), bpy.context.scene))
    assert drive(operator, window) == {"FINISHED"}
    monkeypatch.undo()
    assert largest_difference(live((4.0, 4.75)), before) < 1e-6
