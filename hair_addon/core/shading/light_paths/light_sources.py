# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps and the world as paths see them: shaders/include/lights.glsl, at a random point of each lamp."""

import warp as wp

from .fibre_walk import PI
from .grid_walk import FAR

wp.set_module_options({"enable_backward": False, "fast_math": True})

SUN, POINT, SPOT, AREA = (wp.constant(kind) for kind in range(4))  # as `core.imaging.lamps`


@wp.struct
class Sources:
    """Lamps, and a picture of the world without them."""

    count: int
    kind: wp.array[int]
    position: wp.array[wp.vec3]
    axis: wp.array[wp.vec3]
    power: wp.array[wp.vec3]
    shape: wp.array[wp.vec4]  # radius, cos_cone, blend, whether it casts shadows
    chance: wp.array[float]  # of being chosen
    world: wp.array2d[wp.vec3]  # rows of latitude, columns from pi to -pi


@wp.struct
class Lit:
    """Light of a lamp at a place: unit vector towards it, distance [m], irradiance."""

    direction: wp.vec3
    distance: float
    irradiance: wp.vec3
    casts_shadow: int


@wp.func
def across(direction: wp.vec3):
    """A unit vector at a right angle."""
    helper = wp.vec3(1.0, 0.0, 0.0)
    if wp.abs(direction[0]) > 0.7:
        helper = wp.vec3(0.0, 1.0, 0.0)
    return wp.normalize(wp.cross(direction, helper))


@wp.func
def on_disk(normal: wp.vec3, radius: float, first: float, second: float):
    """A point of a disk around the origin."""
    x = across(normal)
    y = wp.cross(normal, x)
    distance = radius * wp.sqrt(first)
    return distance * (wp.cos(2.0 * PI * second) * x + wp.sin(2.0 * PI * second) * y)


@wp.func
def world_radiance(sources: Sources, direction: wp.vec3):
    """Radiance of the world from a direction."""
    height = sources.world.shape[0]
    width = sources.world.shape[1]
    u = 0.5 - wp.atan2(direction[1], direction[0]) / (2.0 * PI)
    v = 0.5 + wp.asin(wp.clamp(direction[2], -1.0, 1.0)) / PI
    row = wp.clamp(int(v * float(height)), 0, height - 1)
    return sources.world[row, wp.clamp(int(u * float(width)), 0, width - 1)]


@wp.func
def spot_falloff(cosine: float, cos_cone: float, blend: float):
    inner = cos_cone + (1.0 - cos_cone) * wp.clamp(blend, 1e-4, 1.0)
    part = wp.clamp((cosine - cos_cone) / wp.max(inner - cos_cone, 1e-6), 0.0, 1.0)
    return part * part * (3.0 - 2.0 * part)


@wp.func
def area_falloff(cosine: float, cos_cone: float):
    if cos_cone < 1e-3:
        return 1.0
    tan_cone = wp.sqrt(1.0 - cos_cone * cos_cone) / cos_cone
    tan_angle = wp.sqrt(wp.max(0.0, 1.0 - cosine * cosine)) / wp.max(cosine, 1e-6)
    return wp.max(0.0, tan_cone - tan_angle) / wp.max(tan_cone - wp.atan(tan_cone), 1e-6)


@wp.func
def choose(sources: Sources, random: wp.uint32):
    """(index of one of the lamps, one over its chance, random state)."""
    state = random
    chosen = int(0)
    before = wp.randf(state)
    while chosen < sources.count - 1 and before >= sources.chance[chosen]:
        before -= sources.chance[chosen]
        chosen += 1
    return chosen, 1.0 / wp.max(sources.chance[chosen], 1e-12), state


@wp.func
def lit_by(sources: Sources, chosen: int, position: wp.vec3, least: float, random: wp.uint32):
    """(`Lit` by a lamp, random state); least: distance [m] below which no light grows.

    Nor does it nearer than half the radius of a lamp that shines all around: few paths with much light would be noise.
    """
    state = random
    lit = Lit()
    kind = sources.kind[chosen]
    axis = sources.axis[chosen]
    shape = sources.shape[chosen]
    one = wp.randf(state)
    other = wp.randf(state)
    lit.casts_shadow = int(shape[3])
    if kind == SUN:
        lit.direction = wp.normalize(on_disk(axis, shape[0], one, other) - axis)
        lit.distance = FAR
        lit.irradiance = sources.power[chosen]
    else:
        offset = sources.position[chosen] - position
        facing = axis
        if kind != AREA:
            facing = wp.normalize(offset)
        offset = offset + on_disk(facing, shape[0], one, other)
        distance = wp.max(wp.length(offset), 1e-6)
        lit.direction = offset / distance
        lit.distance = distance
        far = wp.max(distance, least)
        if kind != AREA:
            far = wp.max(far, 0.5 * shape[0])
        cosine = -wp.dot(lit.direction, axis)
        part = 1.0 / (4.0 * PI * far * far)
        if kind == SPOT:
            part = part * spot_falloff(cosine, shape[1], shape[2])
        if kind == AREA:
            part = wp.max(cosine, 0.0) / (PI * far * far) * area_falloff(cosine, shape[1])
        lit.irradiance = part * sources.power[chosen]
    return lit, state
