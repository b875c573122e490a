# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked guides start from the groom, resuming gives the same bits, and hair follows in every frame."""

import shutil

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.simulation import guide_poses
from hair_addon.blender.data.strands import simulated_guides
from hair_addon.blender.groom.dynamics import frame_folders, guide_baking
from hair_addon.blender.groom.guides import guide_regions
from hair_addon.blender.live import dynamics_state
from hair_addon.core.errors import HairError
from hair_addon.core.files import frame_cache
from hair_addon.core.long_work import Stopped, run_now
from tests.blender.data.strands.test_partings import draw_line
from tests.support.dynamics.swung import simulate, swing
from tests.support.reading import evaluated_points, points
from tests.support.scenes import even_guides

LAST = 28


@pytest.fixture
def swung(hair, tmp_path):
    """Return (guides, hair) that simulate on a swinging sphere."""
    guides = bpy.data.objects["Guides"]
    swing(bpy.data.objects["Sphere"])
    simulate(guides, tmp_path / "frames")
    return guides, hair


def bake(guides, last=LAST, starts_over=False, progress=lambda _step, _part: None):
    (baked,) = run_now(guide_baking.baking([guides.data], last, bpy.context.scene, starts_over), progress)
    return baked


def files_of(guides):
    folder = frame_folders.folder_of(guides.data)
    return {path.name: path.read_bytes() for path in folder.glob("*.npz")}


def in_frame(curves_object, frame, part=0.0):
    bpy.context.scene.frame_set(frame, subframe=part)
    return points(curves_object)


@pytest.mark.gate(id="V22")
def test_the_first_frame_is_the_groom_bit_by_bit(swung):
    guides, hair = swung
    combed, before = points(guides), points(hair)
    bake(guides)
    assert np.array_equal(in_frame(hair, 1), before)
    assert np.array_equal(simulated_guides.point_cache.get(guides.data.session_uid), combed)
    assert not np.array_equal(in_frame(hair, 8), before)
    assert np.array_equal(points(guides), combed)


def test_baking_goes_on_to_the_same_bits(swung):
    guides, _hair = swung
    assert bake(guides).simulated == LAST
    whole = files_of(guides)
    folder = frame_folders.folder_of(guides.data)
    for name in whole:
        if not name.startswith("state_") and int(name[1:9]) > 26:
            (folder / name).unlink()
    assert bake(guides).simulated == LAST + 1 - 25  # from the state after frame 25
    assert files_of(guides) == whole
    assert bake(guides).simulated == 0
    assert bake(guides, starts_over=True).simulated == LAST
    assert files_of(guides) == whole


def test_stopped_baking_keeps_what_it_has(swung):
    guides, _hair = swung
    scene = bpy.context.scene
    scene.frame_set(5)

    def stop(step, _part):
        if step == "Frame 9":
            raise Stopped

    with pytest.raises(Stopped):
        bake(guides, progress=stop)
    assert scene.frame_current == 5 and not guide_baking.is_baking()
    cache = frame_cache.FrameCache(frame_folders.folder_of(guides.data))
    assert cache.manifest.state == "part" and cache.frame_numbers() == list(range(1, 9))
    bake(guides)
    assert cache.read_manifest().state == "complete"


def test_a_folder_that_goes_away_ends_baking(swung):
    guides, _hair = swung
    scene = bpy.context.scene
    scene.frame_set(5)

    def remove(step, _part):
        if step == "Frame 4":
            shutil.rmtree(frame_folders.folder_of(guides.data))

    with pytest.raises(HairError, match="lost its manifest"):
        bake(guides, progress=remove)
    assert scene.frame_current == 5 and not guide_baking.is_baking()
    assert not frame_folders.folder_of(guides.data).exists()
    bake(guides, 6)
    assert frame_cache.FrameCache(frame_folders.folder_of(guides.data)).manifest.state == "complete"


def test_a_surface_that_only_turns_keeps_its_size(swung):
    """Guides do not compute their rest shape again on a surface that only turns, as its size stays the same."""
    guides, _hair = swung
    scene, sphere = bpy.context.scene, bpy.data.objects["Sphere"]
    sphere.rotation_euler, sphere.scale = (0.3, 0.2, 0.1), (1.7, 1.7, 1.7)

    def pose_in(frame):
        scene.frame_set(frame)
        return guide_poses.read(guides.data, bpy.context.evaluated_depsgraph_get(), 1.0)

    start = pose_in(1)
    assert {pose_in(frame).root_pose(start).scale for frame in range(1, 17)} == {1.0}
    sphere.scale = (3.4, 3.4, 3.4)
    assert pose_in(1).root_pose(start).scale == pytest.approx(2.0, rel=1e-6)
    sphere.scale = (0.017, 0.017, 0.017)
    assert pose_in(1).root_pose(start).scale == pytest.approx(0.01, rel=2e-6)


