# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows of hair and of surfaces: soft by the light's size, and without flicker while a light rotates."""

from dataclasses import replace
from functools import partial

import gpu
import numpy as np
import pytest

from hair_addon.blender.gpu import (
    ambient_visibility,
    drawing,
    shadows,
    strand_batches,
    strand_textures,
    surface_textures,
)
from hair_addon.blender.gpu.programs import uniforms
from hair_addon.blender.gpu.strand_box import StrandBox
from hair_addon.core.errors import HairError


def tuft(rng, strand_count=3000):
    """Return strands all over a ball of radius 10 cm, bent by gravity: (S, P, 3) points, (S, P) radii."""
    roots = rng.normal(size=(strand_count, 3))
    roots *= 0.1 / np.linalg.norm(roots, axis=1)[:, None]
    along = np.linspace(0.0, 1.0, 21)[None, :, None]
    points = roots[:, None] * (1.0 + 0.6 * along) - np.array([0.0, 0.0, 0.08]) * along**2
    return points.astype(np.float32), np.full(points.shape[:2], 4e-5, np.float32)


def sun(azimuth, height, radius=0.0):
    """Return a `uniforms.LIGHTS` record of a sun at these angles [rad]; radius: the tangent of its angular radius."""
    lights = uniforms.LIGHTS.record()
    lights["count"] = 1
    light = lights["light"][0]
    light["kind"], light["casts_shadow"], light["radius"] = shadows.SUN, True, radius
    towards = np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)
    light["axis"][:3] = -np.array(towards)
    light["power"][0] = 1.0
    return lights


def lit(lights, hair, surfaces, places, size=512):
    """Return (N,) the part of a sun's light that arrives at places (N, 3), read like the world's visibility."""
    maps = shadows.ShadowMaps(size, 1)
    maps.draw(lights, [(hair, np.eye(4))], surfaces)
    return seen_light(lights, maps, places)


def seen_light(lights, maps, places):
    """Return (N,) the part of a sun's light in drawn maps that arrives at places (N, 3)."""
    receiver = surface_textures.upload_surface(places.astype(np.float32), np.zeros(3, np.int32))
    view = ambient_visibility._view_of_surface(receiver)
    view["seen_opacity"] = 1.0
    target = ambient_visibility._Target((view, {"places": receiver.places, "strand_radii": receiver.places}))
    target.add(lights, maps.samplers)
    texels = np.concatenate([np.array(t.read()).reshape(-1, 4) for t in target.textures.values()], axis=1)
    return texels[:, :6].sum(axis=1)[: len(places)]  # of the six sides


def test_shadows_in_hair_do_not_flicker_while_the_sun_turns(scene, rng):
    """Between steps of the sun of half a degree light changes smoothly, without noise by the maps' texels."""
    points, radii = tuft(rng)
    hair = strand_textures.upload_strands(points, radii)
    places = points[:, 1::4].reshape(-1, 3)
    steps = np.radians(0.5) * np.arange(7)
    frames = np.array([lit(sun(0.3 + step, 0.8), hair, [], places) for step in steps])
    lit_places = frames.mean(axis=0) > 0.05
    noise = np.diff(frames[:, lit_places], n=2, axis=0) / np.sqrt(6.0)  # of independent noise of one
    assert noise.std() < 0.05
    assert np.abs(np.diff(frames.mean(axis=1))).max() < 0.005


