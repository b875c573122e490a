# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands with styles as arrays: on a head, on a ball, and straight ones on a plane."""

from copy import copy
from dataclasses import replace

import numpy as np

from hair_addon.core.grooming import following, groom, style_binding
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from tests.support.devices import DEVICE
from tests.support.meshes import HEAD, flat_grid, read_obj, subdivided_sphere


class Groom:
    """Hair without styles, to which `styled(*styles)` applies styles and returns points (S, P, 3)."""

    def __init__(self, mesh, guide_settings, hair_settings, device=DEVICE, axes=None, **ground):
        self.mesh, self.settings, self.device, self.axes, self.ground = mesh, hair_settings, device, axes, ground
        self.guides = groom.distribute_guides(mesh, guide_settings, device=device)
        self.binding = groom.bind_hair(mesh, self.guides, hair_settings, device=device, **ground)
        self.trees = style_binding.clump_trees(mesh, self.guides.roots, hair_settings, device=device, **ground)

    def rooted(self, roots):
        """Return the same groom with strands at other roots."""
        other = copy(self)
        other.binding = groom.bind_hair(
            self.mesh, self.guides, self.settings, roots=roots, device=self.device, **self.ground
        )
        other.trees = style_binding.clump_trees(
            self.mesh, self.guides.roots, self.settings, device=self.device, **self.ground
        )
        return other

    @property
    def plain(self):
        """Return (S, 41, 3): strands without styles."""
        return following.follow_guides(self.binding, self.guides).numpy()

    def bound(self, *styles, inputs=None, point_count=None, former=None):
        """Return the `Styling` of styles."""
        settings = self.settings if point_count is None else replace(self.settings, point_count=point_count)
        own = self.binding, self.guides, settings, styles, self.trees
        return style_binding.bind_styles(*own, inputs, self.axes, former=former)

    def styled(self, *styles, inputs=None, point_count=None, guides=None, chosen=None):
        """Return (S, P, 3), or (M, P, 3) of some strands."""
        guides = self.guides if guides is None else guides
        styling = self.bound(*styles, inputs=inputs, point_count=point_count)
        if styling is None:
            return following.follow_guides(self.binding, guides).numpy()
        followed = styling.guides(guides)
        if chosen is not None:
            return following.follow_some(self.binding, followed, chosen, styling=styling)[0]
        weights = following.weights_now(self.binding, followed)
        return following.strands_now(self.binding, followed, weights, styling).numpy()


def head(strand_count=1500, guide_count=120, device=DEVICE, seed=1, **hair):
    """Return long hair that hangs, on the sample head's upper half; seed: of guides."""
    mesh = read_obj(HEAD)
    height = mesh.vertices[:, 2]
    density = (height > np.quantile(height, 0.6)).astype(np.float32)
    guides = GuideSettings(guide_count=guide_count, length=0.2, gravity=0.7, seed=seed)
    return Groom(mesh, guides, HairSettings(strand_count=strand_count, radius=4e-5, **hair), device, density=density)


def beard(strand_count=800, device=DEVICE, seed=1):
    """Return short hair on the sample head's lower third."""
    mesh = read_obj(HEAD)
    height = mesh.vertices[:, 2]
    density = (height < np.quantile(height, 0.35)).astype(np.float32)
    guides = GuideSettings(guide_count=60, length=0.06, gravity=0.5, seed=seed)
    return Groom(mesh, guides, HairSettings(strand_count=strand_count, radius=4e-5), device, density=density)


def lawn(strand_count=800, device=DEVICE, seed=1):
    """Return strands on a square, each leaning another way."""
    guides = GuideSettings(guide_count=60, length=0.15, tilt=0.5, gravity=0.4, seed=seed)
    return Groom(flat_grid(8, 0.3), guides, HairSettings(strand_count=strand_count, radius=4e-5), device)


def straight(strand_count=400, length=0.2, size=0.1, device=DEVICE):
    """Return straight strands that stand on a square."""
    guides = GuideSettings(guide_count=40, length=length, length_variation=0.0, tilt=0.0, gravity=0.0)
    return Groom(flat_grid(8, size), guides, HairSettings(strand_count=strand_count, radius=4e-5), device)


def ball(strand_count=800, device=DEVICE, seed=1, size=0.5, **hair):
    """Return fur on a sphere; seed: of guides; size: its radius [m]."""
    guides = GuideSettings(guide_count=60, length=0.6 * size, gravity=0.5, seed=seed)
    return Groom(
        subdivided_sphere(3, size), guides, HairSettings(strand_count=strand_count, radius=1e-3, **hair), device
    )
