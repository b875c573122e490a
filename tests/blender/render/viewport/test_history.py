# SPDX-License-Identifier: GPL-3.0-or-later
"""Viewports show moving hair steadily and without ghosts."""

import bpy
import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from hair_addon.blender.data import scene
from hair_addon.blender.gpu import drawing, strand_textures
from hair_addon.blender.gpu.visibility_buffer import NO_SEGMENT, VisibilityBuffer
from hair_addon.blender.render import drawn_scene, hair_cache, motion_vectors, scene_drawing
from hair_addon.blender.render.viewport import hair_picture, view_film
from tests.support.pairs import share_of
from tests.support.reading import points, write_points
from tests.support.scenes import even_guides

SIZE = 80
FRAMES, WARM_UP = 4, 2


def read_drawn():
    bpy.context.view_layer.update()
    return drawn_scene.read(bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())


def camera():
    return scene.read_camera(bpy.context.scene, bpy.context.evaluated_depsgraph_get(), SIZE, SIZE)


def new_picture(kind, size=SIZE, side=1):
    if kind == "HAIR":
        return hair_picture.HairPicture((size, size), side)
    return view_film.ViewFilm((SIZE, SIZE), 1, is_transparent=True)


def move(picture, drawn, view):
    """Return what a viewport shows of the first pass after a movement."""
    picture.restart(is_moved=True)
    picture.add_pass(drawn, *view)
    return picture.read_shown()


def rest(picture, drawn, view):
    while not picture.is_fine:
        picture.add_pass(drawn, *view)
    return picture.read()


def still_picture(kind, drawn, view):
    """Return a picture at rest; of hair with nine samples per pixel and pass, which takes a ninth of the passes."""
    return rest(new_picture(kind, side=3), drawn, view)


def turn_object(degrees):
    bpy.data.objects["Sphere"].rotation_euler.z = np.radians(degrees)


def turn_camera(degrees):
    angle = np.radians(degrees)
    bpy.context.scene.camera.location = 6.0 * np.array([np.sin(angle), -np.cos(angle), 0.0])
    bpy.context.scene.camera.rotation_euler.z = angle


def turn_light(degrees):
    bpy.data.objects["Sun"].rotation_euler = (0.9, 0.0, np.radians(2.0 * degrees))


def comb(guides, way):
    """Move the guides by their parts of a way, from root to tip."""
    combed = points(guides)
    combed += np.linspace(0.0, 1.0, combed.shape[1])[None, :, None] * np.float32(way)
    write_points(guides, combed)
    bpy.context.view_layer.update()


def biggest_change(frames):
    """Return the 99th percentile of the change of pixels with hair from frame to frame, as displayed over gray."""
    frames = np.array(frames)
    shown = (frames[..., :3] + 0.05 * (1.0 - frames[..., 3:])) ** (1.0 / 2.2)
    is_hair = (frames[..., 3] > 0.02).any(axis=0)
    return np.quantile(np.abs(np.diff(shown, axis=0)).max(axis=-1)[:, is_hair], 0.99)


MOVEMENTS = [("HAIR", turn_object), ("HAIR", turn_camera), ("FILM", turn_camera), ("HAIR", turn_light)]


@pytest.mark.parametrize("movement", share_of(MOVEMENTS))
def test_what_moves_changes_no_more_than_pictures_at_rest(lit, movement):
    """At a degree per frame with one sample per pixel, pictures change at most 1.2 times as much and are as bright."""
    kind, turn = movement
    lit.data.vellus.hair.strand_count, lit.data.vellus.hair.radius = 3000, 0.006
    moving, shown, still = new_picture(kind), [], []
    turn_camera(0.0)
    drawn = read_drawn()
    for frame in range(FRAMES):
        turn(float(frame))
        bpy.context.view_layer.update()
        drawn, view = drawn if turn is turn_camera else read_drawn(), camera()
        shown.append(move(moving, drawn, view) if frame else rest(moving, drawn, view))
        if frame >= WARM_UP:
            still.append(rest(new_picture(kind), drawn, view))
    assert biggest_change(shown[WARM_UP:]) <= 1.2 * biggest_change(still)
    means = [np.mean(frames, axis=(0, 1, 2)) for frames in (shown[WARM_UP:], still)]
    np.testing.assert_allclose(*means, rtol=0.03)