@pytest.mark.parametrize(
    ("steps", "counted"),
    [(drawing.Steps(), None), (drawing.Steps(point_count=6, strand_count=1000), 500)],
    ids=["all", "some"],
)
@pytest.mark.parametrize("radius", [4e-5, 8e-4])
def test_triangles_and_compute_programs_draw_the_same_map(scene, rng, radius, steps, counted):
    """Maps drawn by triangles and by compute programs have the same mean count in each layer; few texels differ, by a
    strand.

    Texels rarely differ, by a strand.
    """
    points, radii = tuft(rng)
    hair = [(strand_textures.upload_strands(points, np.full_like(radii, radius)), np.eye(4))]
    found = []
    for in_compute in (False, True):
        maps = shadows.ShadowMaps(128, 1, in_compute)
        maps.draw(sun(0.4, 0.7), hair, [], steps, counted=counted)
        ends, layers = (np.array(maps.samplers[name].read()) for name in ("hair_front", "hair_layers"))
        found.append((*np.moveaxis(ends.reshape(128, 128, 2), 2, 0), layers.reshape(128, 128, 4)))
    (triangle_front, triangle_back, triangle_layers), (front, back, layers) = found
    hit = (triangle_front < 1.9) & (front < 1.9)
    assert hit.sum() > 0.97 * (triangle_front < 1.9).sum() > 0
    assert np.median(np.abs(front - triangle_front)[hit]) < 2e-3
    assert np.median(np.abs(back - triangle_back)[hit]) < 2e-3
    assert (back >= front)[hit].all()
    assert (np.diff(layers, axis=2) >= 0.0).all()  # each counts what is in front of its far side
    np.testing.assert_allclose(layers.mean(axis=(0, 1)), triangle_layers.mean(axis=(0, 1)), rtol=0.03)


def test_fewer_thicker_strands_shade_as_much_as_all(scene, rng):
    """Maps that count 5,000 of 12,000 strands have the same ends, and displayed light differs by less than 1/255 in the
    mean, also if strands are mirrored and small.
    """
    points, radii = tuft(rng, 12_000)
    hair = strand_textures.upload_strands(points, 2.0 * radii)
    to_world, places = np.diag([-0.01, 0.01, 0.01, 1.0]), 0.01 * points[::4, 1::4].reshape(-1, 3) * (-1.0, 1.0, 1.0)
    found = []
    for counted in (None, 5000):  # as dense as 20,000 strands in a map of 512 texels
        maps, lights = shadows.ShadowMaps(256, 1), sun(0.4, 0.7)
        maps.draw(lights, [(hair, to_world)], [], counted=counted)
        found.append((np.array(maps.samplers["hair_front"].read()), seen_light(lights, maps, places)))
    (ends, light), (draft_ends, draft_light) = found
    np.testing.assert_array_equal(draft_ends, ends)
    assert light.mean() > 0.1 and not np.array_equal(draft_light, light)
    assert abs((draft_light ** (1.0 / 2.2)).mean() - (light ** (1.0 / 2.2)).mean()) < 1.0 / 255.0


def test_only_maps_that_change_are_drawn_again(scene, rng, monkeypatch):
    """Maps of unchanged lights, strands and surfaces stay, and all maps are those that are drawn at once."""
    points, radii = tuft(rng, 500)
    floor = np.float32([(-1.0, -1.0, -0.2), (1.0, -1.0, -0.2), (0.0, 1.0, -0.2)])
    kept, drawn, real = shadows.ShadowMaps(64, 2, in_compute=True), [], shadows.ShadowMaps._walk
    monkeypatch.setattr(shadows.ShadowMaps, "_walk", lambda *given: drawn.extend(given[1]) or real(*given))

    def maps_drawn(azimuth, radius, hair, surfaces, steps, counted=None):
        found = []
        for maps in (kept, shadows.ShadowMaps(64, 2, in_compute=True)):
            lights = sun(azimuth, 0.8, radius)
            lights["count"], lights["light"][1] = 2, sun(2.0, 0.5)["light"][0]
            drawn.clear()
            maps.draw(lights, hair, surfaces, steps, counted=counted)
            found.append((len(drawn), [np.array(texture.read()) for texture in maps.samplers.values()]))
        (count, textures), (all_count, others) = found
        assert all_count == 2
        for texture, other in zip(textures, others, strict=True):
            np.testing.assert_array_equal(texture, other)
        return count

    hair = [(strand_textures.upload_strands(points, radii), np.eye(4))]
    given = [0.3, 0.0, hair, [], drawing.Steps()]
    assert maps_drawn(*given) == 2
    assert maps_drawn(*given) == 0
    moved = np.diag([1.2, 1.2, 1.2, 1.0])
    changes = (
        (0, 0.4, 1),  # one light turns
        (2, [(strand_textures.with_points(hair[0][0], points + np.float32(0.01)), np.eye(4))], 2),
        (2, [(hair[0][0], moved)], 2),
        (3, [surface_textures.upload_surface(floor, np.int32([[0, 1, 2]]))], 2),
        (4, drawing.Steps(strand_count=100), 2),
        (3, [], 2),
    )
    for place, value, count in changes:
        given[place] = value
        assert maps_drawn(*given) == count
        assert maps_drawn(*given) == 0
    assert [maps_drawn(*given, counted) for counted in (100, 50, 50, None)] == [0, 2, 0, 2]
    given[0] = 0.5
    with monkeypatch.context() as patched:
        patched.setattr(strand_batches.Objects, "rasterize", failed)
        with pytest.raises(HairError):
            maps_drawn(*given)
    assert maps_drawn(*given) == 1  # a map whose drawing failed is drawn again


