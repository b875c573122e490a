# SPDX-License-Identifier: GPL-3.0-or-later
"""Light sources of paths: the lamps of shaders/light/lights.glsl, sampled at points, and the world."""

import warp as wp

from .fibre_walk import PI
from .grid_walk import FAR
from .world_light import World, world_direction

wp.set_module_options({"enable_backward": False, "fast_math": True})

_NO_AREA = wp.constant(1e-20)  # area of a lamp [m²] too small to be hit
SUN, POINT, SPOT, AREA = (wp.constant(kind) for kind in range(4))  # as `core.imaging.lamps`


@wp.struct
class Sources:
    """Lamps, and the world."""

    count: int
    kind: wp.array[int]
    position: wp.array[wp.vec3]
    axis: wp.array[wp.vec3]
    power: wp.array[wp.vec3]
    shape: wp.array[wp.vec4]  # radius, cos_cone, blend, whether it casts shadows
    chance: wp.array[float]  # probability of being chosen
    pattern: wp.array[int]  # index of the lamp's pattern, from one; 0 without a pattern
    pattern_axes: wp.array2d[wp.vec3]  # the lamp's axes, and RGB factors of its pattern
    patterns: wp.array2d[wp.vec3]  # rows of all patterns, by latitude and longitude around the lamp's axes
    pattern_rows: int  # of each pattern
    world: World
    faint: float  # sum of RGB at the viewer below which shadow rays are traced at random


@wp.struct
class Lit:
    """Light of a lamp at a place: unit vector toward a point of the lamp, distance [m], irradiance.

    density: of random points of the lamp in this direction [1/sr]; the lamp's radiance is density × irradiance.
    """

    direction: wp.vec3
    distance: float
    irradiance: wp.vec3
    density: float
    casts_shadow: int


@wp.func
def across(direction: wp.vec3):
    """Return a perpendicular unit vector."""
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
def spot_falloff(cosine: float, cos_cone: float, blend: float):
    """Attenuation of a spot light at an angle: one inside, zero outside the cone, smooth over the fraction `blend`, in
    cosines, from the cone to the axis.
    """
    inner = cos_cone + (1.0 - cos_cone) * wp.clamp(blend, 1e-4, 1.0)
    part = wp.clamp((cosine - cos_cone) / wp.max(inner - cos_cone, 1e-6), 0.0, 1.0)
    return part * part * (3.0 - 2.0 * part)


@wp.func
def area_falloff(cosine: float, cos_cone: float):
    """Radiance of an area light towards an angle, relative to a light without spread: linear in the tangent, zero
    outside the cone, with the same total power. cos_cone: of half the spread, 0 for the half sphere.
    """
    if cos_cone < 1e-3:
        return 1.0
    tan_cone = wp.sqrt((1.0 - cos_cone) * (1.0 + cos_cone)) / cos_cone
    tan_angle = wp.sqrt(wp.max(0.0, (1.0 - cosine) * (1.0 + cosine))) / wp.max(cosine, 1e-6)
    excess = tan_cone - wp.atan(tan_cone)
    if tan_cone < 0.2:  # here the difference is mostly rounding error
        squared = tan_cone * tan_cone
        excess = tan_cone * squared * (1.0 / 3.0 - squared * (1.0 / 5.0 - squared / 7.0))
    return wp.max(0.0, tan_cone - tan_angle) / wp.max(excess, 1e-12)


@wp.func
def choose(sources: Sources, random: wp.uint32):
    """Return (index of a random lamp, one over its probability, random state)."""
    state = random
    chosen = int(0)
    before = wp.randf(state)
    while chosen < sources.count - 1 and before >= sources.chance[chosen]:
        before -= sources.chance[chosen]
        chosen += 1
    return chosen, 1.0 / wp.max(sources.chance[chosen], 1e-12), state


@wp.func
def _pattern(sources: Sources, chosen: int, direction: wp.vec3):
    """Light in a unit direction from a lamp, relative to the lamp's power, as in shaders/light/irradiance.glsl."""
    found = wp.vec3(1.0, 1.0, 1.0)
    index = sources.pattern[chosen]
    if index > 0:
        x = wp.dot(direction, sources.pattern_axes[chosen, 0])
        y = wp.dot(direction, sources.pattern_axes[chosen, 1])
        z = wp.dot(direction, sources.pattern_axes[chosen, 2])
        z /= wp.max(wp.sqrt(x * x + y * y + z * z), 1e-12)  # an uneven scale distorts directions
        width = sources.patterns.shape[1]
        u = 0.5 - wp.atan2(y, x) / (2.0 * PI)
        v = 0.5 + wp.asin(wp.clamp(z, -1.0, 1.0)) / PI
        row = wp.clamp(int(v * float(sources.pattern_rows)), 0, sources.pattern_rows - 1)
        column = wp.clamp(int(u * float(width)), 0, width - 1)
        texel = sources.patterns[(index - 1) * sources.pattern_rows + row, column]
        found = wp.cw_mul(texel, sources.pattern_axes[chosen, 3])
    return found


