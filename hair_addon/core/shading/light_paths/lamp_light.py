# SPDX-License-Identifier: GPL-3.0-or-later
"""Light at the events of a path.

Light comes from random points of lamps and of the world, and from lamps and the world that the path hits [Veach95].
Both methods sample the same light, so each is weighted by its share of both densities (the balance heuristic), so that
neither lamps near a strand nor narrow lobes give few paths much light.
"""

import warp as wp

from .fibre_walk import Fibre, between, value, value_at
from .grid_walk import PASSED, Hit, Medium, is_blocked
from .light_sources import Lit, Sources, choose, lit_by, lit_by_world, lit_from
from .surface_walk import Surface, surface_value
from .world_light import world_density, world_radiance

wp.set_module_options({"enable_backward": False, "fast_math": True})

_LAMPS_AT_ONCE = wp.constant(8)  # lamps traced at each event
_WORLD_AT_ONCE = wp.constant(4)  # directions of the world traced at a visible place
_OFFSETS_AT_ONCE = wp.constant(4)  # offsets averaged around the hit
_AROUND = wp.constant(0.25)  # half the averaged range, relative to the radius
_LEAST = wp.constant(0.25)  # relative to a voxel: distance below which the light of a lamp no longer increases


@wp.struct
class Event:
    """A place on strand `own`, or on a surface if `own` is negative.

    facing: unit vector toward the path's last place; offset: in the strand's width, from -1 to 1; weight: of light
    from there to the viewer.
    """

    position: wp.vec3
    facing: wp.vec3
    weight: wp.vec3
    offset: float
    own: int
    fibre: Fibre
    surface: Surface


@wp.func
def turn_density(here: Event, direction: wp.vec3):
    """Return the density [1/sr] with which a path leaves an event in a direction."""
    density = float(0.0)
    if here.own >= 0:
        _found, density = value(here.fibre, here.facing, direction, here.offset, here.weight)
    else:
        _found, density = surface_value(here.surface, direction, here.weight)
    return density


@wp.func
def _is_shadowed(medium: Medium, lit: Lit, here: Event):
    """Whether an event is in the shadow of a lamp."""
    if lit.casts_shadow == 0:
        return False
    return is_blocked(medium, here.position, lit.direction, lit.distance, here.own)


@wp.func
def _one_of(sources: Sources, index: int, random: wp.uint32):
    """Return (index of a lamp, one over its probability, random state).

    The lamp is that of an index, or a random lamp if there are more than `_LAMPS_AT_ONCE`.
    """
    state = random
    if sources.count <= _LAMPS_AT_ONCE:
        return index, 1.0, state
    chosen, one_over_chance, after = choose(sources, state)
    return chosen, one_over_chance / float(_LAMPS_AT_ONCE), after


@wp.func
def _lamp_at(medium: Medium, sources: Sources, index: int, here: Event, random: wp.uint32):
    """Return (`Lit`, factor of its light, random state).

    The light comes from the lamp of `_one_of`, or from the world for an index after the lamps.
    """
    state = random
    lit = Lit()
    share = float(1.0)
    if index < wp.min(sources.count, _LAMPS_AT_ONCE):
        chosen, of_one, after = _one_of(sources, index, state)
        share = of_one
        lit, state = lit_by(sources, chosen, here.position, _LEAST * medium.voxel, after)
    else:
        lit, state = lit_by_world(sources, state)
    return lit, share, state


@wp.func
def _offset_at(here: Event, step: int, shift: float):
    """Return an offset near that of an event."""
    h = here.offset + _AROUND * (2.0 * (float(step) + shift) / float(_OFFSETS_AT_ONCE) - 1.0)
    # Reflected at the edge: the mean over all offsets remains the mean over the width.
    if wp.abs(h) > 1.0:
        h = wp.sign(h) * 2.0 - h
    return h


@wp.func
def _scattered(here: Event, lit: Lit, shift: float):
    """Return the light of a point of a lamp that is scattered to the viewer, weighted by its share of densities.

    It is the mean around an offset.
    """
    light = wp.vec3(0.0, 0.0, 0.0)
    if here.own < 0:
        light, density = surface_value(here.surface, lit.direction, here.weight)
        light = wp.cw_mul(here.weight, wp.cw_mul(lit.irradiance, light)) * (lit.density / (lit.density + density))
    else:
        pair = between(here.fibre, here.facing, lit.direction)
        for step in range(_OFFSETS_AT_ONCE):
            found, density = value_at(here.fibre, pair, _offset_at(here, step, shift), here.weight)
            light += found * (lit.density / (lit.density + density))
        light = wp.cw_mul(here.weight, wp.cw_mul(lit.irradiance, light / float(_OFFSETS_AT_ONCE)))
    return light