@pytest.mark.parametrize("kind", share_of(["HAIR", "FILM"], 2))
def test_a_picture_that_comes_to_rest_is_the_mean_of_its_own_passes(lit, kind):
    picture, drawn = new_picture(kind), read_drawn()
    for degrees in (0.0, 2.0, 4.0):
        turn_camera(degrees)
        bpy.context.view_layer.update()
        move(picture, drawn, camera())
    assert not np.array_equal(picture.read_shown(), picture.read())
    last = rest(picture, drawn, camera())
    np.testing.assert_array_equal(picture.read_shown(), last)
    np.testing.assert_allclose(last.mean(axis=(0, 1)), still_picture(kind, drawn, camera()).mean(axis=(0, 1)), 0.02)


@even_guides
@pytest.mark.parametrize("kind", share_of(["HAIR", "FILM"], 2))
def test_nothing_remains_where_something_has_been(lit, kind):
    """Hair that moves by a tenth of the picture's width a frame leaves no trail, also where it moved away."""
    picture = new_picture(kind)
    rest(picture, read_drawn(), camera())
    was_there = picture.read()[..., 3] > 0.0
    for frame in range(4):
        bpy.data.objects["Sphere"].location.x = 0.45 * (frame + 1)
        drawn, view = read_drawn(), camera()
        shown = move(picture, drawn, view)
        is_there = still_picture(kind, drawn, view)[..., 3] > 0.0
        # A pixel is carried with what is beside it.
        left = was_there & ~binary_dilation(is_there, iterations=5)
        was_there |= is_there
        assert left.sum() > 30
        assert shown[left].mean() < 0.04
    assert shown[left].max() < 0.2


def test_light_that_goes_out_is_gone_in_a_few_frames(lit):
    picture = new_picture("HAIR")
    before = rest(picture, read_drawn(), camera())[..., :3].mean()
    bpy.data.objects["Sun"].data.energy = 0.0
    drawn = read_drawn()
    after = [move(picture, drawn, camera())[..., :3].mean() for _ in range(4)]
    assert after[-1] < 0.05 * before and after == sorted(after, reverse=True)


def test_light_that_changes_is_shown_at_once(lit):
    """The first pass shows more, less and restored light in each part of the picture."""
    lit.data.vellus.hair.strand_count, lit.data.vellus.hair.radius = 3000, 0.006
    picture, side = new_picture("HAIR"), SIZE // 8
    rest(picture, read_drawn(), camera())
    for energy in (4.0, 0.5, 3.0):
        bpy.data.objects["Sun"].data.energy = energy
        drawn = read_drawn()
        shown, still = move(picture, drawn, camera()), still_picture("HAIR", drawn, camera())
        np.testing.assert_allclose(shown.mean(axis=(0, 1)), still.mean(axis=(0, 1)), rtol=0.02)
        parts = [of.reshape(8, side, 8, side, 4).mean(axis=(1, 3)) for of in (shown, still)]
        np.testing.assert_allclose(*parts, rtol=0.1, atol=0.1 * parts[1].max())


def test_another_look_is_shown_at_once(lit):
    picture = new_picture("HAIR")
    rest(picture, read_drawn(), camera())
    lit.data.vellus.appearance.melanin = 0.9
    shown = move(picture, read_drawn(), camera())
    np.testing.assert_array_equal(shown, picture.read())


def seen(drawn, view):
    """Return (record of a pass over a scene, buffer that hair was found for)."""
    buffer, record = VisibilityBuffer(SIZE, SIZE), drawing.pass_record(*view, (SIZE, SIZE))
    with buffer.surfaces():
        scene_drawing.draw_hiding(drawn, record)
    scene_drawing.find_hair(drawn, record, buffer)
    return record, buffer