@wp.func
def _sent(sources: Sources, chosen: int, offset: wp.vec3, lit: Lit, least: float):
    """Return a `Lit` completed by irradiance and density.

    lit: with direction and distance; offset: to the lamp's center [m].
    """
    shape = sources.shape[chosen]
    kind = sources.kind[chosen]
    area = wp.max(PI * shape[0] * shape[0], _NO_AREA)
    if kind == SUN:
        cosine = wp.max(-wp.dot(lit.direction, sources.axis[chosen]), 1e-6)
        lit.irradiance = sources.power[chosen]
        lit.density = 1.0 / (area * cosine * cosine * cosine)
    else:
        cosine = -wp.dot(lit.direction, sources.axis[chosen])
        part = 1.0 / (4.0 * PI)
        if kind == SPOT:
            part = part * spot_falloff(cosine, shape[1], shape[2])
        if kind == AREA:
            part = area_falloff(cosine, shape[1]) / PI
        facing = wp.max(-wp.dot(lit.direction, _disk_normal(sources, chosen, offset)), 0.0)
        squared = lit.distance * lit.distance
        near = wp.dot(offset, offset) + shape[0] * shape[0]
        dim = wp.min(1.0, near / (least * least))
        power = wp.cw_mul(sources.power[chosen], _pattern(sources, chosen, -wp.normalize(offset)))
        lit.irradiance = (dim * part * facing / squared) * power
        lit.density = squared / (wp.max(facing, 1e-6) * area)
    return lit


@wp.func
def _disk_normal(sources: Sources, chosen: int, offset: wp.vec3):
    """Return the normal of the emitting side of a lamp's disk; the disk of a point light faces the lit place."""
    normal = sources.axis[chosen]
    if sources.kind[chosen] != AREA:
        normal = -wp.normalize(offset)
    return normal


@wp.func
def lit_by(sources: Sources, chosen: int, position: wp.vec3, least: float, random: wp.uint32):
    """Return (`Lit` by a random point of a lamp, random state).

    least: distance [m] below which irradiance no longer increases. Without this limit few paths near small lamps would
    carry very much light.
    """
    state = random
    lit = Lit()
    axis = sources.axis[chosen]
    one = wp.randf(state)
    other = wp.randf(state)
    radius = sources.shape[chosen][0]
    lit.casts_shadow = int(sources.shape[chosen][3])
    offset = sources.position[chosen] - position
    if sources.kind[chosen] == SUN:
        lit.direction = wp.normalize(on_disk(axis, radius, one, other) - axis)
        lit.distance = FAR
    else:
        to_point = offset + on_disk(_disk_normal(sources, chosen, offset), radius, one, other)
        lit.distance = wp.max(wp.length(to_point), 1e-6)
        lit.direction = to_point / lit.distance
    return _sent(sources, chosen, offset, lit, least), state


@wp.func
def lit_by_world(sources: Sources, random: wp.uint32):
    """Return (`Lit` by a random direction of the world, random state)."""
    state = random
    lit = Lit()
    direction, radiance, density, after = world_direction(sources.world, state)
    lit.direction = direction
    lit.distance = FAR
    lit.density = wp.max(density, 1e-12)
    lit.irradiance = radiance / lit.density
    lit.casts_shadow = 1
    return lit, after


@wp.func
def lit_from(sources: Sources, chosen: int, position: wp.vec3, direction: wp.vec3, least: float):
    """Return the `Lit` by the point of a lamp in a direction; zero irradiance if the direction misses the lamp."""
    lit = Lit()
    lit.casts_shadow = int(sources.shape[chosen][3])
    lit.direction = direction
    radius = sources.shape[chosen][0]
    offset = sources.position[chosen] - position
    normal = sources.axis[chosen]
    if sources.kind[chosen] == SUN:
        lit.distance = FAR
        facing = -wp.dot(direction, normal)
        beside = direction + facing * normal
        is_there = facing > 0.0 and wp.length(beside) < radius * facing
    else:
        normal = _disk_normal(sources, chosen, offset)
        facing = -wp.dot(direction, normal)
        lit.distance = -wp.dot(offset, normal) / wp.max(facing, 1e-6)
        beside = lit.distance * direction - offset
        is_there = facing > 1e-6 and lit.distance > 0.0 and wp.length(beside) < radius
    if is_there:
        lit = _sent(sources, chosen, offset, lit, least)
    return lit
