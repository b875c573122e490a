# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct solver of strands as Cosserat rods: substeps of many strands, each a chain of segments.

A strand has points and segment frames [Kugelstadt16] with compliant constraints [Macklin16]. The system of equations of
a chain is block tridiagonal, and is solved directly [Deul18]. rod_solver.cpp and the files that it includes are
compiled for CPU and GPU: on a CPU, `LANES` strands share the lanes of vectors; on a GPU, each strand has a thread.

Arrays are (groups, rows, lanes) float32: a group has `lane_count` strands, and each row has one number for every strand
of the group, contiguously. `to_lanes` and `from_lanes` convert numbers of strands to these arrays and back.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ...errors import HairError
from ...kernels import kernel_cache, native_code, parallel
from ...kernels.checks import require_count

LANES = 16  # strands of a CPU thread: groups of 8 take a quarter longer, even with vectors of 8 numbers
GPU_LANES = 32  # strands with contiguous numbers in GPU memory: a warp
MOST_SEGMENTS = 64
LEAST_GROUPS = 8  # least number of groups for a thread
BLOCK = 32  # threads of a GPU block: few, because there are few strands with much work each

PREDICT, SOLVE, FINISH, AGAIN = 1, 2, 4, 8  # parts of a substep
WHOLE = PREDICT | SOLVE | FINISH

PLANE_ROWS = 8  # of a point: normal (3), offset n·c + r, displacement (3), friction
ROOT_ROWS = 14  # position (3) and rotation (4) at the start of an animation frame, then at its end
_KEPT_ROWS, _CONTACT_ROWS = 64, 8

wp.set_module_options({"enable_backward": False, "block_dim": BLOCK})

_CONSTANTS = {
    "WIDTH": LANES,
    "GROUP": GPU_LANES,
    "MOST": MOST_SEGMENTS,
    "STEPS": 8,  # most steps of Newton's method
    "PASSES": 4,  # most passes of contact
    "TURN": 2e-3,  # |Δθ|² of a step that ends the solve: the remaining error is half of it
    "DRAG_ALONG": 0.5,  # drag along a slender body / drag across it
    "AWAY": 1e-3,  # remaining mobility along the contact normal: zero would make the matrix singular
    "MOST_AWAY": 1e-2,  # the same for stiff points: a third of this value breaks short hair, more weakens friction
    "STIFF": 1e4,  # κ = h² / (b m l²) above which a point is stiff; κ of hair of 10 cm is some hundreds
    "CREEP": 1e-4,  # speed of points held by friction [m/s]
    "ROD_SHARE": 1.0,
    "CHANGE": 0.05,  # relative change of friction that requires another pass
    "INSIDE": 5e-3,  # tolerance of penetration and length, relative to a segment, without another solve
    "SWEEPS": 20,  # most sweeps of a repair
    "PINCHED": 0.02,  # largest strain of segments in strands that cannot be outside otherwise
    "LEAST_ANGLE": 0.05,  # least squared sine between two planes with a usable line of intersection
    "LEAST_INERTIA": 3e-6,  # of a frame, in h² (1 + τ / h) / compliance of its joint; rounding is visible below 1e-7
}


