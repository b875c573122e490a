# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands of any size and material, thrown about: all stay finite, and have their length again when they rest."""

from dataclasses import replace

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hair_addon.core.dynamics.material import Material, material_of
from hair_addon.core.dynamics.settings import DynamicsSettings
from tests.support.rods import Simulation

STRANDS = 24  # of an example


def mixed(materials):
    """One `Material` of strands that have one each; what all share is of the first."""
    arrays = {
        name: np.concatenate([getattr(material, name) for material in materials])
        for name, value in vars(materials[0]).items()
        if isinstance(value, np.ndarray)
    }
    return replace(materials[0], **arrays)


@settings(max_examples=25, deadline=None)
@given(
    vertex_count=st.integers(3, 65),
    substeps=st.sampled_from([1, 2, 4, 8]),
    gravity=st.floats(-100.0, 100.0),
    damping=st.floats(0.0, 0.2),
    drag=st.floats(0.0, 100.0),
    kick=st.floats(0.0, 0.5),
    seed=st.integers(0, 2**32 - 1),
)
# Strong damping, where rounding shows first.
@example(vertex_count=16, substeps=8, gravity=0.0, damping=0.1875, drag=5.0, kick=0.5, seed=176)
def test_any_strand_settles(vertex_count, substeps, gravity, damping, drag, kick, seed):
    rng = np.random.default_rng(seed)
    lengths = 10.0 ** rng.uniform(-3.0, np.log10(2.0), STRANDS)
    directions = 0.7 * rng.normal(size=(STRANDS, vertex_count - 1, 3)) / np.sqrt(3.0) + [1.0, 0.0, 0.0]
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    segments = directions * lengths[:, None, None] / (vertex_count - 1)
    groom = np.concatenate([np.zeros((STRANDS, 1, 3)), np.cumsum(segments, axis=1)], axis=1)
    moduli, radii = 10.0 ** rng.uniform(-1.0, 3.0, STRANDS), 10.0 ** rng.uniform(-6.0, -3.0, STRANDS)
    sizes = np.linalg.norm(np.diff(groom, axis=1), axis=2)
    material: Material = mixed(
        [
            material_of(
                DynamicsSettings(
                    bend_stiffness=1.0,
                    youngs_modulus=modulus,
                    shear_modulus=modulus / 2.7,
                    fibre_radius=radius,
                    damping=damping,
                    air_drag=drag,
                ),
                sizes[[strand]],
            )
            for strand, (modulus, radius) in enumerate(zip(moduli, radii, strict=True))
        ]
    )
    simulation = Simulation(groom, substeps=substeps, gravity=(0.0, 0.0, gravity), **vars(material))
    simulation.step = replace(simulation.step, damping_time=damping, most_stretch=1e9)  # not put back: it must recover
    for _ in range(12):
        simulation.roots = rng.normal(scale=kick, size=(STRANDS, 3))
        simulation.advance()
    assert np.isfinite(simulation.points).all()
    simulation.roots = np.zeros((STRANDS, 3))  # where single precision resolves short segments
    simulation.advance(48)
    stretch = abs(simulation.rods.stretch()).max(axis=1)
    weight = abs(gravity) * 1300.0 * lengths / (moduli * 1e9)
    # Forces are sums over all points beyond, in single precision: seen where a strand would fall thousands of times its
    # segments in a substep.
    fall = abs(gravity) * simulation.step.size**2
    rounding = 2.0**-20 * vertex_count * fall / sizes.min(axis=1)
    assert not simulation.rods.reset_counts().any()
    assert (stretch <= 0.02 + 5.0 * weight + rounding).all(), (stretch.max(), lengths[stretch.argmax()])
