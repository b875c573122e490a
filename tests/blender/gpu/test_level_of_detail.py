# SPDX-License-Identifier: GPL-3.0-or-later
"""Level of detail: distant hair is drawn with a subset of strands, spread over all of them."""

from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.gpu import drawing, level_of_detail, strand_textures
from hair_addon.blender.gpu.programs import uniforms
from hair_addon.blender.render import drawn_scene, motion_vectors
from hair_addon.blender.render.viewport import hair_picture
from tests.support.pairs import share_of
from tests.support.pictures import glsl
from tests.support.reading import points, write_points

SIZE = 96
IDENTITY = np.eye(4)


def seen_from(distance, size=SIZE):
    """Return (world to view, view to clip) of a camera along -Y that sees the whole ball of hair from 3 m."""
    world_to_view = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, -distance], [0, 0, 0, 1.0]])
    return world_to_view, np.array([[2.0, 0, 0, 0], [0, 2.0, 0, 0], [0, 0, -1.002, -0.2002], [0, 0, -1, 0]])


def steps_from(strands, distance, part=1.0, coverage_turn=0.0, is_reduced=True):
    view = drawing.view_record(*seen_from(distance), SIZE, least_width=1.0)
    view["coverage_turn"] = coverage_turn
    return steps_of(strands, view, limits=level_of_detail.Limits(part, is_reduced))


def steps_of(strands, view, to_world=IDENTITY, limits=level_of_detail.NO_LIMITS):
    (steps,) = level_of_detail.steps_of([(strands, to_world[None], limits)], view)
    points, count = (one if one is None else int(np.ravel(one)[0]) for one in (steps.point_count, steps.strand_count))
    return drawing.Steps(points, count, steps.first_strand)


@pytest.fixture
def many(rng):
    """Return 50,000 strands of 41 points on a ball, on the GPU."""
    roots = rng.normal(size=(50_000, 1, 3))
    roots /= np.linalg.norm(roots, axis=2, keepdims=True)
    points = (roots * np.linspace(1.0, 1.4, 41)[:, None]).astype(np.float32)
    return strand_textures.upload_strands(points, np.full(points.shape[:2], 2e-4, np.float32))


def test_further_hair_has_fewer_strands_and_points_one_by_one(many):
    steps = [steps_from(many, distance) for distance in (1.5, *np.geomspace(3.5, 300.0, 400))]
    counts, points = (np.array([getattr(one, name) for one in steps]) for name in ("strand_count", "point_count"))
    assert (counts[0], points[0]) == (50_000, 41)
    assert (np.diff(counts) <= 0).all() and (np.diff(points) <= 0).all()
    assert counts[-1] == counts[-50] < 20_000 and points[-1] == 9
    assert (counts[2:] > 0.9 * counts[1:-1]).all()  # a step of the distance is 1.1 %


def test_the_level_of_detail_has_no_scale(many):
    """Hair in another unit, seen from the same number of its diameters, has as many strands and points."""
    view = drawing.view_record(*seen_from(8.0), SIZE)
    steps = steps_of(many, view)
    assert steps.strand_count < 50_000 and steps.point_count < 41
    for scale in (0.01, 100.0):
        view = drawing.view_record(*seen_from(8.0 * scale), SIZE)
        same = steps_of(many, view, np.diag([scale, -scale, scale, 1.0]))
        assert abs(same.strand_count - steps.strand_count) <= 1 and same.point_count == steps.point_count


@pytest.mark.parametrize("scale", [(0.2, 1.0, 1.0), (1.0, 4.0, -1.0), (0.3, 1.0, 0.3)])
def test_strands_of_unevenly_scaled_hair_are_thin_beside_its_shorter_side(many, scale):
    """Where fewer strands are drawn, their width is at most 1/1000 of the hair's diameter along any of its axes.

    With strands of 1/2500 of the longest diameter, the coverage of such heads was off by up to 0.7 / 255, now by 0.2.
    """
    view, to_world = drawing.view_record(*seen_from(8.0), SIZE), np.diag([*scale, 1.0])
    steps = steps_of(many, view, to_world)
    assert steps.strand_count < 50_000
    width = 2.0 * many.mean_radius * np.abs(np.prod(scale)) ** (1.0 / 3.0) * 50_000 / steps.strand_count
    sphere = drawing.bounding_sphere([(many, to_world)])[1]
    assert width <= 1.01 / 1000.0 * 2.0 * sphere * min(np.abs(scale)) / max(np.abs(scale))