@wp.struct
class RodArrays:
    """All arrays of S strands of M segments for a substep, (groups, rows, lanes) float32 on one device."""

    # State.
    positions: wp.array3d[float]  # 3 (M + 1) rows [m]
    velocities: wp.array3d[float]  # 3 (M + 1) [m/s]
    frames: wp.array3d[float]  # 4 M, unit quaternions x, y, z, w: a segment lies along its z axis
    spins: wp.array3d[float]  # 3 M, angular velocities [1/s]
    multipliers: wp.array3d[float]  # 6 M, λ_b (3), λ_s (3) of each segment
    slips: wp.array3d[float]  # M + 1, sliding distance in the last substep [m], -1 without contact
    # Material and groom.
    lengths: wp.array3d[float]  # M [m]
    rests: wp.array3d[float]  # 4 M, half rest rotations of joints
    bend_compliances: wp.array3d[float]  # M, b / EI in units of the mean mass
    stretch_compliances: wp.array3d[float]  # M
    inverse_masses: wp.array3d[float]  # M + 1
    inertias: wp.array3d[float]  # M
    grooms: wp.array3d[float]  # 3 (M + 1), in the root's frame [m]
    groom_frames: wp.array3d[float]  # 4 M, in the root's frame
    drag_rates: wp.array3d[float]  # 3: of slow air [1/s], per speed across [1/m], and per cube root of speed
    pins: wp.array3d[float]  # 1: number of points after the root that follow the surface, if above `pinned`
    responses: wp.array3d[float]  # 2: damping time [s] and hold [1/s²]; below zero: those of the step
    # Surface.
    roots: wp.array3d[float]  # ROOT_ROWS
    # Between the stages of a substep.
    positions_before: wp.array3d[float]  # 3 (M + 1)
    predictions: wp.array3d[float]  # 3 (M + 1), positions without the rod's forces and contact
    frames_before: wp.array3d[float]  # 4 M
    mobilities: wp.array3d[float]  # M + 1
    # Counters.
    resets: wp.array3d[float]  # 1, number of resets of a strand to its groom
    solved_again: wp.array3d[float]  # 1, whether AGAIN has moved the strand in this substep


ROWS = {
    "positions": (0, 3),
    "velocities": (0, 3),
    "frames": (4, 0),
    "spins": (3, 0),
    "multipliers": (6, 0),
    "slips": (0, 1),
    "lengths": (1, 0),
    "rests": (4, 0),
    "bend_compliances": (1, 0),
    "stretch_compliances": (1, 0),
    "inverse_masses": (0, 1),
    "inertias": (1, 0),
    "grooms": (0, 3),
    "groom_frames": (4, 0),
    "drag_rates": None,
    "pins": None,
    "responses": None,
    "roots": None,
    "positions_before": (0, 3),
    "predictions": (0, 3),
    "frames_before": (4, 0),
    "mobilities": (0, 1),
    "resets": None,
    "solved_again": None,
}
_FIXED_ROWS = {"drag_rates": 3, "pins": 1, "responses": 2, "roots": ROOT_ROWS, "resets": 1, "solved_again": 1}


def row_count(name: str, segment_count: int) -> int:
    """Return the number of rows of an array of `RodArrays`."""
    rows = ROWS[name]
    return _FIXED_ROWS[name] if rows is None else rows[0] * segment_count + rows[1] * (segment_count + 1)


@dataclass(frozen=True)
class Surroundings:
    """External influences on points in a substep, all optional: (groups, rows per point × points, lanes) float32.

    planes: see `plane_row`; found_planes: planes after the solve, for AGAIN and FINISH; airs: velocity of the air
    [m/s], 3 rows per point; drags: factor of air drag, 1 row; accelerations: [m/s²], 3 rows.
    """

    planes: wp.array | None = None
    found_planes: wp.array | None = None
    airs: wp.array | None = None
    drags: wp.array | None = None
    accelerations: wp.array | None = None


EMPTY = Surroundings()
_SHARED = (  # fields of both `FrameSubsteps` and `Numbers`
    "count",
    "pinned",
    "carried",
    "damping_time",
    "twist_ratio",
    "hold",
    "hold_tip",
    "most_stretch",
)
_SURROUNDING_ROWS = {"planes": PLANE_ROWS, "found_planes": PLANE_ROWS, "airs": 3, "drags": 1, "accelerations": 3}


def plane_row(point: int, field: int) -> int:
    """Return the row of a field of a point's contact plane in the array of planes.

    field: 0 to 2 the unit normal n, zero for no plane; 3 the offset n·c + r [m], with a point c of the surface and the
    distance r to keep; 4 to 6 the displacement of the surface at c in this substep [m]; 7 the friction μ.
    """
    return PLANE_ROWS * point + field


