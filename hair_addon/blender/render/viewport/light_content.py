# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene content that the light of paths depends on, and the part of this light that stays valid after changes."""

from dataclasses import dataclass, replace

import numpy as np

from ....core.imaging import lamps
from ...gpu import drawing, light_patterns

_HALF_TURN = np.radians(20.0)  # angle of the view at which former paths have half their weight
_STILL = 0.01  # fraction of the hair's radius by which strands may move and still count as still
_SAMPLED = 500  # strands that are compared
_LEAST_PART = 0.02  # least part of measured light that is kept
_OTHER = 0.5  # weight of light that was measured with other strands, surfaces or looks


@dataclass(frozen=True, eq=False)
class LightContent:
    """All that the light of paths depends on, except the view."""

    hair: tuple  # (StrandsOnGPU, Shading, (4, 4) to world)
    lights: np.ndarray  # vector irradiance around the hair by lamp and channel, then the world's sides
    blockers: tuple  # (texture of places, corners, (4, 4) to world) of surfaces
    patterns: tuple  # `Panorama`s of lamps, then their axes and positions as bytes
    centre: np.ndarray  # (3,) of the hair [m]
    radius: float

    def part_since(self, before):
        """Return the part of the light measured with another `LightContent` that is still valid, from 0 to 1."""
        if len(self.hair) != len(before.hair):
            return 0.0
        known = _unchanged(self.lights, before.lights)
        if not self._has_blockers_of(before):
            known *= _OTHER
        if self.patterns != before.patterns:
            known *= _OTHER  # a pattern also changes between the places of `lights`
        counts = np.array([strands.strand_count for strands, *_ in self.hair], float)
        parts = [self._part_of(now, then, before) for now, then in zip(self.hair, before.hair, strict=True)]
        part = known * float(np.dot(counts, parts) / max(counts.sum(), 1.0))
        return part if part >= _LEAST_PART else 0.0

    def _part_of(self, now, then, before):
        """`part_since` of a single hair."""
        (strands, shading, to_world), (other, other_shading, other_to_world) = now, then
        part = _unchanged(to_world[:3, :3], other_to_world[:3, :3])
        if shading is not other_shading:
            part *= min(_unchanged(shading.reflectance, other_shading.reflectance), np.sqrt(_OTHER))
        if strands is other or not (strands.has_points and other.has_points):
            return part
        if strands.points.shape != other.points.shape:
            return _OTHER * part
        some = slice(None, None, max(strands.strand_count // _SAMPLED, 1))
        places, others = (
            one.points[some] @ placed[:3, :3].T + placed[:3, 3] - content.centre
            for one, placed, content in ((strands, to_world, self), (other, other_to_world, before))
        )
        moved = np.linalg.norm(places - others, axis=-1).max(axis=-1)
        return part * float((moved <= _STILL * self.radius).mean())

    def is_same(self, before):
        """Whether the light is that of another `LightContent`."""
        pairs = zip(self.hair, before.hair, strict=False)
        is_hair = len(self.hair) == len(before.hair) and all(
            now[0] is then[0] and now[1] is then[1] and np.array_equal(now[2], then[2]) for now, then in pairs
        )
        is_light = self.patterns == before.patterns and np.array_equal(self.lights, before.lights)
        return is_hair and is_light and self._has_blockers_of(before)

    def _has_blockers_of(self, before):
        return len(self.blockers) == len(before.blockers) and all(
            now[0] is then[0] and now[1] is then[1] and np.array_equal(now[2], then[2])
            for now, then in zip(self.blockers, before.blockers, strict=True)
        )

    def has_hair_of(self, before):
        """Whether strands, looks and places are those of another `LightContent`."""
        return _replaced(self, before).is_same(before)


def content_of(drawn):
    """Return the `LightContent` of a `DrawnScene`."""
    centre, radius = drawing.bounding_sphere([(strands, to_world) for strands, _, to_world, *_ in drawn.hair])
    places = centre + 0.5 * radius * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    found, patterns = drawn.lamps.lamps, drawn.lamps.patterns
    of_world = np.pi * drawn.lights["world"][:, :3].astype(float).ravel() / 3.0
    arriving, patterned = np.zeros(0), found[found["pattern_layer"] > 0]
    if len(found):
        to_lamps, amount = lamps.directions_to(found, places), lamps.irradiance(found, places)
        amount = amount * light_patterns.parts_at(found, patterns, places)
        arriving = (to_lamps[..., None] * amount[..., None, :]).ravel() / len(places)
    return LightContent(
        tuple(hair[:3] for hair in drawn.hair),
        np.concatenate([of_world, arriving]),
        tuple((one.places, one.corners, one.to_world) for one in (blocker.surface for blocker in drawn.blockers)),
        (*patterns, patterned["pattern"][:, :3].tobytes(), patterned["position"].tobytes()),
        centre,
        radius,
    )


def view_weight(camera, before, centre):
    """Weight of the paths of a former view."""
    cosine = np.clip(np.dot(_direction(camera, centre), _direction(before, centre)), -1.0, 1.0)
    return float(0.5 ** (np.arccos(cosine) / _HALF_TURN))


def _direction(camera, centre):
    """Unit vector from a center (3,) towards the viewer."""
    world_to_view, view_to_clip = camera
    towards = world_to_view[2, :3]
    if abs(view_to_clip[3, 3]) < 0.5:  # a perspective
        towards = np.linalg.inv(world_to_view)[:3, 3] - centre
    return towards / max(float(np.linalg.norm(towards)), 1e-12)


def _unchanged(values, before):
    """Return the part of light that stays valid, from 0 to 1, after numbers have changed."""
    size = max(np.size(values), np.size(before))
    now, then = (np.pad(np.ravel(one).astype(float), (0, size - np.size(one))) for one in (values, before))
    change = np.abs(now - then).sum() / max(np.abs(now).sum(), np.abs(then).sum(), 1e-12)
    return max(1.0 - float(change), 0.0) ** 4


def _replaced(content, other):
    return replace(content, lights=other.lights, blockers=other.blockers, patterns=other.patterns)
