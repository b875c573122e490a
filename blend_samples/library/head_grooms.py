# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms of the sample's head, by code: pixie, bob, long wavy, curly, coily and braid. `GROOMS` has them by name.

Each function takes the dressed head and a number of strands, and returns the Curves of the hair. The face looks to -Y,
+X is its left.
"""

import bpy
import numpy as np

from blend_samples.heads import head
from blend_samples.library import combing
from blend_samples.library.combing import Solid, columns, march, mixed, part, unit
from hair_addon import api

_CENTER = np.array([0.0, -0.055, 0.755])  # [m]: of the skull
_WHORL = np.array([0.012, 0.012, 0.838])  # [m]: from where short hair grows
_PARTING = head.PARTING
_EAR = np.array([0.080, -0.042, 0.712]), np.array([0.030, 0.052, 0.054])  # [m]: middle and radii of a left ear's place
_DENSITY_GROUP = "guides"
_COVERAGE = 3.0  # [m]: radii of all strands, as of 75,000 hairs: fewer of them are thicker


def pixie(head_object, strand_count):
    """Short and platinum: cropped at the sides and the nape, a longer top that is swept across the forehead."""
    guides, roots, normals, rng = _placed(head_object, 480)
    top = part(roots[:, 2] - 0.25 * roots[:, 1], 0.80, 0.845)
    front = part(-roots[:, 1], 0.07, 0.12) * top
    lengths = (0.028 + 0.040 * top + 0.044 * front) * rng.uniform(0.85, 1.1, len(roots))
    height = 0.0025 + 0.009 * top + 0.002 * front
    skull = Solid(head_object)

    def aim(place, gone):
        _near, normal = skull.nearest(place)
        away = place - _WHORL
        flow = unit(away - np.einsum("ni,ni->n", away, normal)[:, None] * normal)
        flow = mixed(flow, columns(0.70, -0.75 + 0.75 * gone, -0.15 - 0.85 * gone), 0.9 * front)
        return flow + 1.2 * skull.toward(place, height * part(gone, 0.0, 0.4), 0.01)

    def clear(place, gone):
        return skull.clear(place, np.maximum(height * part(gone, 0.0, 0.5), 0.001))

    points = march(roots, 0.7 * normals + aim(roots, 0.0), lengths, aim, clear, turn=0.35)
    combing.write(guides, points)
    styles = [
        api.Trim(random=0.25, seed=1),
        api.Clump(size=0.009, levels=2, amount=0.75, fine_amount=0.8, thickness=0.25, shape=0.45, stray=0.05, seed=2),
        api.Bend(angle=0.3, vary=0.6, random_turn=0.3, seed=3),
        api.Frizz(amplitude=0.0005, wavelength=0.03, stray=0.03, stray_gain=3.0, seed=4),
    ]
    return _hair(guides, styles, "PLATINUM", strand_count, tip_taper=0.6)


def bob(head_object, strand_count):
    """Straight, black, cut in a line at the chin, with a fringe."""
    guides, roots, normals, rng = _placed(head_object, 560)
    skull, shoulders = Solid(head_object), Solid(bpy.data.objects["Bust"])
    side = np.where(roots[:, 0] >= 0.0, 1.0, -1.0)
    across = roots[:, 0] / 0.056
    is_fringe = (roots[:, 1] < -0.085) & (np.abs(across) < 1.0)
    back = part(roots[:, 1], -0.04, 0.02)
    height = np.where(is_fringe, 0.005, 0.013)
    lengths = np.where(is_fringe, 0.14, 0.34)

    def aim(place, gone):
        reach = gone * lengths
        hanging = mixed(columns(side, 0.6 * back, -0.1), columns(0.0, 0.0, -1.0), part(reach, 0.0, 0.05))
        tips = part(0.70 - place[:, 2], 0.0, 0.06)
        hanging = mixed(hanging, columns(-0.35 * side * (1.0 - back), -0.35 * back, -1.0), tips)
        fringe = mixed(columns(0.25 * across, -1.0, 0.05), columns(0.10 * across, 0.1, -1.0), part(reach, 0.01, 0.05))
        return np.where(is_fringe[:, None], fringe, hanging) + skull.toward(place, height, 0.02)

    def clear(place, gone):
        place = skull.clear(place, np.minimum(0.002 + 0.3 * gone * lengths, height - 0.001))
        return shoulders.clear(_over_ear(place), 0.004)

    points = march(roots, 0.6 * normals + unit(aim(roots, 0.0)), lengths, aim, clear)
    level = np.where(is_fringe, 0.760 - 0.006 * across**2, 0.632 + 0.010 * back) + rng.normal(0.0, 0.0007, len(roots))
    points = combing.cut_at(points, points[..., 2] < level[:, None])
    combing.write(guides, points)
    _keep_apart(guides, is_fringe)
    styles = [
        api.Clump(size=0.010, amount=0.3, fine_amount=0.6, thickness=0.4, shape=0.5, stray=0.02, seed=2),
        api.Frizz(amplitude=0.0003, wavelength=0.06, stray=0.01, stray_gain=4.0, seed=3),
    ]
    return _hair(guides, styles, "BLACK", strand_count, tip_taper=0.1, region_attribute="part")


def long_wavy(head_object, strand_count):
    """Parted at the side, over chest and back, in loose waves."""
    points, guides, _roots = _long(head_object, 0.47, volume=0.010)
    combing.write(guides, points)
    styles = [
        api.Trim(random=0.15, seed=1),
        api.Clump(size=0.026, amount=0.72, fine_amount=0.6, thickness=0.28, shape=0.25, stray=0.03, seed=2),
        api.Curl(radius=0.0125, pitch=0.105, flatness=0.55, coherence=0.93, root=0.0, tip=1.0, start=0.2, seed=3),
        api.Frizz(amplitude=0.0005, wavelength=0.05, stray=0.02, stray_gain=3.0, tip=0.6, seed=4),
    ]
    return _hair(guides, styles, "LIGHT_BROWN", strand_count, tip_taper=0.25, point_count=81, region_attribute="part")


def curly(head_object, strand_count):
    """Ringlets to the shoulders, with height at the crown."""
    points, guides, _roots = _long(head_object, 0.31, volume=0.024, is_lifted=True)
    combing.write(guides, points)
    styles = [
        api.Trim(random=0.25, seed=1),
        api.Clump(size=0.017, levels=1, amount=0.96, thickness=0.09, shape=0.16, crossover=0.04, stray=0.02, seed=2),
        api.Curl(radius=0.0078, pitch=0.034, coherence=0.97, vary=0.15, root=0.15, start=0.08, left_handed=0.0, seed=3),
        api.Frizz(amplitude=0.0004, wavelength=0.025, stray=0.03, stray_gain=3.0, seed=4),
    ]
    return _hair(guides, styles, "AUBURN", strand_count, tip_taper=0.2, point_count=121)


def coily(head_object, strand_count):
    """Tight coils in a round shape."""
    guides, roots, normals, rng = _placed(head_object, 420)
    skull = Solid(head_object)
    outward = unit(roots - (_CENTER + np.array([0.0, 0.015, 0.0])))
    outward = unit(outward + columns(0.0, 0.25 * part(-roots[:, 1], 0.06, 0.14), 0.10))
    above = part(head.above_hairline(roots), 0.0, 0.03)
    lengths = (0.075 + 0.060 * above) * rng.uniform(0.97, 1.03, len(roots))
    points = march(
        roots,
        0.6 * normals + outward,
        lengths,
        lambda place, gone: outward + columns(0.0, 0.0, -0.25 * gone),
        lambda place, gone: skull.clear(place, 0.001),
    )
    combing.write(guides, points)
    styles = [
        api.Frizz(amplitude=0.004, wavelength=0.05, octaves=1, seed=1),
        api.Clump(size=0.008, levels=1, amount=0.9, thickness=0.14, shape=0.12, crossover=0.08, stray=0.02, seed=2),
        api.Curl(radius=0.0038, pitch=0.0092, coherence=0.95, root=0.8, vary=0.1, left_handed=0.0, seed=3),
        api.Frizz(amplitude=0.0005, wavelength=0.014, seed=4),
    ]
    return _hair(guides, styles, "BLACK", strand_count, tip_taper=0.2, point_count=201)


# A braid.

_TIE = np.array([0.052, 0.020, 0.660])  # [m]: where the hair is gathered
_COURSE = np.array(  # [m]: of the braid from there, over the left shoulder
    [
        (0.052, 0.020, 0.660),
        (0.074, -0.020, 0.622),
        (0.092, -0.075, 0.580),
        (0.096, -0.122, 0.520),
        (0.093, -0.142, 0.460),
        (0.090, -0.148, 0.400),
    ]
)
_SCALP_STEPS = 9  # points of a guide before the tie
_BRAID_RADIUS, _BRAID_PITCH, _BRAID_FLATNESS = 0.0140, 0.078, 0.60  # [m], [m]
_TRESS_RADIUS = 0.0066  # [m]
_BRAID_PARTING = -0.028  # [m]
_BRAIDED = 0.86  # part of the course that is braided; the rest is loose


def braid(head_object, strand_count):
    """Hair gathered at the nape in a thick braid over a shoulder."""
    guides, roots, _normals, _rng = _placed(head_object, 520)
    skull = Solid(head_object)
    turn, radius, tress = _places_in_tresses(roots)
    points = np.concatenate([_to_tie(skull, roots), _braided(turn, radius, tress)], axis=1)
    combing.write(guides, points)
    _keep_apart(guides, tress)
    styles = [
        api.Trim(random=0.06, seed=1),
        api.Frizz(amplitude=0.0003, wavelength=0.05, stray=0.02, stray_gain=4.0, seed=2),
    ]
    settings = {"tip_taper": 0.3, "point_count": 121, "region_attribute": "part", "keep_length": 0.0}
    return _hair(guides, styles, "BLOND", strand_count, **settings)


def _places_in_tresses(roots):
    """Return (G,) angles [rad], radii in [0, 1] and numbers of the tresses in which guides of roots (G, 3) run."""
    axis = unit(_TIE - _CENTER)
    across = unit(np.cross(axis, [0.0, 0.0, 1.0]))
    directions = unit(roots - _CENTER)
    angle = np.arctan2(directions @ np.cross(axis, across), directions @ across)
    order = angle.argsort().argsort() / len(roots)  # evenly in [0, 1)
    far = np.arccos(np.clip(directions @ axis, -1.0, 1.0))
    tress = np.minimum((3.0 * order).astype(int), 2)
    return 2.0 * np.pi * (3.0 * order - tress), far.argsort().argsort() / len(roots), tress


def _to_tie(skull, roots):
    """Return (G, _SCALP_STEPS, 3): from roots round the back of the head nearly to the tie, on both sides of the
    parting.
    """
    middle = np.array([_CENTER[0], -0.06])
    start, end = roots[:, :2] - middle, _TIE[:2] - middle
    side = np.where(roots[:, 0] > _BRAID_PARTING, 1.0, -1.0)
    # The angle from the back of the head to its left; the front is at both ends of its range.
    angle = np.arctan2(start[:, 0], start[:, 1])
    angle = np.where(angle * side < -0.5 * np.pi, angle + 2.0 * np.pi * side, angle)
    radius, end_angle, end_radius = np.linalg.norm(start, axis=1), np.arctan2(*end), np.linalg.norm(end)
    points = [roots]
    for i in range(1, _SCALP_STEPS):
        share = i / _SCALP_STEPS
        turned = angle + share * (end_angle - angle)
        wide = np.maximum(radius + share * (end_radius - radius), 0.9 * np.minimum(radius, 0.07) + 0.05 * share)
        level = roots[:, 2] + share**0.9 * (_TIE[2] - roots[:, 2])
        place = columns(middle[0] + wide * np.sin(turned), middle[1] + wide * np.cos(turned), level)
        points.append(_behind_ear(skull.lying(place, 0.004 + 0.010 * min(2.0 * share, 1.0))))
    guides = np.stack(points, axis=1)
    for _pass in range(2):
        guides[:, 1:-1] = 0.25 * guides[:, :-2] + 0.5 * guides[:, 1:-1] + 0.25 * guides[:, 2:]
        for i in range(1, _SCALP_STEPS):
            guides[:, i] = skull.clear(guides[:, i], 0.005 + 0.009 * min(2.0 * i / _SCALP_STEPS, 1.0))
    return guides


def _braided(turn, radius, tress):
    """Return (G, STEPS - _SCALP_STEPS, 3): three tresses along the course, then a loose end."""
    count = combing.STEPS - _SCALP_STEPS
    along = np.linspace(0.0, 1.0, len(_COURSE))
    fine = np.stack([np.interp(np.linspace(0.0, 1.0, 400), along, axis) for axis in _COURSE.T], axis=1)
    for _pass in range(2000):
        fine[1:-1] = 0.25 * fine[:-2] + 0.5 * fine[1:-1] + 0.25 * fine[2:]
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    places = np.linspace(0.0, arc[-1], count)
    course = np.stack([np.interp(places, arc, axis) for axis in fine.T], axis=1)
    tangent = unit(np.gradient(course, axis=0))
    outward = columns(0.75, np.linspace(-0.2, -1.0, count), 0.15)
    outward = unit(outward - np.einsum("pi,pi->p", outward, tangent)[:, None] * tangent)
    sideways = np.cross(tangent, outward)
    share = places / arc[-1]
    grown, loose = part(share, 0.0, 0.10), part(share, _BRAIDED - 0.03, _BRAIDED + 0.05)
    size = grown * (1.0 - 0.25 * share)
    phase = 2.0 * np.pi * (places[None, :] / _BRAID_PITCH + tress[:, None] / 3.0)
    swing = _BRAID_RADIUS * size * (1.0 - loose)
    # A tress is thinnest at the tie and where the braid ends, and spreads below.
    thick = _TRESS_RADIUS * (0.55 + 0.45 * size) * (1.0 - 0.35 * np.exp(-(((share - _BRAIDED) / 0.03) ** 2)))
    disc = np.sqrt(radius)[:, None] * thick * (1.0 + 0.25 * loose)
    x = swing * np.sin(phase) + disc * np.cos(turn)[:, None]
    y = _BRAID_FLATNESS * swing * np.sin(2.0 * phase) + disc * np.sin(turn)[:, None]
    return course + x[..., None] * sideways + y[..., None] * outward


# Parts.


def _placed(head_object, guide_count, seed=1):
    """Return (guide Curves, their roots (G, 3), normals (G, 3), random numbers)."""
    if _DENSITY_GROUP not in head_object.vertex_groups:
        _add_density(head_object)
    guides = api.distribute_guides(
        head_object, guide_count=guide_count, seed=seed, density_group=_DENSITY_GROUP, length=0.05
    )
    roots = combing.read(guides)[:, 0].astype(np.float64)
    _near, normals = Solid(head_object).nearest(roots)
    return guides, roots, normals, np.random.default_rng(seed)


def _add_density(head_object):
    """The vertex group of guides: as `scalp`, denser at the hairline."""
    places = np.array([vertex.co for vertex in head_object.data.vertices])
    above = head.above_hairline(places)
    weights = np.where(above > 0.0, 0.5 + 0.5 * np.exp(-above / 0.02), 0.0)
    group = head_object.vertex_groups.new(name=_DENSITY_GROUP)
    for vertex in np.flatnonzero(weights > 0.0):
        group.add([int(vertex)], float(weights[vertex]), "REPLACE")


def _long(head_object, longest, volume, is_lifted=False):
    """Return (points, guide Curves, roots) of hair to both sides of a parting, behind the ears, and down over the
    bust.
    """
    guides, roots, normals, rng = _placed(head_object, 460)
    skull, shoulders = Solid(head_object), Solid(bpy.data.objects["Bust"])
    above = np.sqrt(np.clip(head.above_hairline(roots) / 0.030, 0.0, 1.0))
    lengths = longest * (0.5 + 0.5 * above) * rng.uniform(0.88, 1.06, len(roots))
    side = np.where(roots[:, 0] > _PARTING, 1.0, -1.0)
    if is_lifted:  # no straight parting
        side = np.where(roots[:, 0] > _PARTING + rng.uniform(-0.02, 0.02, len(roots)), 1.0, -1.0)
    front = part(-roots[:, 1], 0.0, 0.12)
    crown = part(roots[:, 2], 0.79, 0.84)
    rise = 0.6 if is_lifted else 0.0
    sweep = columns(
        side * (0.35 + 0.45 * front), 0.15 + 0.16 * front**4, -0.45 + 0.45 * front + rise * (0.4 + 0.6 * crown)
    )
    around = columns(side * 0.12, 0.05 + 0.16 * front**4, -0.95)
    fall = columns(-side * 0.22, -0.12 * part(np.abs(roots[:, 0]), 0.02, 0.07), -1.0)
    slide = columns(0.0, np.where(roots[:, 1] > -0.02, 0.4, -0.4), 0.0)

    def aim(place, gone):
        reach = gone * lengths
        wanted = mixed(sweep, around, part(reach, 0.02, 0.08))
        return mixed(wanted, fall, part(reach, 0.07, 0.16))

    def clear(place, gone):
        place = skull.clear(place, 0.003 + (volume + 0.4 * volume * crown) * part(gone * lengths, 0.0, 0.05))
        place = _behind_ear(place)
        return shoulders.clear(place, 0.008, slide)

    start = (1.2 if is_lifted else 0.55) * normals + unit(sweep)
    # Strands between what falls in front of both shoulders, and behind them, would hang before the throat.
    is_front = (roots[:, 1] <= -0.02) & (not is_lifted)
    _keep_apart(guides, np.where(is_front, side, 0.0))
    return march(roots, start, lengths, aim, clear), guides, roots


def _behind_ear(places):
    """Places (N, 3) that are not where an ear is, but behind it or above."""
    inside, away = _in_ear(places)
    return places + inside[:, None] * (columns(np.sign(away[:, 0]) * 0.3, 1.0, 0.0) * _EAR[1])


def _over_ear(places):
    """Places (N, 3) that are not where an ear is, but outside of it."""
    inside, away = _in_ear(places)
    return places + inside[:, None] * (columns(np.sign(away[:, 0]), 0.0, 0.0) * _EAR[1])


def _in_ear(places):
    """Return (how far places (N, 3) are inside of an ear's ellipsoid (N,), their x (N, 1) from the middle)."""
    center = np.where(places[:, :1] >= 0.0, _EAR[0], _EAR[0] * [-1.0, 1.0, 1.0])
    return np.maximum(1.0 - np.linalg.norm((places - center) / _EAR[1], axis=1), 0.0), places[:, :1]


def _keep_apart(guides, parts):
    """Write the attribute `part` (G,) of guides: strands do not blend guides of different parts."""
    attribute = guides.attributes.new("part", "INT", "CURVE")
    attribute.data.foreach_set("value", np.asarray(parts, np.int32))


def _hair(guides, styles, look, strand_count, **settings):
    """Hair between guides on the scalp."""
    settings = {"density_group": "scalp", "radius": _COVERAGE / strand_count} | settings
    hair = api.interpolate_hair(guides, strand_count=strand_count, styles=styles, **settings)
    api.shade(hair, look, mode="energy")
    return hair


GROOMS = {"Pixie": pixie, "Bob": bob, "Long Wavy": long_wavy, "Curly": curly, "Coily": coily, "Braid": braid}