def failed(*_given):
    raise HairError("No memory.")


@pytest.mark.parametrize("in_compute", [True, False])
@pytest.mark.parametrize("turn", [1.2, 0.2, 0.0])
@pytest.mark.parametrize("radius", [0.0015, 0.012], ids=["thin", "thick"])
def test_short_strands_shade_what_spheres_along_them_shade(scene, rng, radius, turn, in_compute):
    """Strands that point toward the sun or beside it cast the shadow of their length times width and of half a disk at
    each end.
    """
    count, length = 2000, 0.006
    start = rng.uniform(-0.3, 0.3, (count, 1, 3))
    azimuth = rng.uniform(0.0, 2.0 * np.pi, (count, 1))
    beside = np.concatenate([np.cos(azimuth), np.sin(azimuth), np.zeros((count, 1))], axis=-1)
    way = (np.sin(turn) * beside + np.cos(turn) * np.array([0.0, 0.0, 1.0]))[:, None]
    points = (start + np.linspace(0.0, length, 5)[:, None] * way).astype(np.float32)
    radii = np.full(points.shape[:2], radius, np.float32)
    hair = [(strand_textures.upload_strands(points, radii), np.eye(4))]
    maps = shadows.ShadowMaps(256, 1, in_compute)
    maps.draw(sun(0.0, 0.5 * np.pi), hair, [])
    shaded = np.array(maps.samplers["hair_layers"].read()).reshape(-1, 4)[:, 3].mean()
    side = 2.0 * drawing.bounding_sphere(hair)[1]
    expected = count * (2.0 * radius * length * np.sin(turn) + np.pi * radius**2)
    assert shaded * side**2 == pytest.approx(expected, rel=0.06)


def test_turning_past_the_pole_keeps_the_shadow(scene, rng):
    """A light that passes the zenith keeps its shadow, although its map turns the other way round."""
    points, radii = tuft(rng)
    hair = strand_textures.upload_strands(points, radii)
    places = points[:, 1::4].reshape(-1, 3)
    heights = np.arcsin([0.899, 0.901])  # where the map's up changes from z to x
    first, second = (lit(sun(0.3, height), hair, [], places) for height in heights)
    assert np.abs(first - second).mean() < 0.03


@pytest.mark.parametrize("radius", [0.01, 0.1, 0.2])
def test_the_shadow_of_an_edge_is_as_wide_as_the_light(scene, rng, radius):
    """The penumbra of a half plane above the hair is about as wide as the sun's width times the edge's distance."""
    points, radii = tuft(rng)
    hair = strand_textures.upload_strands(points, np.full_like(radii, 1e-9))
    height = 0.25
    corners = np.array(
        [[0, -9, height], [9, -9, height], [9, 9, height], [0, -9, height], [9, 9, height], [0, 9, height]]
    )
    roof = surface_textures.upload_surface(corners.astype(np.float32), np.arange(6, dtype=np.int32))
    x = np.linspace(-0.1, 0.1, 801)
    places = np.stack([x, np.zeros_like(x), np.zeros_like(x)], axis=-1)
    light = lit(sun(0.0, 0.5 * np.pi, radius), hair, [roof], places)
    assert light[0] > 0.97 and light[-1] < 0.03
    assert (np.diff(light) < 1e-3).all()
    slope = np.abs(np.diff(light)).max() / (x[1] - x[0])
    extent = 2.0 * drawing.bounding_sphere([(hair, np.eye(4))])[1]
    blur = max(0.5 * radius * shadows._SHADE_DISTANCE * extent, shadows._LEAST_BLUR * extent / 512)
    # A Gaussian edge rises by 1 / (sqrt(2 pi) deviation); the bound that is read off the moments has a sharper middle.
    assert 0.5 < slope * np.sqrt(2.0 * np.pi) * blur < 3.0


