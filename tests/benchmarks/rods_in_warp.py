# SPDX-License-Identifier: GPL-3.0-or-later
"""One Newton step of free rods in Warp's own vectors and matrices, with a strand per thread, as a reference for the
times of the solver's lanes. The algebra is that of rod_newton.h and rod_back.h, without damping and contact.
"""

import numpy as np
import warp as wp

from hair_addon.core.dynamics.rod import rod_solver

wp.set_module_options({"enable_backward": False})

mat66 = wp.types.matrix(shape=(6, 6), dtype=float)
vec6 = wp.types.vector(length=6, dtype=float)
_LEAST_INERTIA = wp.constant(3e-6)


@wp.func
def _bend(a: wp.quat, b: wp.quat, half: wp.quat):
    back = wp.quat_inverse(half)
    e = back * (wp.quat_inverse(a) * b) * back
    if e[3] < 0.0:
        e = -e
    return e


@wp.func
def _gradient(e: wp.quat, middle: wp.quat):
    turned = wp.transpose(wp.quat_to_matrix(middle))
    return (e[3] * wp.identity(n=3, dtype=float) - wp.skew(wp.vec3(e[0], e[1], e[2]))) * turned


@wp.func
def _put(into: mat66, row: int, column: int, part: wp.mat33):
    for r in range(3):
        for c in range(3):
            into[row + r, column + c] = part[r, c]
    return into


@wp.func
def _decomposed(matrix: mat66):
    """Return the lower triangle L with L Lᵀ = matrix; its diagonal is inverted."""
    lower = mat66()
    for r in range(6):
        for c in range(r + 1):
            total = matrix[r, c]
            for k in range(c):
                total -= lower[r, k] * lower[c, k]
            if r == c:
                lower[r, r] = 1.0 / wp.sqrt(total)
            else:
                lower[r, c] = total * lower[c, c]
    return lower


