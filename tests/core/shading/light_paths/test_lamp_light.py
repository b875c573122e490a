# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps in path tracing are as bright as an equal part of the world, and few paths find them."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import warp as wp

from hair_addon.core.imaging import lamps
from hair_addon.core.shading.light_paths.light_sources import area_falloff
from hair_addon.core.shading.tables import lookup_tables
from tests.core.shading.light_paths.test_gather import (
    ALONG_Y,
    LAMP,
    found_by,
    grid_of,
    level_view,
    ratio,
    strands_in_a_box,
    surroundings,
)
from tests.support.pairs import share_of

wp.set_module_options({"enable_backward": False})


def lamp(kind, distance, radius, power=1.0):
    """Return a lamp on the viewer's side of the origin that shines along y."""
    found = np.zeros(1, LAMP)
    found["kind"], found["radius"], found["casts_shadow"] = kind, radius, 1
    found["position"][0, 1], found["axis"][0, 1], found["power"][0, :3] = -distance, 1.0, power
    return found


@pytest.mark.parametrize("kind", share_of([lamps.SUN, lamps.POINT, lamps.AREA]))
def test_a_wide_lamp_is_a_part_of_the_world(rng, kind):
    """A wide lamp lights hair as a world that has the radiance of the lamp's disk in a cone."""
    rough = lookup_tables.Settings(mode="energy", roughness=0.8, radial_roughness=0.8)
    grid = grid_of(strands_in_a_box(rng, 600), (0.05, 0.3, 1.0), 0.02, rough, voxel_count=625)
    power = {lamps.SUN: 3.0, lamps.POINT: 12.0 * np.pi * 500.0**2, lamps.AREA: 3.0 * np.pi * 500.0**2}[kind]
    wide = lamp(kind, 500.0, 1.5 if kind == lamps.SUN else 750.0, power)
    v, u = (np.arange(256) + 0.5) / 256 - 0.5, 0.5 - (np.arange(512) + 0.5) / 512
    latitude, longitude = np.meshgrid(np.pi * v, 2.0 * np.pi * u, indexing="ij")
    cosine = np.maximum(-np.cos(latitude) * np.sin(longitude), 1e-9)  # with the direction to the lamp's middle
    radiance = np.where(np.sqrt(1.0 - cosine**2) / cosine < 1.5, 3.0 / (np.pi * 1.5**2), 0.0)
    if kind == lamps.SUN:  # even light over its disk, not over its angles
        radiance = radiance / cosine**3
    world = replace(surroundings(), world=np.repeat(radiance[..., None], 3, axis=-1))
    found = [ratio(found_by(grid, light, ALONG_Y, 40_000)) for light in (surroundings(lamps=wide), world)]
    np.testing.assert_allclose(found[0], found[1], rtol=0.04)


def light_on_a_strand(light, path_count=20_000, patterns=None):
    """Return the `ratio` of a thin strand at the origin that a lamp lights, seen along y."""
    thin = np.stack([np.linspace(-0.02, 0.02, 3), np.zeros(3), np.zeros(3)], axis=-1)[None]
    grid = grid_of(thin, (0.05, 0.3, 1.0), 0.002, voxel_count=125)
    seen_in = level_view((0.0, -0.1, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.02, 0.004), 0.2)
    return ratio(found_by(grid, replace(surroundings(lamps=light), patterns=patterns), seen_in, path_count))


def test_a_pattern_scales_light_in_its_directions():
    """A pattern around an axis of the lamp scales light by its value toward the strand."""
    plain = light_on_a_strand(lamp(lamps.POINT, 5.0, 0.01, 300.0), 4_000)
    pattern = np.zeros((1, 32, 64, 3), np.float32)
    pattern[0, 28:] = 2.0, 1.0, 0.5  # directions along the z axis
    for sign, factor in ((1.0, [1.0, 0.5, 0.25]), (-1.0, [0.0, 0.0, 0.0])):
        turned = lamp(lamps.POINT, 5.0, 0.01, 300.0)
        turned["pattern_layer"] = 1
        axes = [[1, 0, 0], [0, 0, 1], [0, sign, 0]]  # z toward the strand
        turned["pattern"][0, :3, :3] = 0.01 * np.transpose(axes)  # their length has no effect
        turned["pattern"][0, 3, :3] = 0.5
        np.testing.assert_allclose(light_on_a_strand(turned, 4_000, pattern), np.multiply(factor, plain), rtol=1e-3)
    turned["pattern_layer"] = 2
    with pytest.raises(ValueError, match="pattern 2 of 1"):
        light_on_a_strand(turned, 4_000, pattern)