def test_curls_shade_as_much_where_few_of_their_points_are_drawn(scene, rng):
    """Curls drawn with every seventh point are shorter, and are widened to cast the same shadow."""
    points, radii = tuft(rng)
    turn = np.linspace(0.0, 40.0, points.shape[1])
    curl = 0.004 * np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)
    hair = [(strand_textures.upload_strands((points + curl).astype(np.float32), 5.0 * radii), np.eye(4))]
    means = []
    for steps in (drawing.Steps(), drawing.Steps(point_count=4)):
        maps = shadows.ShadowMaps(128, 1)
        maps.draw(sun(0.4, 0.7), hair, [], steps)
        means.append(np.array(maps.samplers["hair_layers"].read()).reshape(-1, 4)[:, 3].mean())
    np.testing.assert_allclose(means[1], means[0], rtol=0.05)


def test_a_floor_lets_no_light_of_a_low_sun_through(scene, rng):
    """Places right above a floor are dark for light from below, as a slope between texels casts no penumbra."""
    points, radii = tuft(rng, 100)
    hair = strand_textures.upload_strands(points, np.full_like(radii, 1e-9))
    corners = 9.0 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    floor = surface_textures.upload_surface(corners.astype(np.float32), np.arange(6, dtype=np.int32))
    places = 0.1 * rng.uniform(-1.0, 1.0, (200, 3))
    places[:, 2] = 0.003
    for height in (0.2, 0.6, 1.5):
        assert lit(sun(0.3, -height), hair, [floor], places, 128).max() < 0.02
        assert lit(sun(0.3, height), hair, [floor], places, 128).min() > 0.98


@pytest.mark.parametrize("kind", [1, 3], ids=["point", "area"])
@pytest.mark.parametrize("height", [0.05, 0.14, 0.2], ids=["inside", "among tips", "above"])
def test_lights_near_hair_cast_shadows(scene, rng, kind, height):
    """A floor between hair and a light that is closer than the corners of the hair's box keeps the hair dark."""
    points, radii = tuft(rng, 300)
    hair = strand_textures.upload_strands(points, radii)
    corners = 9.0 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    floor = surface_textures.upload_surface(corners.astype(np.float32), np.arange(6, dtype=np.int32))
    lights = sun(0.0, 0.5 * np.pi)
    lights["light"][0]["kind"] = kind
    lights["light"][0]["position"][:3] = 0.0, 0.0, height
    places = np.append(rng.uniform(-0.1, 0.1, (100, 2)), rng.uniform(-0.1, -0.02, (100, 1)), axis=1)
    assert lit(lights, hair, [floor], places).max() < 0.05
    places[:, 2] = 0.5 * height
    assert lit(lights, hair, [floor], places).mean() > 0.9


def test_the_sphere_around_hair_touches_it(scene, rng):
    """The bounding sphere touches the hair after some strands have moved, and for scaled and rotated objects."""
    points, radii = tuft(rng, 300)
    hair = strand_textures.upload_strands(points, radii)
    strand_textures.move_strands(hair, np.array([3, 5]), points[[3, 5]] + np.float32(0.02))
    to_world = np.eye(4)
    to_world[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] * 2.0
    to_world[:3, 3] = 1.0, 2.0, 3.0
    for placed in ([(hair, to_world)], [(hair, to_world), (hair, np.eye(4))]):
        center, radius = drawing.tight_sphere(placed)
        every = np.concatenate([hair.points.reshape(-1, 3) @ m[:3, :3].T + m[:3, 3] for _, m in placed])
        farthest = np.linalg.norm(every - center, axis=1).max()
        assert 0.8 * radius < farthest < radius * (1.0 + 1e-5)


