# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that the GPU deforms with an animated surface equal those deformed by Warp, without uploads of strands."""

import bpy
import gpu
import numpy as np
import pytest

from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import posed_strands, stored_roots
from hair_addon.blender.gpu import ambient_visibility, strand_textures, surface_textures
from hair_addon.blender.gpu.strands import device_choice, vertex_turner
from hair_addon.blender.groom import bindings, pipeline
from hair_addon.blender.live import events, live_hair
from hair_addon.blender.render import drawn_scene, hair_cache
from hair_addon.blender.settings import style_items
from hair_addon.core.errors import HairError
from hair_addon.core.geometry import vertex_turns
from hair_addon.core.imaging import ambient_cube
from hair_addon.core.styling import curl, lean
from tests.support.counting import counts_of
from tests.support.pictures.gpu_strands import CLOSE, comb, drawn, grown
from tests.support.reading import points, write_points


def bend(surface_object, amount):
    """Roll the upper half of a surface by a shape key."""
    if surface_object.data.shape_keys is None:
        surface_object.shape_key_add(name="Basis")
        key = surface_object.shape_key_add(name="Bent")
        places = np.array([point.co for point in key.data], np.float32)
        places[:, 0] += np.maximum(places[:, 2], 0.0) ** 2
        key.data.foreach_set("co", places.ravel())
    surface_object.data.shape_keys.key_blocks["Bent"].value = amount
    bpy.context.view_layer.update()


