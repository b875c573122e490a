# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's evaluation of hair is paused while its surface moves, and resumes before other code may read it."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import curves, follow_nodes
from hair_addon.blender.gpu import drawing, shadows
from hair_addon.blender.host import running, scene_time
from hair_addon.blender.live import handlers, live_hair, moving_surfaces
from hair_addon.blender.render import hair_cache
from tests.blender.live.test_carried_strands import bend
from tests.support.counting import Traffic, counts_of
from tests.support.pictures import render_probe
from tests.support.pictures.gpu_strands import CLOSE, drawn
from tests.support.reading import evaluated_points, points, write_points


def objects():
    return bpy.data.objects["Guides"], bpy.data.objects["Hair"]


def are_hidden():
    found = {follow_nodes.is_hidden(curves_object) for curves_object in objects()}
    assert len(found) == 1
    return found.pop()


def is_left_out(hair):
    """Whether Blender's evaluation contains only the bounding box of the strands."""
    bpy.context.view_layer.update()
    evaluated = hair.evaluated_get(bpy.context.evaluated_depsgraph_get())
    if len(evaluated.data.curves) == len(hair.data.curves):
        return False
    low, high = (f(points(hair).reshape(-1, 3), axis=0) for f in (np.min, np.max))
    np.testing.assert_allclose([evaluated.bound_box[0], evaluated.bound_box[6]], [low, high], atol=1e-6)
    return True


def key(surface, count=8):
    """Animate a surface that bends more in each frame."""
    bend(surface, 0.0)
    block = surface.data.shape_keys.key_blocks["Bent"]
    for frame, amount in ((1, 0.1), (count, 0.9)):
        block.value = amount
        block.keyframe_insert("value", frame=frame)


@pytest.fixture
def bent(watched):
    """Return hair drawn on a surface that bends with the frames."""
    key(watched.data.surface)
    bpy.context.scene.frame_set(1)
    drawn(watched)
    moving_surfaces.resume()
    moving_surfaces.moved_cache.clear()
    bpy.context.view_layer.update()
    yield watched
    moving_surfaces.resume()


@pytest.fixture
def playing(bent, monkeypatch):
    """Act as in a window while the animation plays."""
    monkeypatch.setattr(scene_time, "is_shown_moving", lambda: True)
    play(bent, 2, 3)
    return bent


def play(hair, *frames):
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        bpy.context.view_layer.update()
        drawn(hair)


def drag(hair, *amounts):
    for amount in amounts:
        bend(hair.data.surface, amount)
        drawn(hair)


def test_playback_leaves_out_blenders_strands_and_draws_them_carried(playing, monkeypatch):
    assert are_hidden() and is_left_out(playing)
    calls = counts_of(monkeypatch)
    with Traffic() as traffic:
        play(playing, 4, 5, 6)
    shown = drawn(playing)
    assert is_left_out(playing) and np.abs(shown - points(playing)).max() > 0.01
    # A vertex is three texels of four numbers.
    vertex_count = len(playing.data.surface.data.vertices)
    assert calls["uploads"] == calls["moves"] == 0 and traffic.sent <= 3 * 48 * 1.1 * vertex_count
    moving_surfaces.resume()
    assert not is_left_out(playing)
    np.testing.assert_allclose(shown, evaluated_points(playing), atol=CLOSE)


def test_carried_strands_need_as_few_points_as_before(bent, monkeypatch):
    """Strands that only follow their surface bend as before, so shadow maps draw few of their points."""
    monkeypatch.setattr(scene_time, "is_shown_moving", lambda: True)
    play(bent, 2, 3)
    strands = hair_cache.strand_cache.get(bent.data.session_uid).on_gpu
    view = drawing.view_record(np.eye(4), np.eye(4), 64)

    def drawn_points(shown):
        return int(shadows._records(shown, view, np.eye(4)[None], drawing.Steps(), is_steady=True)["drawn_points"][0])

    assert not strands.has_points and drawn_points(strands) < strands.point_count
    assert drawn_points(replace(strands, has_bends=False)) == strands.point_count


def save(_hair, folder):
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "playing.blend"), copy=True, compress=False)


def undo(_hair, _folder):
    handlers.after_undo()


def stop_playing(_hair, _folder):
    handlers.after_playing()


def begin_to_render(_hair, _folder):
    handlers.before_reading()


def let_blender_draw(hair, _folder):
    hair.data.vellus.is_drawn = False


def render_viewport(_hair, _folder):
    view_space().shading.type = "RENDERED"


def read_by_nodes(hair, _folder):
    reader = bpy.data.objects.new("Reader", bpy.data.meshes.new("Reader"))
    bpy.context.scene.collection.objects.link(reader)
    group = bpy.data.node_groups.new("Reads", "GeometryNodeTree")
    group.nodes.new("GeometryNodeObjectInfo").inputs["Object"].default_value = hair