@dataclass(frozen=True)
class FrameSubsteps:
    """Parameters of a frame's substeps that all strands share."""

    size: float  # h [s]
    count: int = 1  # of substeps in the frame
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)  # [m/s²]
    damping_time: float = 0.0  # [s]
    twist_ratio: float = 1.0  # compliance of twisting / compliance of bending
    hold: float = 0.0  # [1/s²]
    hold_tip: float = 1.0
    pinned: int = 0  # number of points after the root that follow the surface like the root
    most_stretch: float = 1.2  # length / rest length of a segment beyond which a strand breaks
    carried: float = 1.0  # (h / h of the last substep)²


@wp.struct
class Numbers:
    """A `FrameSubsteps` with a range of substeps, for kernels."""

    first: int
    end: int
    count: int
    pinned: int
    h: float
    carried: float
    gravity: wp.vec3
    damping_time: float
    twist_ratio: float
    hold: float
    hold_tip: float
    most_stretch: float


@wp.struct
class Around:
    """`Surroundings` for kernels, with empty arrays for missing ones."""

    planes: wp.array3d[float]
    found_planes: wp.array3d[float]
    airs: wp.array3d[float]
    drags: wp.array3d[float]
    accelerations: wp.array3d[float]


@wp.func_native(native_code.body(__file__, "rod_solver.cpp", **_CONSTANTS))
def advance_block(
    block: int,
    stages: int,
    first: int,
    end: int,
    step: Numbers,
    strands: RodArrays,
    around: Around,
    scratches: wp.array3d[float],
): ...


@wp.kernel
def _advance_blocks(
    stages: int, step: Numbers, strands: RodArrays, around: Around, scratches: wp.array3d[float], first_block: int
):
    advance_block(first_block + wp.tid(), stages, step.first, step.end, step, strands, around, scratches)


def lane_count(device: wp.DeviceLike) -> int:
    """Return the number of strands of a group on a device."""
    return LANES if wp.get_device(device).is_cpu else GPU_LANES