def test_all_strands_and_points_are_drawn_if_the_artist_asks_for_them(many):
    whole, half = (steps_from(many, 300.0, part, is_reduced=False) for part in (1.0, 0.5))
    assert drawing.strand_record(many, uniforms.VIEW.record(), np.eye(4), whole)["drawn_points"] == 41
    assert (whole.strand_count, half.strand_count) == (50_000, 25_000)


def test_distant_strands_have_as_many_points_as_their_bends_need(rng):
    """At one distance, straight strands have fewer points than bent strands, and bent strands fewer than curls."""
    along = np.linspace(0.0, 1.0, 41)[:, None]
    roots, points = np.append(rng.uniform(-0.5, 0.5, (20_000, 1, 2)), np.zeros((20_000, 1, 1)), axis=2), []
    for turns, width in ((0.0, 0.0), (1.0, 0.05), (8.0, 0.05)):
        bends = width * np.sin(2.0 * np.pi * turns * along) * [1.0, 0.0, 0.0]
        strands = (roots + bends + along * [0.0, 0.0, 0.5]).astype(np.float32)
        uploaded = strand_textures.upload_strands(strands, np.full(strands.shape[:2], 1e-4, np.float32))
        points.append(steps_from(uploaded, 1.2).point_count)
        assert steps_from(uploaded, 0.1).point_count == 41
    assert points[0] == 9 < points[1] < points[2] <= 41


def test_near_hair_is_not_reduced(many):
    """Near hair is drawn with the same numbers, so the same bits, whether distant hair is reduced or not."""
    near, whole = (steps_from(many, 1.5, is_reduced=is_reduced) for is_reduced in (True, False))
    one, other = (drawing.strand_record(many, uniforms.VIEW.record(), np.eye(4), steps) for steps in (near, whole))
    assert one.tobytes() == other.tobytes()


def drawn_strands(strand_count, steps):
    """Return the strands that a shader draws in each pass."""
    record = drawing.strand_record(
        SimpleNamespace(strand_count=strand_count, point_count=2, row_strands=1, radius_strands=1, radius_unit=1.0),
        uniforms.VIEW.record(),
        np.eye(4),
        steps,
    )
    found = glsl.evaluate(
        glsl.source("strands/level_of_detail.glsl"),
        "float",
        "float(drawn_strand(turn))",
        structs=uniforms.VIEW.source,
        blocks={"view": (uniforms.VIEW.type_name, record)},
        turn=np.arange(steps.strand_count),
    )
    return found.astype(int)


@pytest.mark.parametrize("count", [1, 2, 7, 1000, 32_768, 32_769, 100_003, 1_000_000])
def test_any_turns_are_spread_over_all_strands(count):
    """A subset of strands is spread over all of them, although neighbors in memory are neighbors on the surface."""
    drawn = max(count - 1, 1)
    first = count // 3
    found = drawn_strands(count, drawing.Steps(strand_count=drawn, first_strand=first))
    assert len(set(found)) == drawn and 0 <= found.min() and found.max() < count
    few = found[: min(drawn, 10_000)]
    places = np.linspace(0, count, min(50, count) + 1)
    expected = len(few) / (len(places) - 1)
    assert abs(np.histogram(few, places)[0] - expected).max() <= 0.02 * expected + 2


def test_all_strands_are_drawn_in_their_order():
    np.testing.assert_array_equal(drawn_strands(1000, drawing.Steps(strand_count=1000)), np.arange(1000))


def test_passes_take_all_strands_in_turn_but_those_that_the_artist_leaves_out(many):
    taken = np.zeros(50_000, bool)
    for turn in 0.61803399 * np.arange(32):
        steps = steps_from(many, 30.0, coverage_turn=turn)
        taken[drawn_strands(50_000, steps)] = True
    assert taken.all() and steps.strand_count < 30_000
    few = [steps_from(many, 1.5, 0.25, coverage_turn=turn) for turn in (0.0, 0.3)]
    assert {(one.strand_count, one.first_strand) for one in few} == {(12_500, 0)}


@pytest.mark.parametrize("distance", share_of([8.0, 20.0], 2))
def test_hair_from_afar_is_as_bright_as_all_of_it(thin, monkeypatch, distance):
    """Distant hair, drawn with fewer and thicker strands, has the light and coverage of all strands.

    In ten placements of the guides, blue light was lower by 0.9 to 5.4 percent at the larger distance.
    """
    thin.data.vellus.hair.strand_count = 25_000
    thin.data.vellus.hair.radius = 0.0013
    bpy.context.view_layer.update()
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())

    def picture():
        found = hair_picture.HairPicture((SIZE, SIZE), 2)
        while not found.is_fine:
            found.add_pass(drawn, *seen_from(distance))
        return found.read().sum(axis=(0, 1))

    some = picture()
    steps, strands = steps_from(drawn.hair[0][0], distance), drawn.hair[0][0]
    assert steps.strand_count < strands.strand_count
    monkeypatch.setattr(level_of_detail, "steps_of", lambda hair, _view: [drawing.Steps()] * len(hair))
    np.testing.assert_allclose(some, picture(), rtol=0.06)