def add_modifier(hair, _folder):
    for curves_object in objects():
        curves_object.modifiers.new("Artist", "NODES")


def view_space():
    areas = bpy.context.window_manager.windows[0].screen.areas
    return next(area.spaces.active for area in areas if area.type == "VIEW_3D")


@pytest.mark.parametrize("end", [save, undo, stop_playing, begin_to_render])
def test_hair_is_carried_again_before_anybody_reads_it(playing, tmp_path, end):
    assert are_hidden()
    end(playing, tmp_path)
    assert not are_hidden() and not is_left_out(playing)
    drawn(playing)
    play(playing, 7, 8)
    assert are_hidden()


@pytest.mark.parametrize("reason", [let_blender_draw, render_viewport])
def test_hair_that_blender_shows_is_carried_with_the_next_frame(playing, tmp_path, reason):
    assert are_hidden()
    reason(playing, tmp_path)
    play(playing, 7)
    assert not follow_nodes.is_hidden(playing) and not is_left_out(playing)
    view_space().shading.type = "SOLID"


@pytest.mark.parametrize("reason", [read_by_nodes, add_modifier])
def test_hair_that_others_read_is_not_hidden(bent, monkeypatch, tmp_path, reason):
    reason(bent, tmp_path)
    monkeypatch.setattr(scene_time, "is_shown_moving", lambda: True)
    play(bent, 2, 3)
    assert not follow_nodes.is_hidden(bent)
    assert not is_left_out(bent)


def test_guides_in_sculpt_mode_are_carried(playing):
    guides, _hair = objects()
    bpy.context.view_layer.objects.active = guides
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    play(playing, 7)
    assert not are_hidden() and not is_left_out(guides)
    bpy.ops.object.mode_set(mode="OBJECT")


def test_a_dragged_slider_hides_hair_until_it_rests(bent):
    bent.data.surface.data.shape_keys.animation_data_clear()
    drag(bent, 0.2)
    assert not are_hidden()
    drag(bent, 0.3, 0.4)
    assert are_hidden() and is_left_out(bent)
    assert bpy.app.timers.is_registered(moving_surfaces.settle)
    moving_surfaces.settle()
    assert bpy.app.timers.is_registered(moving_surfaces.resume_at_rest)
    shown = drawn(bent)
    assert moving_surfaces.resume_at_rest() is None
    assert not are_hidden() and not is_left_out(bent)
    np.testing.assert_allclose(shown, evaluated_points(bent), atol=CLOSE)
    np.testing.assert_allclose(drawn(bent), shown, atol=CLOSE)


def test_a_drag_reads_no_strands(bent, monkeypatch):
    """A drag reads no strands, which would take a while for 100,000 strands that Blender reports with their surface."""
    bent.data.surface.data.shape_keys.animation_data_clear()
    drag(bent, 0.2, 0.3, 0.4)
    read = []
    for name in ("read_points", "read_radii"):
        monkeypatch.setattr(curves, name, lambda datablock: read.append(datablock))
    drag(bent, 0.5, 0.6)
    assert not read


def test_weights_that_change_while_the_surface_is_dragged_count_at_rest(bent, monkeypatch):
    surface = bent.data.surface
    surface.data.shape_keys.animation_data_clear()
    group = surface.vertex_groups.new(name="Part")
    group.add(range(len(surface.data.vertices)), 1.0, "REPLACE")
    bent.data.vellus.hair.density_group = "Part"
    bpy.context.view_layer.update()
    live_hair.write_all()
    drawn(bent)
    drag(bent, 0.2, 0.3, 0.4)
    assert are_hidden()
    read = []
    real = scene.read_vertex_group
    monkeypatch.setattr(scene, "read_vertex_group", lambda *given: read.append(1) or real(*given))
    top = [vertex.index for vertex in surface.data.vertices if vertex.co.z > 0.0]
    group.add(top, 0.0, "REPLACE")
    drag(bent, 0.5, 0.6)
    assert not read and are_hidden()
    moving_surfaces.resume_at_rest()
    bpy.context.view_layer.update()
    live_hair.write_all()
    assert read and not are_hidden()
    assert points(bent)[:, 0, 2].max() < 0.25  # on a ball of radius one


def test_strands_that_change_while_the_surface_is_dragged_are_drawn(bent):
    bent.data.surface.data.shape_keys.animation_data_clear()
    drag(bent, 0.2, 0.3, 0.4)
    moved = points(bent)
    moved[:, -1] += np.float32([0.0, 0.0, 0.1])
    bent.data.attributes["position"].data.foreach_set("vector", moved.ravel())
    bent.data.update_tag()
    drag(bent, 0.5)
    moving_surfaces.resume()
    bpy.context.view_layer.update()
    np.testing.assert_allclose(drawn(bent), evaluated_points(bent), atol=CLOSE)