def test_near_a_lamp_light_grows_as_its_disk_does():
    """Near a lamp that shines all around, light grows as its disk, which turns to strands at a quarter of its
    radius.
    """
    around, forward = (
        light_on_a_strand(lamp(kind, 0.1, 0.4, power)) for kind, power in ((lamps.POINT, 4.0), (lamps.AREA, 1.0))
    )
    np.testing.assert_allclose(around, forward, rtol=0.03)


def turned(light, angle):
    """Return a lamp that shines at an angle [rad] from y."""
    light["axis"][0, :3] = 0.0, np.cos(angle), np.sin(angle)
    return light


def test_a_spot_is_a_point_within_its_cone():
    """A spot is a point within its cone: no light beyond it, and half the light in the middle of its soft edge by
    cosines.
    """
    cos_cone, blend = np.cos(0.6), 0.4
    cosines = {"inside": 1.0, "halfway": cos_cone + 0.5 * blend * (1.0 - cos_cone), "beyond": cos_cone - 0.01}
    found = {}
    for place, cosine in cosines.items():
        spot = turned(lamp(lamps.SPOT, 5.0, 0.01, 300.0), np.arccos(cosine))
        spot["cos_cone"], spot["blend"] = cos_cone, blend
        found[place] = light_on_a_strand(spot, 4_000)
    point = light_on_a_strand(lamp(lamps.POINT, 5.0, 0.01, 300.0), 4_000)
    np.testing.assert_allclose(found["inside"], point, rtol=1e-4)
    np.testing.assert_allclose(found["halfway"], 0.5 * point, rtol=5e-3)
    assert not found["beyond"].any()


def test_an_area_lamp_of_less_spread_gives_as_much_light():
    """An area lamp of less spread gives as much light in its narrower cone as a lamp without a cone."""
    edges = np.linspace(0.0, 0.75, 13)
    sums = []
    for cos_cone in (0.0, np.cos(0.7)):
        total = 0.0
        for low, high in pairwise(edges):
            narrow = turned(lamp(lamps.AREA, 5.0, 0.01, 100.0), 0.5 * (low + high))
            narrow["cos_cone"] = cos_cone
            total += light_on_a_strand(narrow, 1_000) * (np.cos(low) - np.cos(high))
        sums.append(total)
    wide, narrow = sums
    np.testing.assert_allclose(narrow * np.sin(edges[-1]) ** 2, wide, rtol=0.02)


@wp.kernel
def _falloffs(cos_cone: float, cosines: wp.array[float], out_falloffs: wp.array[float]):
    out_falloffs[wp.tid()] = area_falloff(cosines[wp.tid()], cos_cone)


@pytest.mark.parametrize("spread", [1.0, 2.0, 5.0, 20.0, 25.0, 90.0, 170.0, 180.0])
def test_an_area_lamp_of_any_spread_sends_its_power(spread):
    """An area lamp of any spread sends its power: its radiance by the cosine, summed over the cone."""
    cos_cone = np.cos(0.5 * np.radians(spread))
    edges = np.linspace(cos_cone, 1.0, 501)
    cosines = wp.array((0.5 * (edges[:-1] + edges[1:])).astype(np.float32), dtype=float, device="cpu")
    found = wp.zeros_like(cosines)
    wp.launch(_falloffs, dim=len(cosines), inputs=[np.float32(cos_cone), cosines, found], device="cpu")
    power = 2.0 * np.mean(found.numpy() * cosines.numpy(), dtype=float) * (1.0 - cos_cone)
    assert power == pytest.approx(1.0, rel=0.005)


def test_a_lamp_among_hair_is_found_by_few_paths(rng):
    """Few paths find a lamp among hair: for a disk of 6 cm amid strands their means differ little."""
    grid = grid_of(strands_in_a_box(rng, 4_000), (0.02, 0.04, 0.06), 0.004, voxel_count=6_250)
    near = level_view((0.0, -0.3, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.3, 0.3), 4.3)
    up = lamp(lamps.AREA, 0.0, 0.06)
    up["axis"][0, :3] = 0.0, 0.0, 1.0
    means = [ratio(found_by(grid, surroundings(lamps=up), near, 8_000, seed)).mean() for seed in range(8)]
    assert np.std(means) < 0.2 * np.mean(means)