def bend_around():
    """Bend the guides around the head."""
    guides = bpy.data.objects["Guides"]
    bent = points(guides)
    turns = 2.0 * np.linspace(0.0, 1.0, bent.shape[1]) ** 2
    across, along = bent[..., 0].copy(), bent[..., 1].copy()
    bent[..., 0] = np.cos(turns) * across - np.sin(turns) * along
    bent[..., 1] = np.sin(turns) * across + np.cos(turns) * along
    write_points(guides, bent)


def test_strands_of_a_reduced_hair_have_the_motion_of_their_own_place(thin, monkeypatch):
    """Motion vectors [pixels] of hair that turns, drawn with half of its strands and nine points each, are right.

    They are those of the place in each sample, up to the distance of a strand from the line that is drawn for it.
    """
    bend_around()
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())
    monkeypatch.setattr(level_of_detail, "steps_of", lambda _hair, _view: [drawing.Steps(9, 2000)])
    camera, picture = seen_from(5.0), hair_picture.HairPicture((SIZE, SIZE), 1)
    picture.add_pass(drawn, *camera)
    now = motion_vectors.places(drawn, *camera)
    cosine, sine = np.cos(np.radians(3.0)), np.sin(np.radians(3.0))
    turn = np.array([[cosine, -sine, 0, 0], [sine, cosine, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    before = {owner: (one[0], one[1], turn @ one[2], one[3]) for owner, one in now.hair.items()}
    moments = motion_vectors.Motion(replace(now, hair=before), now, now, (SIZE, SIZE))
    buffer, detail = picture._pass, picture._detail
    texture = motion_vectors.draw(drawn, moments, picture._view, buffer, has_surfaces=False)
    width, height = buffer.size
    found = np.array(texture.read(), np.float32).reshape(height, width, 4)[..., :2]
    segments = np.array(buffer.segments.read(), np.int64).reshape(height, width)
    depths = np.array(buffer.depths.read(), np.int64).astype(np.uint32).view(np.float32).reshape(height, width)
    rows, columns = np.nonzero(segments < 4000 * 8)
    left, bottom = detail.corner
    at = np.stack([columns + left, rows + bottom], axis=1) + 0.5
    size = detail.per_side * SIZE
    to_clip = camera[1] @ camera[0]
    clip = np.column_stack([2.0 * at / size - 1.0, 2.0 * depths[rows, columns] - 1.0, np.ones(len(at))])
    world = clip @ np.linalg.inv(to_clip).T
    moved = world @ (to_clip @ turn).T
    expected = 0.5 * SIZE * (moved[:, :2] / moved[:, 3:] - clip[:, :2])
    errors = np.linalg.norm(found[rows, columns] - expected, axis=1)
    assert len(errors) > 1000 and np.linalg.norm(expected, axis=1).mean() > 0.5
    assert errors.mean() < 0.03 and errors.max() < 0.4


def test_hair_with_fewer_points_is_as_bright_as_with_all(thin, monkeypatch):
    """Strands that bend around a head have their light in place, also where fewer points draw them deeper in the hair.

    With the light of the drawn place, hair with nine points was darker by 5 of 255.
    """
    monkeypatch.setattr(hair_picture, "SAMPLE_COUNT", 8)
    thin.data.vellus.hair.strand_count = 15_000
    bend_around()
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())
    assert drawn.hair[0][0].point_count > 9
    colors = []
    for count in (9, None):
        steps = [drawing.Steps(count)]
        monkeypatch.setattr(level_of_detail, "steps_of", lambda _hair, _view, steps=steps: steps)
        picture = hair_picture.HairPicture((SIZE, SIZE), 2)
        while not picture.is_fine:
            picture.add_pass(drawn, *seen_from(5.0))
        red, green, blue, alpha = picture.read().sum(axis=(0, 1))
        colors.append(1.055 * (np.array([red, green, blue]) / alpha) ** (1.0 / 2.4) - 0.055)
    np.testing.assert_allclose(*colors, rtol=0.0, atol=2.0 / 255.0)


CROWD = (208, 64)  # size of a picture of several heads [pixels]
FOCUS = 96.0  # of its camera [pixels]


def crowd_beside(hair, distances):
    """Link head and hair at distances from a camera at the origin, side by side; returns the columns of each."""
    head, column, columns = hair.parent, 0.0, []
    for distance in distances:
        width = 3.4 * FOCUS / distance
        place = ((column + 0.5 * width - 0.5 * CROWD[0]) / FOCUS * distance, distance, 0.0)
        others = [one.copy() for one in (head, hair)]
        others[0].location, others[1].parent = place, others[0]
        for one in others:
            bpy.context.scene.collection.objects.link(one)
        columns.append(slice(int(column), int(column + width)))
        column += width
    assert column < CROWD[0]
    head.hide_viewport = head.hide_render = True
    bpy.data.objects.remove(hair)
    bpy.context.view_layer.update()
    return columns


def heads_in(columns):
    """Return (H, 4) means of a crowd's heads over the square around each: color in display units, and coverage."""
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())
    assert len(drawn.hair) == len(columns) and len({id(strands) for strands, *_ in drawn.hair}) == 1
    world_to_view, view_to_clip = seen_from(0.0)
    view_to_clip[[0, 1], [0, 1]] = 2.0 * FOCUS / np.array(CROWD)
    found = hair_picture.HairPicture(CROWD, 6)
    while not found.is_fine:
        found.add_pass(drawn, world_to_view, view_to_clip)
    means = []
    for part in columns:
        head, side = found.read()[:, part].sum(axis=(0, 1)), 3.0 / 3.4 * (part.stop - part.start)
        means.append([*(1.055 * (head[:3] / head[3]) ** (1.0 / 2.4) - 0.055), head[3] / side**2])
    return np.array(means)


def test_each_head_of_a_crowd_is_as_bright_and_covers_as_much_as_with_all_strands(thin, monkeypatch):
    """At four distances, mean color and coverage of linked heads are within 2 / 255 of those of all strands.

    The heads have locks. Pictures have seven times as many samples as viewports, as the law is about the mean.
    """
    monkeypatch.setattr(hair_picture, "SAMPLE_COUNT", 252)
    thin.data.vellus.hair.strand_count, thin.data.vellus.hair.radius = 10_000, 0.0004
    api.set_styles(thin.data, [api.Clump(size=0.15, amount=1.0)])
    bpy.context.view_layer.update()
    state = thin.data.vellus
    columns = crowd_beside(thin, np.geomspace(7.0, 35.0, 4))
    some = heads_in(columns)
    state.is_reduced_in_viewport = False
    whole = heads_in(columns)
    np.testing.assert_allclose(some, whole, rtol=0.0, atol=2.0 / 255.0)


def test_strands_without_width_or_length_are_drawn_around_the_viewer(blender):
    """A viewer inside of hair whose strands have no width, or no length, sees it without an error."""
    points = np.random.default_rng(0).random((3000, 9, 3)).astype(np.float32) - 0.5
    thin = strand_textures.upload_strands(points, np.zeros(points.shape[:2], np.float32))
    short = strand_textures.upload_strands(np.repeat(points[:, :1], 9, axis=1), np.full((3000, 9), 1e-4, np.float32))
    assert steps_from(thin, 0.0).point_count == 9 and steps_from(short, 0.0).strand_count == 3000


def test_hair_is_measured_again_only_if_it_or_its_place_changes(many, monkeypatch):
    """A view that turns does not measure unchanged hair; other points and other places have their own sizes."""
    calls, real = [], drawing.bounding_spheres
    monkeypatch.setattr(drawing, "bounding_spheres", lambda *given: calls.append(1) or real(*given))
    few = strand_textures.upload_strands(many.points[:20_000], many.radii[:20_000])
    view, moved = drawing.view_record(*seen_from(60.0), SIZE, least_width=1.0), np.diag([-0.5, 0.5, 0.1, 1.0])
    for distance in (40.0, 50.0, 60.0):
        steps_from(few, distance)
    assert len(calls) == 1
    turned = steps_of(few, view, moved)
    changed = strand_textures.with_points(few, few.points * np.float32(0.5))
    found = steps_of(changed, view), turned, steps_of(few, view)
    assert len(calls) == 4
    assert len({one.strand_count for one in found}) == 3
    new = strand_textures.upload_strands(changed.points, few.radii)
    alone = strand_textures.upload_strands(few.points, few.radii)
    assert found == (steps_of(new, view), steps_of(alone, view, moved), steps_of(few, view))