def combed(rng, radius, strand_count, point_count=33):
    """Return strands that lie around a ball of radius 10 cm, up to 3 mm above it, as `tuft`."""
    root = rng.normal(size=(strand_count, 1, 3))
    root /= np.linalg.norm(root, axis=2, keepdims=True)
    way = np.cross(root, rng.normal(size=root.shape))
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    angle = np.linspace(0.0, 1.5, point_count)[:, None]
    height = 0.1 + 0.003 * rng.random((strand_count, 1, 1))
    points = height * (np.cos(angle) * root + np.sin(angle) * way)
    return points.astype(np.float32), np.full(points.shape[:2], radius, np.float32)


def lit_by_rays(points, radius, places):
    """Return (N,) bool: whether rays from places (N, 3) along Y miss all strands (S, P, 3)."""
    start, end = points[:, :-1].reshape(-1, 3), points[:, 1:].reshape(-1, 3)
    # Segments beside all places block no ray.
    low, high = places.min(axis=0) - radius, places.max(axis=0) + radius
    is_near = ((np.maximum(start, end) > low) & (np.minimum(start, end) < high))[:, [0, 2]].all(axis=1)
    start, along = start[is_near], (end - start)[is_near]
    beside = places[:, None, ::2] - start[:, ::2]
    part = np.clip((beside * along[:, ::2]).sum(axis=2) / np.square(along[:, ::2]).sum(axis=1), 0.0, 1.0)
    meets = np.square(beside - part[..., None] * along[:, ::2]).sum(axis=2) < radius**2
    is_before = start[:, 1] + part * along[:, 1] > places[:, 1, None]
    return ~(meets & is_before).any(axis=1)


def test_grazing_light_reaches_as_many_places_among_curved_strands_as_rays_do(scene, rng):
    """Maps of curved strands drawn with few points would be inside of the hair, and light its outer strands."""
    points, radii = combed(rng, 4e-5, 5000)
    hair = strand_textures.upload_strands(points, radii)
    middle = points.reshape(-1, 3)
    places = middle[(np.abs(middle[:, 0]) < 0.01) & (np.abs(middle[:, 1]) < 0.03) & (middle[:, 2] > 0.0)]
    places = places + rng.normal(scale=3e-4, size=places.shape).astype(np.float32)  # between strands
    places = places[np.linalg.norm(places, axis=1) > 0.102]  # of the outer third
    by_rays = lit_by_rays(points, 4e-5, places)
    by_maps = lit(sun(0.5 * np.pi, 0.0), hair, [], places)
    assert by_maps.mean() == pytest.approx(by_rays.mean(), rel=0.1)


def test_maps_at_rest_are_drawn_from_the_points_that_show_the_strands(scene, rng):
    """At rest, maps draw straight strands with two points, curls with all, and arcs with fewer on coarser maps."""
    points, _radii = tuft(rng, 300)

    def drawn_points(shape, size=256):
        at = points[:, :1] + shape
        hair = strand_textures.upload_strands(at.astype(np.float32), np.full(at.shape[:2], 1e-4, np.float32))
        placed = [(hair, np.eye(4))]
        view = shadows._aim(sun(0.4, 0.7)["light"][0], placed, drawing.bounding_sphere(placed), size)
        records = shadows._records(hair, view, np.eye(4)[None], drawing.Steps(), is_steady=False)
        return int(records["drawn_points"][0])

    straight = np.linspace(0.0, 0.06, 21)[:, None] * np.array([0.0, 0.6, 0.8])
    assert drawn_points(straight) == 2
    turn = np.linspace(0.0, 12.0 * np.pi, 33)
    assert drawn_points(np.stack([0.01 * np.cos(turn), 0.01 * np.sin(turn), 0.002 * turn], axis=-1)) == 33
    turn = np.linspace(0.0, 1.5, 61)
    arcs = np.stack([0.2 * np.sin(turn), 0.0 * turn, 0.2 * np.cos(turn)], axis=-1)
    counts = [drawn_points(arcs, size) for size in (64, 512)]
    assert 4 <= counts[0] < counts[1] <= 31


