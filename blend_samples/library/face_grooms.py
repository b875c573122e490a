# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms of the sample's face, by code: beard and eyebrows. `GROOMS` has them by name, as in head_grooms.py."""

import bpy
import numpy as np

from blend_samples.heads import brows
from blend_samples.library import combing
from blend_samples.library.combing import Solid, columns, march, mixed, part
from hair_addon import api

_MOUTH = np.array([0.0, -0.150, 0.661])  # [m]: between the lips
_LIPS = np.array([0.029, 0.0125])  # [m]: half width and half height of what stays bare
_BEARD_COVERAGE, _BROW_COVERAGE = 1.1, 0.065  # [m]: radii of all strands


def beard(head_object, strand_count):
    """Return a full beard of some centimeters, with a moustache."""
    _paint(head_object, "beard", _beard_weights)
    guides = api.distribute_guides(head_object, guide_count=420, density_group="beard", length=0.03)
    roots = combing.read(guides)[:, 0].astype(np.float64)
    skull = Solid(head_object)
    _near, normals = skull.nearest(roots)
    rng = np.random.default_rng(1)
    side = np.sign(roots[:, 0])
    is_moustache = (roots[:, 2] > _MOUTH[2]) & (np.abs(roots[:, 0]) < 0.030)
    chin = part(-roots[:, 1], 0.08, 0.135) * part(0.68 - roots[:, 2], 0.0, 0.05)
    cheek = part(roots[:, 2], 0.655, 0.700)
    lengths = (0.017 + 0.027 * chin - 0.008 * cheek) * rng.uniform(0.85, 1.1, len(roots))
    lengths = np.where(is_moustache, 0.017 * rng.uniform(0.9, 1.1, len(roots)), lengths)
    height = np.where(is_moustache, 0.004, 0.006 + 0.006 * chin)
    over_lip = columns(1.1 * side * part(np.abs(roots[:, 0]), 0.0, 0.006), -0.12, -0.65)

    def aim(place, gone):
        down = columns(0.10 * side * (1.0 - gone), 0.10 - 0.25 * chin, -1.0)
        wanted = np.where(is_moustache[:, None], over_lip, down)
        return wanted + 0.5 * skull.toward(place, height * part(gone, 0.0, 0.5), 0.01)

    def clear(place, gone):
        return skull.clear(place, np.minimum(height, 0.0006 + 0.004 * gone))

    combing.write(guides, march(roots, 0.8 * normals + mixed(aim(roots, 0.0), over_lip, 0.3), lengths, aim, clear))
    styles = [
        api.Trim(random=0.35, seed=1),
        api.Clump(size=0.006, levels=1, amount=0.45, thickness=0.4, shape=0.5, stray=0.10, seed=2),
        api.Curl(radius=0.0013, pitch=0.012, coherence=0.4, vary=0.7, root=0.2, seed=3),
        api.Frizz(amplitude=0.0006, wavelength=0.012, stray=0.05, stray_gain=2.5, seed=4),
    ]
    hair = api.interpolate_hair(
        guides, strand_count=strand_count, density_group="beard", radius=_BEARD_COVERAGE / strand_count, styles=styles
    )
    api.shade(hair, "DARK_BROWN", mode="energy", roughness=0.35)
    return hair


def _beard_weights(places):
    """Return (V,) in [0, 1]: how much of a beard grows at places (V, 3) [m] of the head."""
    x, y, z = np.abs(places[:, 0]), places[:, 1], places[:, 2]
    # Its upper border, from the side: a sideburn before the ear, down along the cheek, and up to the moustache.
    upper = np.interp(y, [-0.150, -0.128, -0.110, -0.085, -0.066, -0.056], [0.682, 0.672, 0.668, 0.684, 0.712, 0.728])
    upper = np.where((x < 0.030) & (y < -0.120), 0.6825, upper)
    lower = np.interp(y, [-0.150, -0.110, -0.060, -0.045], [0.600, 0.607, 0.632, 0.655])
    soft = 0.006
    weights = part(upper - z, 0.0, soft) * part(z - lower, 0.0, 0.010) * part(-0.050 - y, 0.0, 0.008)
    in_lips = np.hypot(x / _LIPS[0], (z - _MOUTH[2]) / _LIPS[1])
    weights *= np.where(y < -0.11, part(in_lips, 1.0, 1.22), 1.0)
    return weights


def eyebrows(head_object, strand_count):
    """Full brows, whose hair rises at the nose and lies down outward."""
    if "Brows" in bpy.data.objects:
        for made in [o for o in bpy.data.objects if o.name.startswith("Brows")]:
            bpy.data.objects.remove(made)
    lines = brows.guides_on_skin(head_object)
    _paint(head_object, "brows", lambda places: _near(places, lines[:, 0]))
    drawn = bpy.data.objects.new("Guides", bpy.data.hair_curves.new("Guides"))
    drawn.data.add_curves([lines.shape[1]] * len(lines))
    bpy.context.scene.collection.objects.link(drawn)
    combing.write(drawn.data, lines)
    guides = api.use_as_guides(drawn, head_object)
    styles = [
        api.Trim(random=0.25, seed=1),
        api.Clump(size=0.003, levels=1, amount=0.3, thickness=0.4, seed=2),
        api.Frizz(amplitude=0.0003, wavelength=0.008, seed=3),
    ]
    hair = api.interpolate_hair(
        guides,
        strand_count=strand_count,
        density_group="brows",
        radius=_BROW_COVERAGE / strand_count,
        styles=styles,
        tip_taper=0.5,
        point_count=17,
    )
    api.shade(hair, "DARK_BROWN", mode="energy", roughness=0.35)
    return hair


def _near(places, roots):
    """Return (V,) in [0, 1]: 1 at places (V, 3) within half a millimeter of roots (G, 3), 0 beyond two."""
    weights = np.zeros(len(places))
    near = np.flatnonzero(
        (places > roots.min(axis=0) - 0.003).all(axis=1) & (places < roots.max(axis=0) + 0.003).all(axis=1)
    )
    distances = np.linalg.norm(places[near, None] - roots[None], axis=2).min(axis=1)
    weights[near] = 1.0 - part(distances, 0.0005, 0.002)
    return weights


def _paint(head_object, name, weights_of):
    """A vertex group of the weights that places have."""
    places = np.array([vertex.co for vertex in head_object.data.vertices])
    weights = weights_of(places)
    group = head_object.vertex_groups.new(name=name)
    for vertex in np.flatnonzero(weights > 0.0):
        group.add([int(vertex)], float(weights[vertex]), "REPLACE")


GROOMS = {"Beard": beard, "Eyebrows": eyebrows}