def carried(hair, target=None):
    """Return (S, P, 3): hair between the current guides, deformed by Warp; target: the hair with the styles."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    pose = posed_strands.read_pose(hair.data.surface, depsgraph)
    bound = pipeline.bind_hair(*pipeline.inputs_of(hair.data), depsgraph, target)
    return pose.carry(bound.points, bound.surface.topology, bound.surface.places(bound.binding.roots))


def test_a_surface_carries_combed_strands_where_they_are_drawn(watched, monkeypatch):
    surface, calls = watched.data.surface, counts_of(monkeypatch)
    for amount, count in ((0.0, 9), (0.3, 0), (0.6, 20), (0.6, 40), (0.0, 0)):
        bend(surface, amount)
        if count:
            comb(count)
        shown = drawn(watched)
        assert calls["uploads"] == calls["moves"] == 0
        np.testing.assert_allclose(shown, carried(watched), rtol=0.0, atol=CLOSE)
    live_hair.write_all()
    np.testing.assert_allclose(points(watched), grown(watched), rtol=0.0, atol=1e-6)


def test_hair_that_was_opened_on_a_bent_surface_is_carried_from_its_second_pose(hair, window, monkeypatch):
    surface = hair.data.surface
    bend(surface, 0.2)
    bindings.invalidate(hair.data)
    drawn(hair)
    calls = counts_of(monkeypatch)
    for amount in (0.5, 0.7, 0.0, 0.4):
        bend(surface, amount)
        shown = drawn(hair)
        assert calls["uploads"] == 0
        np.testing.assert_allclose(shown, carried(hair), rtol=0.0, atol=CLOSE)
    monkeypatch.setattr(device_choice, "times", lambda: (1.0, 0.0))
    drawn(hair)
    bend(surface, 0.6)
    np.testing.assert_allclose(drawn(hair), carried(hair), rtol=0.0, atol=CLOSE)


def test_styles_are_applied_before_strands_are_carried(watched, monkeypatch):
    """Styles are applied before strands are deformed, and strokes and sliders on a bent surface upload neither
    strands nor vertices.
    """
    style_items.add(watched.data.vellus, curl.Settings(radius=0.02, pitch=0.1))
    bend(watched.data.surface, 0.3)
    drawn(watched)
    live_hair.write_all()
    bend(watched.data.surface, 0.5)
    drawn(watched)
    calls, sent, texture_of = counts_of(monkeypatch), [], surface_textures._texture_of
    monkeypatch.setattr(surface_textures, "_texture_of", lambda *given: sent.append(1) or texture_of(*given))
    for count, radius in ((60, 0.02), (0, 0.03)):
        comb(count)
        watched.data.vellus.styles[0].curl.radius = radius
        bpy.context.view_layer.update()
        shown = drawn(watched)
        assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 0}
        np.testing.assert_allclose(shown, carried(watched, watched.data), rtol=0.0, atol=CLOSE)
    assert not sent
    bend(watched.data.surface, 0.4)
    np.testing.assert_allclose(drawn(watched), carried(watched, watched.data), rtol=0.0, atol=CLOSE)
    assert sent == [1]


def test_styled_hair_is_carried_too(watched, monkeypatch):
    style_items.add(watched.data.vellus, lean.Settings(amount=0.3))
    bpy.context.view_layer.update()
    drawn(watched)
    calls = counts_of(monkeypatch)
    for amount in (0.5, 0.7):
        bend(watched.data.surface, amount)
        shown = drawn(watched)
        assert calls["uploads"] == 0
        np.testing.assert_allclose(shown, carried(watched, watched.data), rtol=0.0, atol=CLOSE)
    comb(60)  # by uploads
    np.testing.assert_allclose(drawn(watched), carried(watched, watched.data), rtol=0.0, atol=CLOSE)
    bend(watched.data.surface, 0.4)
    np.testing.assert_allclose(drawn(watched), carried(watched, watched.data), rtol=0.0, atol=CLOSE)


def test_another_topology_while_the_surface_bends_is_carried_anew(watched, monkeypatch):
    """A changed topology of a bending surface uploads the strands once, and the GPU deforms them from the next pose
    on.
    """
    surface = watched.data.surface
    bend(surface, 0.5)
    drawn(watched)
    modifier = surface.modifiers.new("Cut", "TRIANGULATE")
    calls = counts_of(monkeypatch)
    for is_cut in (True, False):
        modifier.show_viewport = is_cut
        for amount in (0.6, 0.7, 0.8):
            bend(surface, amount)
            np.testing.assert_allclose(drawn(watched), carried_as_stored(watched), rtol=0.0, atol=CLOSE)
    assert calls["uploads"] <= 2


def carried_as_stored(hair):
    """Return (S, P, 3): the points of Curves, deformed by Warp from the stored roots."""
    pose = posed_strands.read_pose(hair.data.surface, bpy.context.evaluated_depsgraph_get())
    return pose.carry(points(hair), hair.data.vellus.topology, stored_roots.places(hair.data, np.inf))


def test_non_finite_vertices_are_refused_until_they_are_mended(watched, monkeypatch):
    surface = watched.data.surface
    bend(surface, 0.5)
    drawn(watched)
    point = surface.data.shape_keys.key_blocks["Bent"].data[0]
    was, point.co.x = point.co.x, np.nan
    bend(surface, 0.6)
    with pytest.raises(HairError, match="non-finite"):
        drawn(watched)
    point.co.x = was
    calls = counts_of(monkeypatch)
    bend(surface, 0.7)
    np.testing.assert_allclose(drawn(watched), carried_as_stored(watched), rtol=0.0, atol=CLOSE)
    assert calls["uploads"] == 0


def two_systems(surface):
    """Add a second hair system to a surface; returns the hair objects."""
    with bpy.context.temp_override(object=surface, active_object=surface, selected_objects=[surface]):
        bpy.context.view_layer.objects.active = surface
        bpy.ops.vellus.add_hair("EXEC_DEFAULT", guide_count=20, length=0.2, strand_count=70)
    live_hair.write_all()
    systems = [o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR"]
    assert len(systems) == 2
    return systems


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (-0.01, 0.02, 0.01)])
def test_a_pose_is_uploaded_once_for_all_hair_and_the_drawn_surface(watched, monkeypatch, scale):
    """Played frames upload the vertices of a surface once, for all of its hair, its own drawing and motion vectors."""
    surface, read_once = watched.data.surface, scene.meshes_read_once
    surface.scale = scale
    systems = two_systems(surface)
    frame = None
    for amount in (0.2, 0.3):
        bend(surface, amount)
        for hair in systems:
            drawn(hair)
        frame = read(former=frame)
    drawn_surface = frame.surfaces[0][0]
    size, sent, buffer = drawn_surface.places.width * drawn_surface.places.height, [], gpu.types.Buffer
    monkeypatch.setattr(gpu.types, "Buffer", lambda kind, size, *given: sent.append(size) or buffer(kind, size, *given))
    monkeypatch.setattr(vertex_turner, "_gathered", None)
    for amount in (0.4, 0.5):
        bend(surface, amount)
        sent.clear()
        with read_once():
            before, frame = frame, read(former=frame)
        assert sent.count(size) == 1
        places, before_places = (one.places[1][one.surface_owners[0], 0] for one in (frame, before))
        assert places[0] is surface_textures.posed_cache.get(surface.session_uid)[1] is not before_places[0]
        for hair in systems:
            wanted = carried_as_stored(hair)
            close = CLOSE * max(1.0, np.abs(wanted).max())  # long in local coordinates of a small scale
            np.testing.assert_allclose(drawn(hair), wanted, rtol=0.0, atol=close)


def test_systems_on_one_surface_read_its_pose_once(watched, monkeypatch):
    surface = watched.data.surface
    systems = two_systems(surface)
    for amount in (0.3, 0.5):
        bend(surface, amount)
        for hair in systems:
            drawn(hair)
    poses, found, read_surface, turning = [], [], scene.read_surface, vertex_turns.turning
    monkeypatch.setattr(scene, "read_surface", lambda *given: poses.append(1) or read_surface(*given))
    monkeypatch.setattr(vertex_turns, "turning", lambda *given: found.append(1) or turning(*given))
    for amount in (0.6, 0.7):
        bend(surface, amount)
        poses.clear()
        shown = [drawn(hair) for hair in systems]
        assert len(poses) == 1 and not found
        for hair, places in zip(systems, shown, strict=True):
            np.testing.assert_allclose(places, carried_as_stored(hair), rtol=0.0, atol=CLOSE)
        found.clear()


def read(**details):
    context = bpy.context
    return drawn_scene.read(context.scene, context.view_layer, context.evaluated_depsgraph_get(), **details)


def parts_seen(texture):
    """Return the content of a visibility texture: bytes of strands, the roots of parts."""
    found = np.array(texture.read(), float)
    return (found / 255.0) ** 2 if texture.format == "RGBA8" else found


def test_light_follows_what_moves_without_being_measured_anew(watched, monkeypatch):
    """Each frame adds one direction to the light, and after all directions it equals that measured at rest, except
    for rounding.
    """
    measured, real = [], ambient_visibility.measure
    monkeypatch.setattr(ambient_visibility, "measure", lambda *given: measured.append(1) or real(*given))
    bpy.ops.object.light_add(type="SUN")
    frame = read()
    assert measured
    bend(watched.data.surface, 0.5)
    frame = read(former=frame)  # made now, and of corners as before
    measured.clear()
    maps, first = frame.shadow_maps, parts_seen(frame.hair_visibility[0]["visibility_z"])
    for _ in range(len(ambient_cube.DIRECTIONS)):
        frame = read(former=frame)
    assert frame.shadow_maps is maps
    assert not measured
    at_rest = read(before=frame)
    assert measured
    followed, wanted = ((*of.hair_visibility, *of.surface_visibility) for of in (frame, at_rest))
    for found, texture in zip(followed, wanted, strict=True):
        for name in found:
            # The direction of surfaces has the length one, however little is seen of them.
            close = 0.05 if name == "visibility_surface" else 0.02
            np.testing.assert_allclose(parts_seen(found[name]), parts_seen(texture[name]), rtol=0.0, atol=close)
    assert np.abs(parts_seen(at_rest.hair_visibility[0]["visibility_z"]) - first).max() > 0.02


def test_a_surface_that_turns_as_an_object_passes_a_matrix(hair, window, monkeypatch):
    """A surface that turns as an object uploads no vertices and strands; each frame adds one direction to the light."""
    bpy.ops.object.light_add(type="SUN")
    surface = hair.data.surface
    frame, called = read(), []
    strands = frame.hair[0][0]
    for owner, name in (
        (ambient_visibility, "measure"),
        (vertex_turns, "turning"),
        (vertex_turner.VertexTurner, "turn"),
        (scene, "read_surface"),
        (strand_textures, "upload_strands"),
    ):
        monkeypatch.setattr(owner, name, lambda *given, name=name: called.append(name))
    for angle in (0.2, 0.4, 0.6):
        surface.rotation_euler.z = angle
        bpy.context.view_layer.update()
        frame = read(former=frame)
        assert frame.hair[0][0] is strands
        np.testing.assert_allclose(frame.hair[0][2], np.array(hair.matrix_world), atol=1e-6)
        assert abs(np.array(hair.matrix_world)[0, 0] - np.cos(angle)) < 1e-6
    assert not called


def test_hair_that_warp_computes_is_lit_as_at_rest_while_it_plays(hair, monkeypatch):
    measured, real = [], ambient_visibility.measure
    monkeypatch.setattr(ambient_visibility, "measure", lambda *given: measured.append(1) or real(*given))
    read(former=read())
    assert len(measured) == 2


def test_guides_are_drawn_at_the_roots_that_are_stored_with_their_hair(hair):
    """Guides are drawn at the roots stored with their hair in the update that stores them, before Blender reports
    them.
    """
    guides = bpy.data.objects["Guides"]
    bend(hair.data.surface, 0.5)
    hair.data.vellus.is_live = False
    slid = points(guides)
    slid[:10] = slid[10:20]
    write_points(guides, slid)
    hair_cache.strands_on_gpu(guides.data)
    hair.data.vellus.is_live, hair.data.vellus.hair.seed = True, 9
    bpy.context.view_layer.update()
    drawn_at_once = hair_cache.strands_on_gpu(guides.data).points
    events.strands_computed(guides.data)
    assert np.array_equal(drawn_at_once, hair_cache.strands_on_gpu(guides.data).points)