@wp.kernel
def _newton_step(
    h: float,
    twist_ratio: float,
    root_frames: wp.array[wp.quat],
    halves: wp.array2d[wp.quat],
    lengths: wp.array2d[float],
    bending: wp.array2d[float],
    stretching: wp.array2d[float],
    mobilities: wp.array2d[float],
    inertias: wp.array2d[float],
    multipliers: wp.array2d[vec6],
    # kept from root to tip
    lowers: wp.array2d[mat66],
    uppers: wp.array2d[mat66],
    rights: wp.array2d[vec6],
    gradients: wp.array2d[wp.mat33],
    turnings: wp.array2d[float],
    # outputs
    positions: wp.array2d[wp.vec3],
    frames: wp.array2d[wp.quat],
):
    strand = wp.tid()
    count = lengths.shape[1]
    per_square = 1.0 / (h * h)
    one = wp.identity(n=3, dtype=float)
    before = root_frames[strand]
    turning_before = float(0.0)
    upper = mat66()
    right = vec6()
    for j in range(count):
        frame = frames[strand, j]
        half = halves[strand, j]
        e = _bend(before, frame, half)
        G = _gradient(e, before * half)
        pull = multipliers[strand, j]
        moment = wp.length(wp.vec3(pull[0], pull[1], pull[2]))
        if j + 1 < count:
            after = multipliers[strand, j + 1]
            moment += wp.length(wp.vec3(after[0], after[1], after[2]))
        inertia = wp.max(inertias[strand, j], _LEAST_INERTIA * h * h / bending[strand, j])
        turning = 1.0 / (inertia + wp.length(wp.vec3(pull[3], pull[4], pull[5])) + 0.5 * moment)
        d = wp.quat_rotate(frame, wp.vec3(0.0, 0.0, 1.0))
        S = wp.skew(d)
        per_length = 1.0 / lengths[strand, j]
        stretch = (positions[strand, j + 1] - positions[strand, j]) * per_length - d
        bend = per_square * bending[strand, j]
        compliance = wp.diag(wp.vec3(bend, bend, bend * twist_ratio))
        moved = (mobilities[strand, j] + mobilities[strand, j + 1]) * per_length * per_length
        D = _put(mat66(), 0, 0, (turning_before + turning) * (G * wp.transpose(G)) + compliance)
        D = _put(D, 3, 0, wp.transpose(-turning * (G * S)))
        turned = turning * (wp.dot(d, d) * one - wp.outer(d, d))
        D = _put(D, 3, 3, (moved + per_square * stretching[strand, j]) * one + turned)
        R = vec6(-2.0 * e[0], -2.0 * e[1], -2.0 * e[2], -stretch[0], -stretch[1], -stretch[2])
        if j > 0:
            D -= wp.transpose(upper) * upper
            R -= wp.transpose(upper) * right
        lower = _decomposed(D)
        for r in range(6):
            total = R[r]
            for k in range(r):
                total -= lower[r, k] * R[k]
            R[r] = total * lower[r, r]
        right = R
        lowers[strand, j] = lower
        rights[strand, j] = right
        gradients[strand, j] = G
        turnings[strand, j] = turning
        if j + 1 < count:
            e_next = _bend(frame, frames[strand, j + 1], halves[strand, j + 1])
            G_next = wp.transpose(_gradient(e_next, frame * halves[strand, j + 1]))
            U = _put(mat66(), 0, 0, -turning * (G * G_next))
            U = _put(U, 3, 0, -turning * (S * G_next))
            coupled = -per_length / lengths[strand, j + 1] * mobilities[strand, j + 1]
            U = _put(U, 3, 3, coupled * one)
            for c in range(6):
                for r in range(6):
                    total = U[r, c]
                    for k in range(r):
                        total -= lower[r, k] * U[k, c]
                    U[r, c] = total * lower[r, r]
            upper = U
            uppers[strand, j] = upper
        before = frame
        turning_before = turning
    moment_after = wp.vec3()
    pull_after = wp.vec3()
    z = vec6()
    for step in range(count):
        j = count - 1 - step
        rest = rights[strand, j]
        if step > 0:
            rest -= uppers[strand, j] * z
        lower = lowers[strand, j]
        for back in range(6):
            r = 5 - back
            total = rest[r]
            for k in range(r + 1, 6):
                total -= lower[k, r] * z[k]
            z[r] = total * lower[r, r]
        shear = wp.vec3(z[3], z[4], z[5])
        moment_here = wp.transpose(gradients[strand, j]) * wp.vec3(z[0], z[1], z[2])
        frame = frames[strand, j]
        d = wp.quat_rotate(frame, wp.vec3(0.0, 0.0, 1.0))
        turn = 0.5 * turnings[strand, j] * (moment_here - wp.cross(d, shear) - moment_after)
        pulled = shear / lengths[strand, j]
        positions[strand, j + 1] += mobilities[strand, j + 1] * (pulled - pull_after)
        frames[strand, j] = wp.normalize(wp.quat(turn[0], turn[1], turn[2], 1.0) * frame)
        multipliers[strand, j] = z
        moment_after = moment_here
        pull_after = pulled


class NewtonStep:
    """A Newton step of the strands of some `Rods`, from their state after PREDICT, with fixed roots."""

    def __init__(self, rods, step):
        count, segments = rods.strand_count, rods.segment_count

        def laid(name, kind, width, of_each=segments):
            values = rods.read(name).reshape(count, of_each, width) if width > 1 else rods.read(name)
            return wp.array(np.ascontiguousarray(values), dtype=kind, device="cpu")

        roots = np.ascontiguousarray(rods.read("roots")[:, rod_solver.ROOT_ROWS - 4 :])
        self.positions = laid("positions", wp.vec3, 3, segments + 1)
        self.frames = laid("frames", wp.quat, 4)
        self._inputs = [step.size, step.twist_ratio, wp.array(roots, dtype=wp.quat, device="cpu")]
        self._inputs += [laid("rests", wp.quat, 4), laid("lengths", float, 1), laid("bend_compliances", float, 1)]
        self._inputs += [laid("stretch_compliances", float, 1), laid("mobilities", float, 1)]
        self._inputs += [laid("inertias", float, 1), laid("multipliers", vec6, 6)]
        self._kept = [
            wp.empty((count, segments), dtype=kind, device="cpu") for kind in (mat66, mat66, vec6, wp.mat33, float)
        ]

    def solve(self):
        """Take the step."""
        outputs = [*self._kept, self.positions, self.frames]
        wp.launch(_newton_step, len(self.positions), inputs=self._inputs, outputs=outputs, device="cpu")
