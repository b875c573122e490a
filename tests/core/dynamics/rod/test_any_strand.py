# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands of any size and material in violent motion stay finite, and regain their length at rest."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hair_addon.core.dynamics.rod.material import Material, material_of
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from tests.support.dynamics.rods import FRAME, Simulation

STRANDS = 24  # of an example


def mixed(materials):
    """Return one `Material` for strands with one material each; shared values are those of the first."""
    arrays = {
        name: np.concatenate([getattr(material, name) for material in materials])
        for name, value in vars(materials[0]).items()
        if isinstance(value, np.ndarray)
    }
    return replace(materials[0], **arrays)


@pytest.mark.gate(id="V14")
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


@pytest.mark.gate(id="V14")
@pytest.mark.parametrize("thickness", [1000.0, 3000.0, 10_000.0])
def test_strands_in_thick_air_stay_as_they_are(thickness):
    """Fibers of 2 µm stay at rest in air that makes their points much heavier within a substep.

    There frames turn much more easily than points move, and |d| = 1 in the matrix where d is a rounded direction would
    cost it its definiteness: most of these strands would break. G Gᵀ = 1 - e_v e_vᵀ would do no harm: its rounding,
    some 2e-7 of a frame's mobility, is a tenth of the least compliance that LEAST_INERTIA leaves beside it.
    """
    rng, vertex_count, size, damping, radius = np.random.default_rng(0), 65, FRAME / 2.0, 0.2, 2e-6
    segment = 0.05 / (vertex_count - 1)
    directions = 0.3 * rng.normal(size=(64, vertex_count - 1, 3)) / np.sqrt(3.0) + [1.0, 0.0, 0.0]
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    groom = np.concatenate([np.zeros((64, 1, 3)), segment * np.cumsum(directions, axis=1)], axis=1)
    # The stiffness at which the inertia of a frame is LEAST_INERTIA.
    modulus = 1300.0 * segment**4 / (9e-6 * size**2 * (1.0 + damping / size) * radius**2) * 1e-9
    fibre = DynamicsSettings(
        bend_stiffness=1.0, youngs_modulus=modulus, shear_modulus=modulus / 2.7, fibre_radius=radius, damping=damping
    )
    simulation = Simulation(groom, fibre, 2, (0.0, 0.0, 0.0), slow_drags=np.full(64, thickness / size))
    simulation.advance(24)
    assert not simulation.rods.reset_counts().any()
    assert abs(simulation.points - groom).max() < 1e-6