def to_lanes(values: np.ndarray, lanes: int) -> np.ndarray:
    """Return numbers of strands (S, …) as (groups, rows, lanes) float32, padded with the last strand."""
    rows = np.asarray(values, np.float32).reshape(len(values), -1)
    group_count = -(-len(rows) // lanes)
    padded = np.concatenate([rows, np.repeat(rows[-1:], group_count * lanes - len(rows), axis=0)])
    return np.ascontiguousarray(padded.reshape(group_count, lanes, -1).swapaxes(1, 2))


def from_lanes(rows: np.ndarray, strand_count: int) -> np.ndarray:
    """Return numbers (groups, rows, lanes) as (S, rows) float32."""
    return np.ascontiguousarray(rows.swapaxes(1, 2)).reshape(-1, rows.shape[1])[:strand_count]


def scratch(segment_count: int, group_count: int, device: wp.DeviceLike) -> wp.array:
    """Return working memory for `advance` on a GPU, where threads have too little local memory; empty on a CPU."""
    is_cpu = wp.get_device(device).is_cpu
    row_count = _KEPT_ROWS * segment_count + _CONTACT_ROWS * (segment_count + 1)
    shape = (0, 0, 0) if is_cpu else (group_count, row_count, GPU_LANES)
    return wp.empty(shape, dtype=float, device=device)


def advance(
    arrays: RodArrays,
    step: FrameSubsteps,
    scratch: wp.array,
    first: int = 0,
    end: int | None = None,
    stages: int = WHOLE,
    surroundings: Surroundings = EMPTY,
    block_dim: int = BLOCK,
) -> None:
    """Advance strands by substeps first … end - 1 of a frame's `step.count`; end: None for all remaining substeps.

    stages: PREDICT writes positions without the rod's forces, for which contact planes can then be found; SOLVE
    computes the final positions; AGAIN solves again for strands with a point inside one of `found_planes`, and this
    plane replaces the point's plane; FINISH moves out points inside the last planes, and computes velocities. Without
    planes, one launch runs all stages. Raises `HairError` if counts do not match.
    """
    numbers, around = kernel_inputs(arrays, step, scratch, first, end, surroundings)
    device, group_count = arrays.positions.device, len(arrays.positions)
    inputs = [stages_of(arrays, step, stages), numbers, arrays, around, scratch]
    if device.is_cpu:
        share_count = parallel.share_count(group_count, device, LEAST_GROUPS)
        parallel.launch_shares(_advance_blocks, group_count, inputs, [[] for _ in range(share_count)], device)
    else:
        inputs.append(0)
        kernel_cache.launch(_advance_blocks, group_count * GPU_LANES, inputs, device=device, block_dim=block_dim)


def stages_of(arrays: RodArrays, step: FrameSubsteps, stages: int) -> int:
    """Return the stages to run: if all segments are pinned, `stages` without SOLVE and AGAIN."""
    return stages & ~(SOLVE | AGAIN) if step.pinned == arrays.lengths.shape[1] else stages


def kernel_inputs(
    arrays: RodArrays, step: FrameSubsteps, scratch: wp.array, first: int, end: int | None, surroundings: Surroundings
) -> tuple[Numbers, Around]:
    """Return a step and its surroundings for kernels. Raises `HairError` if counts do not match."""
    end = step.count if end is None else end
    _check(arrays, step, scratch, surroundings)
    if first < 0 or end > step.count:
        raise HairError(f"Substeps {first} to {end} are not among {step.count}.")
    numbers = Numbers()
    numbers.first, numbers.end, numbers.h, numbers.gravity = first, end, step.size, wp.vec3(*step.gravity)
    for name in _SHARED:
        setattr(numbers, name, getattr(step, name))
    return numbers, around_of(surroundings)


def around_of(surroundings: Surroundings) -> Around:
    """Return surroundings for kernels."""
    around = Around()
    for name in _SURROUNDING_ROWS:
        if (array := getattr(surroundings, name)) is not None:
            setattr(around, name, array)
    return around


def _check(arrays, step, scratch, surroundings):
    """Raise `HairError` unless all arrays match."""
    group_count, segment_count = len(arrays.positions), arrays.lengths.shape[1]
    device = arrays.positions.device
    if not 1 <= segment_count <= MOST_SEGMENTS:
        raise HairError(f"Simulated strands need 2 to {MOST_SEGMENTS + 1} points, not {segment_count + 1}.")
    if not 0 <= step.pinned <= segment_count:
        raise HairError(f"Of strands of {segment_count} segments, {step.pinned} cannot be pinned.")
    if not (step.size > 0.0 and step.count >= 1):
        raise HairError(f"A substep of {step.size:g} s cannot be simulated.")
    expected = {name: row_count(name, segment_count) for name in ROWS}
    present = {name: getattr(arrays, name) for name in expected}
    for name, rows in _SURROUNDING_ROWS.items():
        array = getattr(surroundings, name)
        if array is not None:
            expected[name], present[name] = rows * (segment_count + 1), array
    if not device.is_cpu:
        expected["scratch"] = _KEPT_ROWS * segment_count + _CONTACT_ROWS * (segment_count + 1)
        present["scratch"] = scratch
    lanes = lane_count(device)
    for name, rows in expected.items():
        array = present[name]
        require_count(f"groups of {name}", array.shape[0], group_count)
        require_count(f"rows of {name}", array.shape[1], rows)
        require_count(f"lanes of {name}", array.shape[2], lanes)
        if not array.is_contiguous or array.device != device:
            raise HairError(f"{name} must be contiguous, on the device of the strands.")