@pytest.mark.usefixtures("made_anew")
def test_combed_strands_know_where_they_were(lit, monkeypatch):
    """Motion vectors are the same whether some or all strands are uploaded."""
    monkeypatch.setattr(strand_textures, "MOST_GROUPS", 7)
    guides, view = bpy.data.objects["Guides"], camera()
    vectors = {}
    for is_uploaded in (False, True):
        comb(guides, (0.0, 0.0, 0.0))
        hair_cache.strand_cache.clear()
        before = motion_vectors.places(read_drawn(), *view)
        for way in ((0.1, 0.0, 0.0), (0.0, 0.0, 0.15)):
            comb(guides, way)
            if is_uploaded:
                hair_cache.strand_cache.clear()
            earlier, drawn = before, read_drawn()
            before = motion_vectors.places(drawn, *view)
            assert (drawn.hair[0][0].moved is None) == is_uploaded
            assert not before.has_still_hair(earlier)
            motion = motion_vectors.Motion(earlier, before, before, (SIZE, SIZE))
            found = np.array(motion_vectors.draw(drawn, motion, *seen(drawn, view)).read(), np.float32)
            vectors.setdefault(is_uploaded, []).append(found)
        comb(guides, (-0.1, 0.0, -0.15))
    for one, other in zip(vectors[False], vectors[True], strict=True):
        np.testing.assert_allclose(one, other, atol=1e-3)
    assert np.abs(vectors[False]).max() > 1.0


def test_surfaces_that_are_read_again_have_not_moved(lit):
    """Surfaces that are read again because a light moves count as unmoved if their corners are the same."""
    view = camera()
    before = motion_vectors.places(read_drawn(), *view)
    bpy.data.objects["Sun"].rotation_euler.x += 0.1
    assert before.surfaces and motion_vectors.places(read_drawn(), *view).has_still_surfaces(before)
    bpy.data.objects["Sphere"].location.x += 0.1
    assert not motion_vectors.places(read_drawn(), *view).has_still_surfaces(before)


def push_surface(frame):
    push = bpy.data.objects["Sphere"].modifiers.get("Push")
    if push is None:
        push = bpy.data.objects["Sphere"].modifiers.new("Push", "DISPLACE")
        push.direction, push.mid_level = "X", 0.0
    push.strength = 0.2 * frame


def comb_aside(frame):
    if frame:
        comb(bpy.data.objects["Guides"], (0.2, 0.0, 0.0))