def test_hair_is_placed_in_the_maps_of_all_lights_at_once(scene, rng, monkeypatch):
    """Records of hair in the maps of several lights have the same bits as those for each light alone."""
    points, radii = tuft(rng, 300)
    many, few = (strand_textures.upload_strands(points[:count], radii[:count]) for count in (300, 40))
    scales = (1.0, 1.0, 1.0), (0.01, 0.01, 0.01), (1.0, -1.0, 1.0), (3.0, 1.0, 0.2)
    hair = [(strands, np.diag([*scale, 1.0])) for strands in (many, few) for scale in scales]
    lights, places = sun(0.4, 0.7), ((0.0, 0.0, 0.0), (0.5, 0.2, 0.1), (3.0, -2.0, 5.0))
    lights["count"] = 4
    for light, place in zip(lights["light"][1:], places, strict=False):
        light["kind"], light["casts_shadow"], light["position"][:3] = 1, True, place  # inside, near and far
        light["axis"][:3] = 0.0, 0.0, -1.0
    steps, calls, alone = drawing.Steps(strand_count=30), [], drawing.strand_records
    monkeypatch.setattr(drawing, "strand_records", lambda *given: calls.append(given[0]) or alone(*given))
    tables, objects = [], strand_batches.Objects
    monkeypatch.setattr(strand_batches, "Objects", lambda *given: tables.append(1) or objects(*given))
    maps = shadows.ShadowMaps(64, 4, in_compute=True)
    maps.draw(lights, hair, [], steps, counted=30)
    assert len(tables) == 2  # one of all linked objects and lights, for each hair
    assert calls == [many, few]
    calls.clear()
    maps.draw(lights, hair, [], steps, counted=20)
    assert len(tables) == 2 * 2  # others for the counted strands, and the same for all strands
    assert calls == [many, few]
    maps.draw(lights, hair, [], steps, lambda index: (hair[:2] if index == 1 else hair, []), counted=20)
    assert calls == [many, few] * 2 + [many]
    views = [shadows._aim(light, hair, drawing.bounding_sphere(hair), 64) for light in lights["light"][:4]]
    to_world = np.stack([place for _strands, place in hair[:4]])
    together = shadows._records(many, np.stack(views), to_world, drawing.Steps(), is_steady=False)
    assert len(np.unique(together["drawn_points"])) > 2
    for records, view in zip(together, views, strict=True):
        np.testing.assert_array_equal(records, shadows._records(many, view, to_world, drawing.Steps(), False))


# More than 65,536 work groups, a number of two parts in the table of objects, need 400,000 strands.
@pytest.mark.parametrize("strand_count", [200, pytest.param(400_000, marks=pytest.mark.long)])
def test_maps_of_lights_that_are_drawn_together_are_those_of_each_light(scene, rng, monkeypatch, strand_count):
    """Maps of ten lights, of linked and uneven hair that casts shadows of some lights alone, have the same bits whether
    they are drawn together or one after the other.
    """
    points, radii = tuft(rng, strand_count)
    many, few = (strand_textures.upload_strands(points[:count], radii[:count]) for count in (strand_count, 30))
    places = np.diag([0.01, 0.02, 0.03, 1.0]), np.diag([0.4, -0.5, 0.4, 1.0]), np.diag([1.0, 1.0, 1.0, 1.0])
    hair = [(strands, place) for place in places for strands in (many, few)]
    floor = np.float32([(-1.0, -1.0, 0.1), (1.0, -1.0, 0.1), (0.0, 1.0, 0.1)])
    surfaces = [surface_textures.upload_surface(floor, np.int32([[0, 1, 2]]))]
    lights = sun(0.4, 0.7)
    lights["count"] = 10
    for index in range(1, 10):
        lights["light"][index] = sun(0.6 * index, 0.3 + 0.1 * index)["light"][0]
        if index % 2:
            lights["light"]["kind"][index], lights["light"]["position"][index, :3] = 1, (0.5 * index, -2.0, 1.0)
    found, textures = [], []
    for most in (uniforms.MAP_CAPACITY, 1):
        monkeypatch.setattr(uniforms, "MAP_CAPACITY", most)
        maps, record = shadows.ShadowMaps(48, 10, in_compute=True), lights.copy()
        some = [([], []), (hair[4:5], surfaces), (hair[:4] + hair[5:], []), (hair, surfaces)]
        maps.draw(
            record,
            hair,
            surfaces,
            drawing.Steps(),
            lambda index, some=some: some[index % 4],
            counted=strand_count // 10,
        )
        found.append(record)
        both = maps.samplers["hair_front"], maps.samplers["hair_layers"]
        textures.append([layer_of(texture, index) for texture in both for index in range(10)])
    assert found[0].tobytes() == found[1].tobytes()
    np.testing.assert_array_equal(*textures)
    assert [layer[..., :2].any() for layer in textures[0][10:]] == [index % 4 > 0 for index in range(10)]


