# SPDX-License-Identifier: GPL-3.0-or-later
"""New sites are placed evenly between existing sites, where density allows."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.mesh import positions
from hair_addon.core.geometry.sampling import sample_surface
from hair_addon.core.placement.cvt import place
from hair_addon.core.placement.insertion import insert


def spacing(places, others=None):
    """Return (N,) distances from each place to the nearest other place, or to the nearest of others."""
    apart = np.linalg.norm(places[:, None] - (places if others is None else others)[None], axis=2)
    if others is None:
        np.fill_diagonal(apart, np.inf)
    return apart.min(axis=1)


def test_new_sites_keep_their_distance_as_if_all_were_placed_at_once(sphere):
    fixed = place(sphere, 100, 1, 12)
    new = insert(sphere, fixed, 300)
    assert len(new) == 300
    every = positions(sphere, fixed.joined(new))
    at_once = positions(sphere, place(sphere, 400, 1, 12))
    assert spacing(every).min() > 0.5 * spacing(at_once).min()
    assert spacing(every).mean() > 0.85 * spacing(at_once).mean()
    # Nor is any part of the surface left bare.
    samples = positions(sphere, sample_surface(sphere, 4000, 5))
    assert spacing(samples, every).max() < 1.6 * spacing(samples, at_once).max()


def test_new_sites_fill_what_is_bare(sphere):
    fixed = place(sphere, 60, 1, 12)
    fixed = fixed[positions(sphere, fixed)[:, 2] > 0.0]
    new = positions(sphere, insert(sphere, fixed, 30))
    assert np.count_nonzero(new[:, 2] < 0.0) > 22


def test_new_sites_are_where_the_density_is(sphere):
    fixed = place(sphere, 60, 1, 12)
    density = (sphere.vertices[:, 0] > 0.0).astype(np.float32)
    new = positions(sphere, insert(sphere, fixed, 40, density=density))
    assert len(new) == 40 and new[:, 0].min() > -0.2
    with pytest.raises(HairError, match="density is zero"):
        insert(sphere, fixed, 40, density=np.zeros(len(sphere.vertices), np.float32))


def test_new_sites_are_next_to_those_asked_for(sphere):
    fixed = place(sphere, 60, 1, 12)
    places = positions(sphere, fixed)
    around = places[:, 2] > 0.5
    new = positions(sphere, insert(sphere, fixed, 20, around=around))
    nearest = np.linalg.norm(new[:, None] - places[None], axis=2).argmin(axis=1)
    assert len(new) == 20 and np.count_nonzero(around[nearest]) >= 19  # relaxation may take one across the border


def test_the_same_call_gives_the_same_sites(sphere):
    fixed = place(sphere, 20, 1, 12)
    one, other = (insert(sphere, fixed, 30) for _ in range(2))
    assert one.is_same(other)


def test_no_site_and_no_room(sphere, square):
    fixed = place(sphere, 20, 1, 12)
    assert len(insert(sphere, fixed, 0)) == 0
    assert len(insert(sphere, fixed, 5, around=np.zeros(20, bool))) == 0
    assert len(insert(square, place(square, 1, 1, 12), 7)) == 7
