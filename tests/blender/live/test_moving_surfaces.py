# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender does not carry hair that Vellus draws while its surface moves, and does before anybody else may read it."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import curves, follow_nodes
from hair_addon.blender.host import running, scene_time
from hair_addon.blender.live import handlers, live_hair, moving_surfaces
from tests.blender.live.test_carried_strands import bend
from tests.support.counting import Traffic, counts_of
from tests.support.gpu_strands import CLOSE, drawn
from tests.support.reading import evaluated_points, points


def objects():
    return bpy.data.objects["Guides"], bpy.data.objects["Hair"]


def are_paused():
    found = {follow_nodes.is_paused(curves_object) for curves_object in objects()}
    assert len(found) == 1
    return found.pop()


def is_at_rest(hair):
    """Whether Blender's evaluation has left the strands where they are without the surface's deformation."""
    bpy.context.view_layer.update()
    return np.array_equal(evaluated_points(hair), points(hair))


def key(surface, count=8):
    """Let a surface bend more and more with the frames."""
    bend(surface, 0.0)
    block = surface.data.shape_keys.key_blocks["Bent"]
    for frame, amount in ((1, 0.1), (count, 0.9)):
        block.value = amount
        block.keyframe_insert("value", frame=frame)


@pytest.fixture
def bent(watched):
    """Hair that is drawn on a surface that bends with the frames."""
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
    """The same while the animation plays."""
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


def test_playback_leaves_blenders_strands_at_rest_and_draws_them_carried(playing, monkeypatch):
    assert are_paused() and is_at_rest(playing)
    calls = counts_of(monkeypatch)
    with Traffic() as traffic:
        play(playing, 4, 5, 6)
    shown = drawn(playing)
    assert is_at_rest(playing) and np.abs(shown - points(playing)).max() > 0.01
    # A vertex is three texels of four numbers.
    vertex_count = len(playing.data.surface.data.vertices)
    assert calls["uploads"] == calls["moves"] == 0 and traffic.sent <= 3 * 48 * 1.1 * vertex_count
    moving_surfaces.resume()
    assert not is_at_rest(playing)
    np.testing.assert_allclose(shown, evaluated_points(playing), atol=CLOSE)


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
    assert are_paused()
    end(playing, tmp_path)
    assert not are_paused() and not is_at_rest(playing)
    drawn(playing)
    play(playing, 7, 8)
    assert are_paused()


@pytest.mark.parametrize("reason", [let_blender_draw, render_viewport])
def test_hair_that_blender_shows_is_carried_with_the_next_frame(playing, tmp_path, reason):
    assert are_paused()
    reason(playing, tmp_path)
    play(playing, 7)
    assert not follow_nodes.is_paused(playing) and not is_at_rest(playing)
    view_space().shading.type = "SOLID"


@pytest.mark.parametrize("reason", [read_by_nodes, add_modifier])
def test_hair_that_others_read_is_not_paused(bent, monkeypatch, tmp_path, reason):
    reason(bent, tmp_path)
    monkeypatch.setattr(scene_time, "is_shown_moving", lambda: True)
    play(bent, 2, 3)
    assert not follow_nodes.is_paused(bent)
    assert not is_at_rest(bent)


def test_guides_in_sculpt_mode_are_carried(playing):
    guides, _hair = objects()
    bpy.context.view_layer.objects.active = guides
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    play(playing, 7)
    assert not are_paused() and not is_at_rest(guides)
    bpy.ops.object.mode_set(mode="OBJECT")


def test_a_dragged_slider_pauses_hair_until_it_rests(bent):
    bent.data.surface.data.shape_keys.animation_data_clear()
    drag(bent, 0.2)
    assert not are_paused()
    drag(bent, 0.3, 0.4)
    assert are_paused() and is_at_rest(bent)
    assert bpy.app.timers.is_registered(moving_surfaces.settle)
    moving_surfaces.settle()
    assert bpy.app.timers.is_registered(moving_surfaces.resume_at_rest)
    shown = drawn(bent)
    assert moving_surfaces.resume_at_rest() is None
    assert not are_paused() and not is_at_rest(bent)
    np.testing.assert_allclose(shown, evaluated_points(bent), atol=CLOSE)
    np.testing.assert_allclose(drawn(bent), shown, atol=CLOSE)