def test_hand_edited_strands_are_drawn_on_an_edited_mesh_that_is_dragged(watched):
    """Hand-edited strands follow an edited mesh that is dragged in the same update, although Blender hides and
    reports them later.
    """
    edited = points(watched)
    edited[:, -1] += np.float32(0.1)
    write_points(watched, edited)
    mesh = watched.data.surface.data
    for _step in range(4):
        drawn(watched)
        mesh.vertices[0].co *= 1.1
        mesh.update()
        bpy.context.view_layer.update()
        at_once = hair_cache.strands_on_gpu(watched.data).points
        assert np.array_equal(at_once, points(watched))
    assert are_hidden() and not np.array_equal(at_once, edited)
    moving_surfaces.resume()


def test_scripts_read_carried_hair(bent):
    """Scripts read current strands although nothing is drawn between updates and no animation plays."""
    for amount in (0.2, 0.5, 0.8):
        bend(bent.data.surface, amount)
        assert not are_hidden() and not is_left_out(bent)
    for frame in (2, 3, 4):
        bpy.context.scene.frame_set(frame)
        assert not are_hidden() and not is_left_out(bent)


def test_without_a_window_nothing_is_hidden(bent, monkeypatch):
    monkeypatch.setattr(running, "has_window", lambda: False)
    monkeypatch.setattr(scene_time, "is_shown_moving", lambda: True)
    play(bent, 2, 3)
    assert not are_hidden()


def test_renders_carry_hair_that_viewports_hide(playing, monkeypatch):
    monkeypatch.setattr(handlers, "_show_hidden", lambda: None)
    with render_probe.reading(lambda depsgraph: (depsgraph.mode, evaluated_points(playing, depsgraph))) as render:
        ((mode, rendered),) = render()
    assert are_hidden() and mode == "RENDER"
    monkeypatch.undo()
    moving_surfaces.resume()
    bpy.context.view_layer.update()
    assert not is_left_out(playing)
    np.testing.assert_array_equal(rendered, evaluated_points(playing))


def test_all_objects_of_hair_are_hidden_and_carried_again(bent, monkeypatch):
    """All objects of hair are hidden and deformed again, also an object copied while it is hidden."""
    other = bent.copy()
    bpy.context.scene.view_layers.new("Other")
    bpy.context.scene.collection.objects.link(other)
    monkeypatch.setattr(scene_time, "is_shown_moving", lambda: True)
    play(bent, 2, 3)
    assert follow_nodes.is_hidden(bent) and follow_nodes.is_hidden(other)
    last = bent.copy()
    moving_surfaces.resume()
    assert not any(map(follow_nodes.is_hidden, (bent, other, last)))


def test_files_that_were_kept_hidden_are_shown_when_opened(playing, tmp_path, monkeypatch):
    """Files saved with hidden hair, as by auto-save while an animation plays, show it when they are opened."""
    monkeypatch.setattr(handlers, "_show_hidden", lambda: None)
    path = str(tmp_path / "kept.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, compress=False)
    monkeypatch.undo()
    assert are_hidden()
    bpy.ops.wm.open_mainfile(filepath=path)
    assert not are_hidden() and not is_left_out(bpy.data.objects["Hair"])


def test_an_undo_step_of_a_drag_hides_nothing_again(playing):
    """An undo step that Blender pushes when a bone is released hides no hair when it is undone."""
    assert are_hidden()
    bpy.ops.ed.undo_push(message="Hidden")
    moving_surfaces.resume()
    bpy.ops.ed.undo_push(message="Carried")
    bpy.ops.ed.undo()
    assert not are_hidden() and not is_left_out(bpy.data.objects["Hair"])


def test_linked_hair_is_hidden_and_shown_again(bent, tmp_path, monkeypatch):
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, compress=False)
    bpy.ops.wm.read_factory_settings(use_empty=False)
    with bpy.data.libraries.load(path, link=True) as (_found, linked):
        linked.objects = ["Sphere", "Guides", "Hair"]
    for linked_object in bpy.data.objects:
        if linked_object.library is not None:
            bpy.context.scene.collection.objects.link(linked_object)
    hair = bpy.data.objects["Hair"]
    monkeypatch.setattr(running, "has_window", lambda: True)
    monkeypatch.setattr(scene_time, "is_shown_moving", lambda: True)
    play(hair, 1, 2, 3, 4)
    assert are_hidden() and is_left_out(hair)
    moving_surfaces.resume()
    assert not are_hidden() and not is_left_out(hair)
    np.testing.assert_allclose(drawn(hair), evaluated_points(hair), atol=CLOSE)
