# SPDX-License-Identifier: GPL-3.0-or-later
"""`Rods`: the state of simulated strands on a device, from a groom and a material.

The surface determines the position of each root and its rotation relative to the groom. The frame before segment 0 is
the frame of segment 0 in the groom, rotated with the surface: a strand leaves the surface at its combed angle.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import warp as wp

from ...errors import HairError
from ...kernels import kernel_cache
from ...kernels.checks import require_count
from . import rod_solver, rotations
from .material import Material
from .rod_solver import FrameSubsteps, RodArrays, Surroundings
from .settings import DynamicsSettings

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

# Arrays that a substep reads and that do not follow from groom, material and roots.
STATE = ("positions", "velocities", "frames", "spins", "multipliers", "slips", "roots", "resets")
_ROOT_END = wp.constant(rod_solver.ROOT_ROWS // 2)  # first row of a root's pose at the end of the frame
_NO_TURNS = np.zeros((0, 4))
_FARTHEST = 1e30  # [m]
MOST_STRETCH = 1.2  # length / rest length of a segment above which a strand is reset; larger for stretchable hair


@dataclass(frozen=True)
class RestShape:
    """The shape of strands without forces, and the multipliers of equilibrium in the groom; float64.

    lengths: (S, M) [m]; halves: (S, M, 4) half rest rotations of joints; frames: (S, M, 4) of segments in the groom;
    multipliers: (S, M, 6) in the groom, divided by h² [N m].
    """

    lengths: np.ndarray
    halves: np.ndarray
    frames: np.ndarray
    multipliers: np.ndarray


def combed_shape(groom: np.ndarray) -> RestShape:
    """Return the `RestShape` of strands (S, N, 3) [m] whose groom is their shape without forces: gravity bends them."""
    groom = np.asarray(groom, np.float64)
    frames = rotations.frames_along(groom)
    lengths = np.linalg.norm(np.diff(groom, axis=1), axis=2)
    return RestShape(lengths, half_rotations(frames), frames, np.zeros((*lengths.shape, 6)))


def half_rotations(frames: np.ndarray) -> np.ndarray:
    """Return half the rotation (S, M, 4) from the previous frame to each frame; the identity for the first frame."""
    before = np.concatenate([frames[:, :1], frames[:, :-1]], axis=1)
    return rotations.half(rotations.product(rotations.inverse(before), frames))


def step_of(
    settings: DynamicsSettings, material: Material, seconds: float, count: int, gravity: tuple[float, float, float]
) -> FrameSubsteps:
    """Return the `FrameSubsteps` of a frame; seconds: duration; count: of substeps; gravity: of the scene [m/s²]."""
    return FrameSubsteps(
        seconds / count,
        count,
        (settings.gravity * gravity[0], settings.gravity * gravity[1], settings.gravity * gravity[2]),
        material.damping_time,
        material.twist_ratio,
        settings.hold,
        settings.hold_tip,
        pinned_count(settings.pinned, material.lengths.shape[1]),
        MOST_STRETCH / settings.stretch_stiffness**0.5,
    )


def pinned_count(fraction: float, segment_count: int) -> int:
    """Return the number of points after the root that follow the surface, for a pinned fraction of a strand."""
    return int(fraction * segment_count)


class Rods:
    """S simulated strands of M segments, in the coordinates of groom and roots [m]."""

    def __init__(
        self, groom: np.ndarray, material: Material, rest: RestShape | None = None, device: wp.DeviceLike = None
    ) -> None:
        """Create strands at rest in their groom, (S, M+1, 3) [m]; rest: None for its `combed_shape`.

        Raises `HairError` for non-finite points, segments of zero length, and counts that do not match.
        """
        groom = np.asarray(groom, np.float64)
        if not np.isfinite(groom).all():
            raise HairError("Simulated strands have non-finite coordinates.")
        if groom.ndim != 3 or not len(groom):
            raise HairError("There are no strands to simulate.")
        self.device = wp.get_device(device)
        self.strand_count, self.segment_count = len(groom), groom.shape[1] - 1
        self.step_size = 0.0  # h of the last substep [s]
        rest = combed_shape(groom) if rest is None else rest
        self._root_frames = rest.frames[:, 0]  # in the groom, like the roots
        self._roots = groom[:, 0]
        self._start_turns, self._start = _NO_TURNS, self._doubles(_NO_TURNS)
        groups = -(-self.strand_count // self.lanes)
        self.arrays = RodArrays()
        for name in rod_solver.ROWS:
            shape = groups, rod_solver.row_count(name, self.segment_count), self.lanes
            setattr(self.arrays, name, wp.zeros(shape, dtype=float, device=self.device))
        self.scratch = rod_solver.scratch(self.segment_count, groups, self.device)
        self._mass_unit = 1.0  # [kg]
        self._held = rest.multipliers
        self.respond()
        self.set_material(material, rest)
        self.set_groom(groom, rest)
        self.reset()

    @property
    def lanes(self) -> int:
        """Number of strands of a group."""
        return rod_solver.lane_count(self.device)

    def set_material(self, material: Material, rest: RestShape) -> None:
        """Set the material and rest shape; the state is kept."""
        for name in ("lengths", "inertias", "bend_compliances", "stretch_compliances"):
            require_count(name, getattr(material, name).size, self.strand_count * self.segment_count)
        if not (np.isfinite(rest.lengths).all() and (rest.lengths > 0.0).all()):
            raise HairError("Simulated strands have segments without length.")
        # A unit near the mean mass avoids overflow in single precision. Powers of four, and their square roots in the
        # solver, are exact: no strand depends on the masses of other strands.
        unit = float(4.0 ** np.round(0.5 * np.log2(material.masses.mean())))
        self.arrays.multipliers.assign(self.arrays.multipliers.numpy() * np.float32(self._mass_unit / unit))
        self._mass_unit = unit
        self._put("lengths", rest.lengths)
        self._put("rests", rest.halves)
        self._put("bend_compliances", material.bend_compliances * unit)
        self._put("stretch_compliances", material.stretch_compliances * unit)
        self._put("inverse_masses", unit / material.masses)
        self._put("inertias", material.inertias / unit)
        drags = material.slow_drags, material.drag_squares, material.drag_roots
        self._put("drag_rates", np.stack(drags, axis=1))
        self._held = rest.multipliers

    def set_groom(self, groom: np.ndarray, rest: RestShape) -> None:
        """Set the groom (S, M+1, 3) [m], used by hold, pinned points and resets."""
        require_count("points", groom.size, self.strand_count * (self.segment_count + 1) * 3)
        back = rotations.inverse(rest.frames[:, :1])
        self._root_frames, self._roots = rest.frames[:, 0], np.asarray(groom, np.float64)[:, 0]
        self._frames_at_root = self._doubles(self._root_frames)
        self._put("grooms", rotations.rotated(back, groom - groom[:, :1]))
        self._put("groom_frames", rotations.product(back, rest.frames))

    def hold(self, fractions: np.ndarray, pinned: np.ndarray | None = None) -> None:
        """Let the first fraction (S,) of each strand, in [0, 1], only follow the surface.

        The held part is rigid up to there: one more segment is held, as the shape between vertices depends on both.
        pinned: (S,) `pinned_count` of each strand, None for the count of the step.
        """
        require_count("fractions", np.size(fractions), self.strand_count)
        if not (np.min(fractions) >= 0.0 and np.max(fractions) <= 1.0):
            raise HairError("The held fraction of simulated strands must be from 0 to 1.")
        pins = np.minimum(np.ceil(np.asarray(fractions) * self.segment_count) + 1.0, self.segment_count)
        pins = np.where(np.asarray(fractions) > 0.0, pins, 0.0)
        if pinned is not None:
            require_count("pinned counts", len(pinned), self.strand_count)
            pins = np.maximum(pins, pinned)
        self._put("pins", pins[:, None])

    def respond(self, damping_times: np.ndarray | None = None, holds: np.ndarray | None = None) -> None:
        """Give each strand its own damping time (S,) [s] and hold (S,) [1/s²]; None for the values of the step."""
        rows = []
        for values in (damping_times, holds):
            rows.append(np.full(self.strand_count, -1.0) if values is None else np.asarray(values, np.float64))
            require_count("responses", len(rows[-1]), self.strand_count)
        self._put("responses", np.stack(rows, axis=1))

    def reset(self, positions: np.ndarray | None = None, turns: np.ndarray | None = None) -> None:
        """Reset strands to rest in their groom; positions and turns: as in `move_roots`, None for the groom's own."""
        roots = self._root_rows(self._roots if positions is None else positions, turns)
        grooms, frames = (self.read(name) for name in ("grooms", "groom_frames"))
        places, root_frames = roots[:, None, :3], roots[:, None, 3:]
        shape = (self.strand_count, -1)
        points = places + rotations.rotated(root_frames, grooms.reshape(*shape, 3).astype(np.float64))
        self._put("positions", points)
        self._put("frames", rotations.product(root_frames, frames.reshape(*shape, 4).astype(np.float64)))
        self._put("roots", np.concatenate([roots, roots], axis=1))
        for name in ("velocities", "spins", "multipliers", "resets"):
            getattr(self.arrays, name).zero_()
        self.arrays.slips.fill_(-1.0)
        self.step_size = 0.0

    def move_roots(self, positions: np.ndarray, turns: np.ndarray | None = None) -> None:
        """Set the roots at the end of the next frame, which begins at the end of the last one.

        positions: (S, 3) [m]; turns: (S, 4) rotations x, y, z, w of the surface relative to the groom, None for no
        rotation.
        """
        require_count("coordinates of roots", np.size(positions), 3 * self.strand_count)
        positions, turns = np.reshape(positions, (-1, 3)), _NO_TURNS if turns is None else np.reshape(turns, (-1, 4))
        if len(turns):
            require_count("rotations of roots", len(turns), self.strand_count)
        squares = np.einsum("si,si->s", turns, turns)
        if not ((np.abs(positions) < _FARTHEST).all() and ((squares > 0.0) & (squares < np.inf)).all()):
            raise HairError("Roots of simulated strands have non-finite coordinates.")
        inputs = [self._doubles(positions), self._doubles(turns), self._start, self._frames_at_root]
        roots = self.arrays.roots
        kernel_cache.launch(_move_roots, (len(roots), self.lanes), inputs=inputs, outputs=[roots], device=self.device)

    def set_start(self, turns: np.ndarray) -> None:
        """Set the reference rotations (S, 4) of `move_roots` and `reset`: rotations of the surface in the groom."""
        require_count("numbers of rotations of roots", np.size(turns), 4 * self.strand_count)
        self._start_turns, self._start = turns, self._doubles(turns)

    def _doubles(self, rows):
        return wp.array(np.asarray(rows, np.float64), dtype=wp.float64, device=self.device)

    def in_lanes(self, values: np.ndarray, is_padded: bool = True) -> wp.array:
        """Return numbers (S, rows) as (groups, rows, lanes) float32 on the device.

        is_padded: True repeats the last strand in unused lanes, False fills unused lanes with zeros.
        """
        rows = rod_solver.to_lanes(np.asarray(values), self.lanes)
        if not is_padded:
            rows[-1, :, self.strand_count - (len(rows) - 1) * self.lanes :] = 0.0
        return wp.array(rows, dtype=float, device=self.device)

    def carried_groom(self) -> wp.array:
        """Return the groom (groups, 3 (M + 1), lanes) float32 [m] in the pose at the end of the frame."""
        grooms, roots = self.arrays.grooms, self.arrays.roots
        carried = wp.empty_like(grooms)
        shape = len(grooms), grooms.shape[1] // 3, self.lanes
        kernel_cache.launch(_carry_points, shape, inputs=[grooms, roots], outputs=[carried], device=self.device)
        return carried

    def carry(self, chosen: np.ndarray, turns: np.ndarray, pivots: np.ndarray, places: np.ndarray) -> None:
        """Move some strands rigidly, as after a jump of the surface: x becomes place + turn (x - pivot).

        chosen: (S,) bool; turns: (S, 4) rotations x, y, z, w; pivots, places: (S, 3) [m]. Velocities, and the roots at
        the start of the next frame, are transformed as well.
        """
        for count in (len(chosen), len(turns), len(pivots), len(places)):
            require_count("strands", count, self.strand_count)
        turns = rotations.unit(np.asarray(turns, np.float64))[:, None]
        if not (np.isfinite(turns).all() and np.isfinite(pivots).all() and np.isfinite(places).all()):
            raise HairError("Roots of simulated strands have non-finite coordinates.")

        def turned(name, of_each, change):
            rows = self.read(name)
            values = rows.reshape(self.strand_count, -1, of_each).astype(np.float64)
            carried = change(values).reshape(rows.shape)
            self._put(name, np.where(np.asarray(chosen)[:, None], carried, rows))

        def moved(points):
            return places[:, None] + rotations.rotated(turns, points - pivots[:, None])

        def roots_moved(halves):
            return np.concatenate([moved(halves[..., :3]), rotations.product(turns, halves[..., 3:])], axis=-1)

        def pulls_turned(multipliers):  # multipliers of joints are relative to their frames
            return np.concatenate([multipliers[..., :3], rotations.rotated(turns, multipliers[..., 3:])], axis=-1)

        turned("positions", 3, moved)
        turned("velocities", 3, lambda velocities: rotations.rotated(turns, velocities))
        turned("spins", 3, lambda spins: rotations.rotated(turns, spins))
        turned("frames", 4, lambda frames: rotations.product(turns, frames))
        turned("multipliers", 6, pulls_turned)
        turned("roots", 7, roots_moved)

    def advance(
        self,
        step: FrameSubsteps,
        first: int = 0,
        end: int | None = None,
        stages: int = rod_solver.WHOLE,
        surroundings: Surroundings = rod_solver.EMPTY,
        block_dim: int = rod_solver.BLOCK,
    ) -> None:
        """Simulate substeps of a frame; arguments as in `rod_solver.advance`."""
        step = self.begun(step)
        rod_solver.advance(self.arrays, step, self.scratch, first, end, stages, surroundings, block_dim)
        if stages & rod_solver.FINISH:
            self.step_size = step.size

    def begun(self, step: FrameSubsteps) -> FrameSubsteps:
        """Return a step that continues from the last step's duration; the first step also sets the multipliers."""
        if self.step_size == 0.0:  # the first step starts with the rest shape's multipliers of equilibrium
            self._put("multipliers", self._held * (step.size**2 / self._mass_unit))
            self.step_size = step.size
        return replace(step, carried=(step.size / self.step_size) ** 2)

    def positions(self) -> np.ndarray:
        """Return the positions (S, M+1, 3) float32 [m]."""
        return self.read("positions").reshape(self.strand_count, -1, 3)

    def velocities(self) -> np.ndarray:
        """Return the velocities (S, M+1, 3) float32 [m/s]."""
        return self.read("velocities").reshape(self.strand_count, -1, 3)

    def reset_counts(self) -> np.ndarray:
        """Return the number (S,) of times that each strand broke and was reset to its groom, since `reset`."""
        return self.read("resets")[:, 0].astype(int)

    def stretch(self) -> np.ndarray:
        """Return the strain (S, M) of segments: length / rest length - 1."""
        sizes = np.linalg.norm(np.diff(self.positions().astype(np.float64), axis=1), axis=2)
        return sizes / self.read("lengths") - 1.0

    def save(self) -> dict[str, np.ndarray]:
        """Return the state, without groom, material and settings: {name: (S, rows) float32}.

        After `load` the simulation continues bit-identically, on any device.
        """
        state = {name: self.read(name) for name in STATE}
        return state | {"step_size": np.array([self.step_size])}

    def load(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from a state of `save`. Raises `HairError` if the state does not match the strands."""
        for name in STATE:
            rows = np.asarray(state.get(name, ()))
            expected = self.strand_count, rod_solver.row_count(name, self.segment_count)
            if rows.shape != expected or rows.dtype != np.float32:
                raise HairError(f"The state of the simulation does not match: {name} is of other strands.")
        size = np.asarray(state.get("step_size", ()))
        if size.shape != (1,) or not (np.isfinite(size).all() and size[0] >= 0.0):
            raise HairError("The state of the simulation does not match: it has no size of a step.")
        for name in STATE:
            self._put(name, state[name])
        self.step_size = float(size[0])

    def read(self, name: str) -> np.ndarray:
        """Return an array of `RodArrays` as (S, rows) float32."""
        return rod_solver.from_lanes(getattr(self.arrays, name).numpy(), self.strand_count)

    def _put(self, name, values):
        getattr(self.arrays, name).assign(rod_solver.to_lanes(np.asarray(values), self.lanes))

    def _root_rows(self, positions, turns):
        require_count("roots", len(positions), self.strand_count)
        turned = self._root_frames
        if turns is not None:
            turns = np.asarray(turns)
            since = rotations.product(turns, rotations.inverse(self._start_turns)) if len(self._start_turns) else turns
            turned = rotations.product(since, turned)
        rows = np.concatenate([positions, rotations.unit(turned)], axis=1).astype(np.float32)
        if not np.isfinite(rows).all():
            raise HairError("Roots of simulated strands have non-finite coordinates.")
        return rows


@wp.func
def _product(a: wp.vec4d, b: wp.vec4d):
    """Same as `rotations.product`, bit by bit."""
    x = a[3] * b[0] + b[3] * a[0] + (a[1] * b[2] - a[2] * b[1])
    y = a[3] * b[1] + b[3] * a[1] + (a[2] * b[0] - a[0] * b[2])
    z = a[3] * b[2] + b[3] * a[2] + (a[0] * b[1] - a[1] * b[0])
    return wp.vec4d(x, y, z, a[3] * b[3] - (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]))


@wp.func
def _row(rows: wp.array2d[wp.float64], row: int):
    return wp.vec4d(rows[row, 0], rows[row, 1], rows[row, 2], rows[row, 3])


@wp.kernel
def _move_roots(
    positions: wp.array2d[wp.float64],
    turns: wp.array2d[wp.float64],
    start: wp.array2d[wp.float64],
    frames: wp.array2d[wp.float64],
    # outputs
    roots: wp.array3d[float],
):
    """Start the frame at the end of the last one; unused lanes repeat the last strand."""
    group, lane = wp.tid()
    strand = wp.min(group * roots.shape[2] + lane, positions.shape[0] - 1)
    for row in range(_ROOT_END):
        roots[group, row, lane] = roots[group, _ROOT_END + row, lane]
    frame = _row(frames, strand)
    if turns.shape[0] > 0:
        turn = _row(turns, strand)
        if start.shape[0] > 0:
            before = _row(start, strand)
            turn = _product(turn, wp.vec4d(-before[0], -before[1], -before[2], before[3]))
        frame = _product(turn, frame)
    square = frame[0] * frame[0] + frame[1] * frame[1] + frame[2] * frame[2] + frame[3] * frame[3]
    for axis in range(3):
        roots[group, _ROOT_END + axis, lane] = wp.float32(positions[strand, axis])
    for component in range(4):
        roots[group, _ROOT_END + 3 + component, lane] = wp.float32(frame[component] / wp.sqrt(square))


@wp.kernel
def _carry_points(
    grooms: wp.array3d[float],
    roots: wp.array3d[float],
    # outputs
    carried: wp.array3d[float],
):
    group, point, lane = wp.tid()
    at = 3 * point
    end = _ROOT_END
    place = wp.vec3(roots[group, end, lane], roots[group, end + 1, lane], roots[group, end + 2, lane])
    turn = wp.quat(
        roots[group, end + 3, lane],
        roots[group, end + 4, lane],
        roots[group, end + 5, lane],
        roots[group, end + 6, lane],
    )
    groom = wp.vec3(grooms[group, at, lane], grooms[group, at + 1, lane], grooms[group, at + 2, lane])
    there = place + wp.quat_rotate(turn, groom)
    for k in range(3):
        carried[group, at + k, lane] = there[k]