def test_roots_stay_on_a_surface_that_bends(arm, tmp_path):
    """Roots of baked guides stay on a bending surface: points carried back to rest and forward again are unchanged."""
    bpy.context.view_layer.objects.active = arm
    bpy.ops.object.select_all(action="DESELECT")
    arm.select_set(True)
    bpy.ops.vellus.add_hair(guide_count=40, length=0.4, strand_count=200)
    guides, hair = bpy.data.objects["Hair Guides"], bpy.data.objects["Hair"]
    simulate(guides, tmp_path)
    bake(guides, 12)
    scene = bpy.context.scene
    scene.frame_set(11)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    pose = guide_poses.read(guides.data, depsgraph, 1.0)
    simulated = simulated_guides.point_cache.get(guides.data.session_uid)
    there = pose.to_world(simulated)
    np.testing.assert_allclose(there[:, 0], pose.root_positions, atol=1e-5)
    np.testing.assert_allclose(pose.to_rest(there), simulated, atol=1e-5)
    surface = arm.evaluated_get(depsgraph)
    for root in evaluated_points(hair)[::10, 0]:
        found, nearest, *_ = surface.closest_point_on_mesh([float(component) for component in root])
        assert found and np.linalg.norm(np.array(nearest) - root) < 1e-4


@pytest.mark.gate(id="V22")
@even_guides
def test_hair_follows_between_frames(swung):
    guides, hair = swung
    bake(guides)
    early, late = in_frame(hair, 9), in_frame(hair, 10)
    between = in_frame(hair, 9, 0.5)
    assert abs(between - (early + late) / 2.0).max() < 0.25 * abs(late - early).max()
    assert np.array_equal(in_frame(hair, 9), early)


def test_a_frame_that_is_missing_is_as_combed(swung):
    guides, hair = swung
    before = points(hair)
    bake(guides)
    (frame_folders.folder_of(guides.data) / "+00000007.npz").write_bytes(b"damaged")
    assert np.array_equal(in_frame(hair, 7), before)
    assert not np.array_equal(in_frame(hair, 8), before)


@pytest.mark.parametrize("change", ["settings", "guides"])
def test_what_has_changed_since_is_shown(swung, change):
    guides, _hair = swung
    bake(guides)
    bpy.context.scene.frame_set(4)
    assert dynamics_state.state_of(guides.data)[0] == "Frames {first} to {last} are baked"
    if change == "settings":
        guides.data.vellus.dynamics.damping = 0.1
        bpy.context.view_layer.update()
    else:
        guides.data.attributes["position"].data[5].vector.x += 0.1
        bpy.context.scene.frame_set(5)
    assert "with other settings or guides" in dynamics_state.state_of(guides.data)[0]


def test_a_moved_part_line_outdates_what_was_baked(swung):
    """Baked frames are valid while part lines divide guides as in the bake; with a missing part line baking is
    refused.
    """
    guides, hair = swung
    unparted = guide_baking.key_of(guides.data, bpy.context.scene)
    line = draw_line((0.0, -0.9, 1.2), (0.0, 0.9, 1.2))
    line.parent = bpy.data.objects["Sphere"]
    hair.data.vellus.hair.part_lines = "Line"
    bpy.context.view_layer.update()
    key = guide_baking.key_of(guides.data, bpy.context.scene)
    assert {part for part in key if key[part] != unparted.get(part)} == {"parting"}
    bake(guides, 6)
    for frame in (1, 4, 6):
        bpy.context.scene.frame_set(frame)
        assert dynamics_state.state_of(guides.data)[0] == "Frames {first} to {last} are baked"
    bpy.context.scene.frame_set(1)
    line.location.x = 0.5
    bpy.context.view_layer.update()
    bpy.context.scene.frame_set(3)
    assert "with other settings or guides" in dynamics_state.state_of(guides.data)[0]
    line.location.x = 0.0
    bpy.context.view_layer.update()
    bpy.context.scene.frame_set(4)
    assert dynamics_state.state_of(guides.data)[0] == "Frames {first} to {last} are baked"
    bpy.data.objects.remove(line)
    with pytest.raises(HairError, match="Line"):
        bake(guides, 6)
    assert guide_baking.key_of(guides.data, bpy.context.scene) != key