def test_a_drag_reads_no_strands(bent, monkeypatch):
    """Blender reports Curves with their surface; 100,000 strands take a while to compare."""
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
    assert are_paused()
    read = []
    real = scene.read_vertex_group
    monkeypatch.setattr(scene, "read_vertex_group", lambda *given: read.append(1) or real(*given))
    top = [vertex.index for vertex in surface.data.vertices if vertex.co.z > 0.0]
    group.add(top, 0.0, "REPLACE")
    drag(bent, 0.5, 0.6)
    assert not read and are_paused()
    moving_surfaces.resume_at_rest()
    bpy.context.view_layer.update()
    live_hair.write_all()
    assert read and not are_paused()
    assert points(bent)[:, 0, 2].max() < 0.25  # of a ball of one, whose faces are as high


def test_strands_that_change_while_the_surface_is_dragged_are_drawn_so(bent):
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


def test_scripts_read_carried_hair(bent):
    """Nothing is drawn between their updates, and no animation plays."""
    for amount in (0.2, 0.5, 0.8):
        bend(bent.data.surface, amount)
        assert not are_paused() and not is_at_rest(bent)
    for frame in (2, 3, 4):
        bpy.context.scene.frame_set(frame)
        assert not are_paused() and not is_at_rest(bent)


def test_without_a_window_nothing_is_paused(bent, monkeypatch):
    monkeypatch.setattr(running, "has_window", lambda: False)
    monkeypatch.setattr(scene_time, "is_shown_moving", lambda: True)
    play(bent, 2, 3)
    assert not are_paused()


def test_renders_carry_hair_that_viewports_have_paused(playing, monkeypatch):
    seen = []

    class Reader(bpy.types.RenderEngine):
        bl_idname, bl_label = "READER", "Reader"

        def render(self, depsgraph):
            seen.append((depsgraph.mode, evaluated_points(playing, depsgraph)))

    monkeypatch.setattr(moving_surfaces, "resume", lambda: None)
    bpy.utils.register_class(Reader)
    bpy.context.scene.render.engine = "READER"
    bpy.context.scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.ops.render.render()
    bpy.utils.unregister_class(Reader)
    ((mode, rendered),) = seen
    assert are_paused() and mode == "RENDER"
    monkeypatch.undo()
    moving_surfaces.resume()
    bpy.context.view_layer.update()
    assert not is_at_rest(playing)
    np.testing.assert_array_equal(rendered, evaluated_points(playing))


def test_all_objects_of_hair_are_paused_and_carried_again(bent, monkeypatch):
    """Also one that is copied while it is paused."""
    other = bent.copy()
    bpy.context.scene.view_layers.new("Other")
    bpy.context.scene.collection.objects.link(other)
    monkeypatch.setattr(scene_time, "is_shown_moving", lambda: True)
    play(bent, 2, 3)
    assert follow_nodes.is_paused(bent) and follow_nodes.is_paused(other)
    last = bent.copy()
    moving_surfaces.resume()
    assert not any(map(follow_nodes.is_paused, (bent, other, last)))


def test_files_that_were_kept_paused_are_carried_when_opened(playing, tmp_path, monkeypatch):
    """As Blender saves by itself while an animation plays."""
    monkeypatch.setattr(moving_surfaces, "resume", lambda: None)
    path = str(tmp_path / "kept.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, compress=False)
    monkeypatch.undo()
    assert are_paused()
    bpy.ops.wm.open_mainfile(filepath=path)
    assert not are_paused() and not is_at_rest(bpy.data.objects["Hair"])


def test_an_undo_step_of_a_drag_brings_no_pause_back(playing):
    """Blender keeps one when a bone is let go, before the surface has come to rest."""
    assert are_paused()
    bpy.ops.ed.undo_push(message="Paused")
    moving_surfaces.resume()
    bpy.ops.ed.undo_push(message="Carried")
    bpy.ops.ed.undo()
    assert not are_paused() and not is_at_rest(bpy.data.objects["Hair"])


def test_linked_hair_is_paused_and_carried_again(bent, tmp_path, monkeypatch):
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
    assert are_paused() and is_at_rest(hair)
    moving_surfaces.resume()
    assert not are_paused() and not is_at_rest(hair)
    np.testing.assert_allclose(drawn(hair), evaluated_points(hair), atol=CLOSE)