@wp.func
def _by_lot(light: wp.vec3, faint: float, random: wp.uint32):
    """Return (light, random state). Light whose sum of RGB is below `faint` becomes `faint` or zero at random, with the
    same mean [Arvo90]: zero light needs no shadow ray.
    """
    state = random
    amount = light[0] + light[1] + light[2]
    lot = wp.randf(state) * faint  # always drawn, so that all later numbers are the same
    result = light
    if amount < faint:
        result = wp.vec3(0.0, 0.0, 0.0)
        if lot < amount:
            result = light * (faint / amount)
    return result, state


@wp.func
def light_at_once(medium: Medium, sources: Sources, here: Event, random: wp.uint32):
    """Return (radiance that an event scatters to the viewer, random state), with a shadow ray to each lamp that is not
    faint.
    """
    state = random
    light = wp.vec3(0.0, 0.0, 0.0)
    lamp_count = wp.min(sources.count, _LAMPS_AT_ONCE)
    for index in range(lamp_count + _WORLD_AT_ONCE * sources.world.is_uneven):
        lit, share, after = _lamp_at(medium, sources, index, here, state)
        state = after
        if index >= lamp_count:
            share = share / float(_WORLD_AT_ONCE)
        if wp.max(lit.irradiance) > 0.0:
            scattered = share * _scattered(here, lit, wp.randf(state))
            found, after_lot = _by_lot(scattered, sources.faint, state)
            state = after_lot
            if wp.max(found) > 0.0 and not _is_shadowed(medium, lit, here):
                light += found
    return light, state


@wp.func
def light_by_share(medium: Medium, sources: Sources, here: Event, random: wp.uint32):
    """Return `light_at_once` with a single shadow ray, to a lamp chosen by its share of the unshadowed light
    [Talbot05].
    """
    state = random
    total = float(0.0)
    result = wp.vec3(0.0, 0.0, 0.0)
    kept_lit = Lit()
    for index in range(wp.min(sources.count, _LAMPS_AT_ONCE) + sources.world.is_uneven):
        lit, share, after = _lamp_at(medium, sources, index, here, state)
        state = after
        light = wp.vec3(0.0, 0.0, 0.0)
        if wp.max(lit.irradiance) > 0.0:
            light = share * _scattered(here, lit, wp.randf(state))
        amount = light[0] + light[1] + light[2]
        if amount > 0.0:
            total += amount
            if wp.randf(state) * total <= amount:
                result = light / amount
                kept_lit = lit
    found, after_lot = _by_lot(result * total, sources.faint, state)
    if wp.max(found) > 0.0:
        if _is_shadowed(medium, kept_lit, here):
            found = wp.vec3(0.0, 0.0, 0.0)
    return found, after_lot


@wp.func
def light_at_hit(medium: Medium, sources: Sources, here: Event, direction: wp.vec3, hit: Hit, random: wp.uint32):
    """Return (radiance from the direction in which a path leaves an event, weighted by its share of densities, random
    state). hit: the hit in that direction.
    """
    state = random
    light = wp.vec3(0.0, 0.0, 0.0)
    for index in range(wp.min(sources.count, _LAMPS_AT_ONCE)):
        chosen, share, after = _one_of(sources, index, state)
        state = after
        lit = lit_from(sources, chosen, here.position, direction, _LEAST * medium.voxel)
        if wp.max(lit.irradiance) > 0.0:
            end = wp.dot(hit.position - here.position, direction)
            if hit.kind == PASSED or lit.casts_shadow == 0 or lit.distance < end:
                density = turn_density(here, direction)
                light += lit.irradiance * (share * lit.density * density / (lit.density + density))
    if hit.kind == PASSED:
        of_turn = float(1.0)
        if sources.world.is_uneven > 0:
            density = turn_density(here, direction)
            of_turn = density / wp.max(density + world_density(sources.world, direction), 1e-30)
        light += of_turn * world_radiance(sources.world, direction)
    return light, state