def test_a_part_line_that_the_deformed_surface_leaves_behind_outdates_nothing(swung):
    """A part line that the deformed surface leaves behind keeps baked frames valid, also after opening the file in
    another frame.
    """
    guides, hair = swung
    sphere = bpy.data.objects["Sphere"]
    sphere.shape_key_add(name="Basis")
    beside = sphere.shape_key_add(name="Beside")
    for point in beside.data:
        point.co.x += 0.6
    for frame, value in ((1, 0.0), (6, 1.0)):
        beside.value = value
        beside.keyframe_insert("value", frame=frame)
    sphere.animation_data_clear()
    scene = bpy.context.scene
    scene.frame_set(1)
    line = draw_line((0.0, -0.9, 1.2), (0.0, 0.9, 1.2))
    hair.data.vellus.hair.part_lines = "Line"
    bpy.context.view_layer.update()
    bake(guides, 6)
    key = guide_baking.key_of(guides.data, scene)

    def said_in(frame):
        dynamics_state.state_cache.clear()
        scene.frame_set(frame)
        return dynamics_state.state_of(guides.data)[0]

    for frame in (4, 6):
        assert said_in(frame) == "Frames {first} to {last} are baked"
    assert guide_baking.key_of(guides.data, scene) != key
    assert bake(guides, 6).simulated == 0
    line.location.x = -0.3
    bpy.context.view_layer.update()
    assert "with other settings or guides" in said_in(5)


@pytest.mark.gate(id="V20")
@even_guides
@pytest.mark.parametrize("is_parted", [True, False])
def test_guides_do_not_feel_those_beyond_a_part_line(swung, is_parted):
    """Combing guides beyond a part line has no effect on guides, except for rounding in sums of mean masses.

    Guides do not touch the surface here: buckling multiplies rounding by three in each frame.
    """
    guides, hair = swung
    settings = guides.data.vellus.dynamics
    settings.hair_friction, settings.hair_pressure, settings.collides_with_surface = 50.0, 0.0, False
    draw_line((0.0, -0.9, 1.2), (0.0, 0.9, 1.2))
    hair.data.vellus.hair.part_lines = "Line" if is_parted else ""
    bpy.context.view_layer.update()
    across = points(guides)[:, 0, 0]
    regions = guide_regions.regions_of(guides.data, bpy.context.evaluated_depsgraph_get())
    if is_parted:
        is_left = regions == regions[across.argmin()]
        np.testing.assert_array_equal(is_left[abs(across) > 0.05], across[abs(across) > 0.05] < 0.0)
    else:
        is_left = across < 0.0
        assert regions is None
    ends = []
    for _ in range(2):
        bake(guides, 8, starts_over=True)
        ends.append(frame_folders.frames_of(guides.data).read_frame(8).points)
        comb_tips(guides, ~is_left)
    moved = np.linalg.norm(ends[1] - ends[0], axis=2).max(axis=1)
    assert moved[~is_left].min() > 0.01
    assert (moved[is_left].max() < 2e-5) == is_parted


def comb_tips(guides, chosen):
    """Bend the tips of some guides."""
    there = points(guides)
    there[chosen] += np.float32([0.0, 0.0, -0.1]) * np.linspace(0.0, 1.0, there.shape[1], dtype=np.float32)[:, None]
    guides.data.attributes["position"].data.foreach_set("vector", there.ravel())
    guides.data.update_tag()
    bpy.context.view_layer.update()


def test_a_copy_bakes_to_a_folder_of_its_own(swung):
    guides, _hair = swung
    bake(guides, 3)
    copy = guides.copy()
    copy.data = guides.data.copy()
    bpy.context.scene.collection.objects.link(copy)
    assert copy.data.vellus.cache_identity == guides.data.vellus.cache_identity
    bake(copy, 3)
    assert copy.data.vellus.cache_identity != guides.data.vellus.cache_identity
    assert {name: data for name, data in files_of(copy).items() if "state" not in name}.keys() == {
        name for name in files_of(guides) if "state" not in name
    }


@pytest.mark.parametrize("is_stored", [True, False])
def test_files_in_one_folder_have_frames_of_their_own(swung, tmp_path, is_stored):
    """Files in one folder have separate frames for guides of one name.

    A file saved under another name keeps its frames, also on the command line.
    """
    guides, _hair = swung
    guides.data.vellus.cache_folder = "//frames"
    folders = []
    for name in ("one.blend", "other.blend"):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / name))
        folders.append(frame_folders.folder_of(guides.data))
    assert len(set(folders)) == 2
    bake(guides, 2)
    if not is_stored:
        guides.data.vellus.cache_identity = ""
    for name in ("renamed.blend", "again.blend"):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / name))
        assert frame_folders.folder_of(guides.data) == folders[1]
    assert frame_folders.frames_of(guides.data).frame_numbers() == [1, 2, 3]


def test_a_last_frame_before_the_first_is_refused(swung):
    guides, _hair = swung
    guides.data.vellus.dynamics.start_frame = 20
    with pytest.raises(HairError, match="begins in frame 20"):
        bake(guides, 10)


def test_guides_without_a_surface_are_refused(swung):
    guides, _hair = swung
    guides.data.surface = None
    with pytest.raises(HairError, match="no surface"):
        bake(guides)
    assert bpy.context.scene.frame_current == 1 and not guide_baking.is_baking()