def nearest_beside(depths, side):
    """Return (height, width) indices of the nearest sample in or beside each pixel, by brute force."""
    rows, columns = (np.arange(length // side)[:, None] for length in depths.shape)
    inside = [(y, x) for y in range(side) for x in range(side)] + [(0, side), (0, -1), (side, 0), (-1, 0)]
    around = [(2 * y * side, 2 * x * side) for y, x in ((-1, -1), (1, -1), (-1, 1), (1, 1))]
    around += [(0, -4 * side), (-4 * side, 0), (0, 4 * side), (4 * side, 0)]

    def nearest(places):
        down = np.stack([(side * rows + y).clip(0, len(depths) - 1) + 0 * columns.T for y, _x in places])
        along = np.stack([(side * columns.T + x).clip(0, depths.shape[1] - 1) + 0 * rows for _y, x in places])
        least = depths[down, along].argmin(axis=0)[None]
        return tuple(np.take_along_axis(found, least, axis=0)[0] for found in (down, along))

    chosen = nearest(inside)
    chosen = np.where(depths[chosen] == 1.0, nearest(inside + around), chosen)
    return chosen[0] * depths.shape[1] + chosen[1]


@pytest.mark.parametrize(("scale", "side"), [(1.0, 2), (0.01, 1)])
def test_pixels_move_with_their_nearest_sample(lit, monkeypatch, scale, side):
    """The motion vector of a pixel is that of the nearest sample in or beside it, in a part of the picture too, and
    seen surfaces have the motion vectors of renders.
    """
    bpy.data.objects["Sphere"].scale = (-scale, scale, scale)
    if scale < 1.0:
        bpy.context.scene.camera.location.y *= 4.0 * scale
    picture, found, draw = new_picture("HAIR", SIZE, side), [], motion_vectors.draw_nearest
    monkeypatch.setattr(motion_vectors, "draw_nearest", lambda *given: (draw(*given), found.append(given)))
    on_surfaces, draw_surfaces = [], motion_vectors.draw_surfaces
    monkeypatch.setattr(
        motion_vectors, "draw_surfaces", lambda *given: on_surfaces.append(draw_surfaces(*given)) or on_surfaces[-1]
    )
    for degrees in (0.0, 5.0):
        turn_object(degrees)
        drawn, view = read_drawn(), camera()
        move(picture, drawn, view)
    ((drawn, motion, buffer, texture, nearest),) = found
    wanted = [
        np.array(motion_vectors.draw(drawn, motion, picture._view, buffer, has_surfaces).read(), np.float32)
        for has_surfaces in (True, False)
    ]
    of_surfaces, vectors = (one.reshape(-1, 4) for one in wanted)
    width, height = buffer.size
    depths = np.array(buffer.depths.read(), np.int64).astype(np.uint32).view(np.float32).reshape(height, width)
    is_surface = (depths.ravel() < 1.0) & (np.array(buffer.segments.read(), np.int64).ravel() >= NO_SEGMENT)
    carried = np.array(on_surfaces[-1].read(), np.float32).reshape(-1, 2)
    assert len(on_surfaces) == 1 and is_surface.sum() > 20 and np.abs(carried[is_surface]).max() > 0.01
    np.testing.assert_array_equal(carried[is_surface], of_surfaces[is_surface, :2])
    left, bottom, columns, rows = picture._detail.tile
    inside = np.s_[bottom : bottom + rows, left : left + columns]
    places = np.array(nearest.texture.read(), np.int64).reshape(SIZE, SIZE)[inside]
    expected = nearest_beside(depths, picture._detail.per_side)
    is_hair = np.array(buffer.segments.read(), np.int64).ravel()[expected] < NO_SEGMENT
    assert not places[places != expected].any()  # far from hair nothing is carried
    np.testing.assert_array_equal(places[is_hair], expected[is_hair])
    shown = np.array(texture.read(), np.float32).reshape(SIZE, SIZE, 2)[inside]
    np.testing.assert_array_equal(shown[is_hair], vectors[places][is_hair, :2])
    assert is_hair.sum() > 50 and np.abs(shown[is_hair]).max() > 0.01
    assert (scale == 1.0) == (picture._detail.tile == (0, 0, SIZE, SIZE))


@pytest.mark.parametrize("push", [push_surface, comb_aside])
def test_hair_is_carried_where_it_moves(lit, push):
    """Moving points of strands carry hair along in the picture; without motion vectors the picture would lag."""
    lit.data.vellus.hair.strand_count, lit.data.vellus.hair.radius = 3000, 0.006
    picture = new_picture("HAIR")
    for frame in range(4):
        push(frame)
        drawn, view = read_drawn(), camera()
        shown = move(picture, drawn, view)
    still = still_picture("HAIR", drawn, view)
    columns = np.arange(SIZE)
    middles = [(of[..., 3].sum(axis=0) * columns).sum() / of[..., 3].sum() for of in (shown, still)]
    assert abs(middles[0] - middles[1]) < 0.5


@even_guides
def test_the_first_pass_is_as_bright_as_the_last(thin):
    """The first pass of thin strands with one sample per pixel has the mean brightness of the last, in each part, up
    to noise.
    """
    picture, drawn, view = new_picture("HAIR", 3 * SIZE), read_drawn(), camera()
    picture.add_pass(drawn, *view)
    first, last = picture.read(), rest(picture, drawn, view)
    np.testing.assert_allclose(first.mean(axis=(0, 1)), last.mean(axis=(0, 1)), rtol=0.03)
    assert first[..., 3].mean() == pytest.approx(last[..., 3].mean(), rel=0.02)
    side = SIZE // 4
    parts = [of[..., 3].reshape(12, side, 12, side).mean(axis=(1, 3)) for of in (first, last)]
    noise = np.sqrt(parts[1] * (1.0 - parts[1])) / side
    assert np.abs(parts[0] - parts[1]).max() <= 3.0 * noise.max()


@even_guides
def test_strands_that_are_left_out_leave_no_trace(thin):
    """After a change from 4,000 to 1,000 strands, the picture is as bright as at rest within a few frames."""
    picture = new_picture("HAIR")
    before = rest(picture, read_drawn(), camera())
    thin.data.vellus.hair.strand_count = 1000
    bpy.context.view_layer.update()
    drawn, view = read_drawn(), camera()
    still = still_picture("HAIR", drawn, view)
    left = [move(picture, drawn, view).mean() - still.mean() for _ in range(4)]
    assert abs(left[-1]) < 0.12 * abs(before.mean() - still.mean())
