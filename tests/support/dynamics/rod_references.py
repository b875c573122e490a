# SPDX-License-Identifier: GPL-3.0-or-later
"""Elastic rods in equilibrium, by equations that are independent of the solver."""

import numpy as np
from scipy.integrate import solve_bvp, solve_ivp


def heavy_elastica(bending, weight, length, count):
    """Return (count, 3) points of a level clamped strand that bends under its weight [N/m]: EI θ'' = -w (L - s) cos
    θ.

    The first test of Romero et al., Physical validation of simulators in computer graphics, 2021.
    """
    load = weight * length**3 / bending
    guess = np.linspace(0.0, 1.0, 200), np.zeros((2, 200))
    for part in np.linspace(0.1, 1.0, 10):  # the last solution begins the next
        found = solve_bvp(
            lambda s, y, part=part: np.vstack([y[1], -part * load * (1.0 - s) * np.cos(y[0])]),
            lambda root, tip: np.array([root[0], tip[1]]),
            *guess,
            tol=1e-7,
            max_nodes=20_000,
        )
        assert found.status == 0, found.message
        guess = found.x, found.y
    fine = np.linspace(0.0, 1.0, 4001)
    angle = found.sol(fine)[0]
    places = [np.append(0.0, np.cumsum((f[1:] + f[:-1]) / 2.0) / 4000.0) for f in (np.cos(angle), -np.sin(angle))]
    at = np.linspace(0.0, 1.0, count)
    x, z = (length * np.interp(at, fine, place) for place in places)
    return np.stack([x, 0.0 * x, z], axis=-1)


def kirchhoff(bending, twisting, weight, length, curvature, frame, moment, count):
    """Return (count, 3) points of a curved rod under its weight [N/m], and the moment at its tip, which must be
    zero.

    curvature: (3,) natural, in the material frame [1/m]; frame: (3, 3) at the root, the third column along the rod;
    moment: (3,) at the root [N m]. Kirchhoff's equations: r' = d₃, D' = D [u]×, m' = -d₃ × n, u = K⁻¹ Dᵀ m + u₀.
    """
    stiffness = np.array([bending, bending, twisting])

    def slope(s, y):
        axes = y[3:12].reshape(3, 3)
        u = axes.T @ y[12:] / stiffness + curvature
        turning = np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])
        force = np.array([0.0, 0.0, -weight * (length - s)])
        return np.concatenate([axes[:, 2], (axes @ turning).ravel(), -np.cross(axes[:, 2], force)])

    start = np.concatenate([np.zeros(3), np.ravel(frame), moment])
    at = np.linspace(0.0, length, count)
    found = solve_ivp(slope, (0.0, length), start, rtol=1e-8, atol=1e-12, t_eval=at)
    return found.y[:3].T, found.y[12:, -1]