def test_frames_with_much_hair_share_their_tables_of_objects(scene, rng, monkeypatch):
    """The next frame with the same hair makes no table of objects again, however much hair there is."""
    points, radii = tuft(rng, 2)
    places = [np.diag([1.0 + index, 1.0, 1.0, 1.0]) for index in range(80)]
    hair = [(strand_textures.upload_strands(points, radii), place) for place in places]
    tables, objects = [], strand_batches.Objects
    monkeypatch.setattr(strand_batches, "Objects", lambda *given: tables.append(1) or objects(*given))
    for _frame in range(2):
        shadows.ShadowMaps(16, 1, in_compute=True).draw(sun(0.4, 0.7), hair, [], counted=1)
        assert len(tables) == 2 * 80  # of all strands, and of the counted strands


def layer_of(texture, layer):
    """Return (height, width, 4) of a layer of an array texture."""
    framebuffer = gpu.types.GPUFrameBuffer(color_slots={"texture": texture, "layer": layer})
    with framebuffer.bind():
        pixels = framebuffer.read_color(0, 0, texture.width, texture.height, 4, 0, "FLOAT")
    return np.array(pixels, np.float32).reshape(texture.height, texture.width, 4)


def test_maps_of_strands_that_the_gpu_makes_do_not_wait_for_their_bounds(scene, rng, monkeypatch):
    """Maps are drawn before the bounds are read, and are the same as with known bounds, also if strands outgrow
    them.
    """
    points, radii = tuft(rng, 300)
    waits, knows = (shadows.ShadowMaps(64, 2, in_compute=True) for _ in range(2))
    events, real = [], shadows.ShadowMaps._walk
    monkeypatch.setattr(shadows.ShadowMaps, "_walk", lambda *given: events.append("drawn") or real(*given))

    def read(bounds):
        events.append("read")
        return bounds

    counts = []
    for size, mirrored in ((1.0, 1), (1.2, 1), (1.21, -1), (1.9, 1), (1.95, 1), (0.4, 1)):
        to_world = np.diag([0.01, 0.02 * mirrored, 0.01, 1.0])
        known = strand_textures.upload_strands(points * np.float32(size), radii)
        made = replace(known, is_made=True, box=StrandBox(partial(read, known.box.known)))
        records = []
        for maps, strands in ((knows, known), (waits, made)):
            events.clear()
            lights = sun(0.3, 0.8)
            lights["count"], lights["light"][1] = 2, sun(2.0, 0.5)["light"][0]
            maps.draw(lights, [(strands, to_world)], [], is_steady=True)
            records.append(lights)
        assert records[0].tobytes() == records[1].tobytes()
        for texture, other in zip(waits.samplers.values(), knows.samplers.values(), strict=True):
            np.testing.assert_array_equal(np.array(texture.read()), np.array(other.read()))
        counts.append((events.index("read"), len(events) - 1))
    # The aim changes with the second, fourth and last hair, whose maps are drawn twice.
    assert counts == [(0, 1), (1, 2), (1, 1), (1, 2), (1, 1), (1, 2)]
