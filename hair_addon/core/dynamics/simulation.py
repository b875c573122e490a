# SPDX-License-Identifier: GPL-3.0-or-later
"""`Simulation`: guides that move with their surface, frame by frame.

Guides are simulated as strands with fewer points, `Rods`; the remaining detail of their shape is added to the result.
All coordinates are in meters, in axes that do not turn with the surface. The solver uses single precision, with an
origin near the hair. The origin follows the hair in steps that are exact in single precision.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
import warp as wp

from ..errors import HairError
from ..geometry.mesh import TriMesh
from ..kernels.checks import require_count
from . import root_motion
from .air import Air, ForceField
from .collision.colliders import Collider, Colliders
from .collision.contact import Contacts
from .collision.contact_substep import CollidingStrands
from .hair_volume import LEAST_CELL, HairVolume
from .rod import detail, rotations, sag_free
from .rod.material import material_of
from .rod.rod_solver import Surroundings, to_lanes
from .rod.rods import Rods, combed_shape, pinned_count, step_of
from .rod.settings import VARIED, DynamicsSettings
from .root_motion import RigidMotion, RootPose

MOST_SUBSTEPS = 64
_LONGEST_WAY = 0.01  # largest motion of roots and colliders in a substep [m]; shorter segments reduce this limit
_SHORTEST_WAY = 0.003  # least value of the reduced limit [m]: smaller values do not change the motion of short fur
_GRID = 0.125  # spacing of possible origins [m]
_LEAST_RUBBING = 0.01 - 1e-9  # least interval between evaluations of the hair volume [s]
_ASKED = 256  # sampled guides for the mean distance
_NOTHING: Mapping[str, np.ndarray] = MappingProxyType({})
_MOST_RESETS = 10  # number of consecutive frames with breakage after which a strand stays in its groom


@dataclass(frozen=True)
class Obstacle:
    """A mesh that hair collides with: vertices (V, 3) float64 [m], triangles (F, 3) int32, and values of `Collider`."""

    name: str
    vertices: np.ndarray
    triangles: np.ndarray
    friction: float = 0.3
    distance: float = 1e-3
    is_double_sided: bool = False

    def moved(self, motion: RigidMotion) -> "Obstacle":
        """Return the obstacle after a rigid motion."""
        return replace(self, vertices=motion.moved(self.vertices))

    def seen_from(self, origin: np.ndarray) -> Collider:
        """Return the `Collider` in coordinates relative to an origin."""
        mesh = TriMesh((self.vertices - origin).astype(np.float32), self.triangles)
        return Collider(self.name, mesh, self.friction, self.distance, self.is_double_sided)


@dataclass(frozen=True)
class World:
    """Environment of the hair at the end of a frame: gravity [m/s²], obstacles, force fields, time [s]."""

    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    obstacles: tuple[Obstacle, ...] = ()
    fields: tuple[ForceField, ...] = ()
    time: float = 0.0


class Simulation:
    """Simulated guides, which start as combed."""

    def __init__(
        self,
        groom: np.ndarray,
        settings: DynamicsSettings,
        pose: RootPose,
        world: World,
        device: wp.DeviceLike = None,
        *,
        regions: np.ndarray | None = None,
        wetness: np.ndarray | None = None,
        held: np.ndarray | None = None,
        varied: Mapping[str, np.ndarray] = _NOTHING,
    ) -> None:
        """groom: (G, P, 3) [m], combed guides on the surface at rest; pose: of the guides' roots in the first frame.

        regions: (G,) integers from 0; guides of different regions do not interact; None for one region. wetness: (G,)
        of each guide in [0, 1], None for the wetness of the settings. held: (G,) in [0, 1], the fraction of each
        guide's length, from the root, that only follows the surface, up to a tie; None for none. varied: {setting:
        (G,) of each guide} of settings in `VARIED` that differ between guides. Raises `HairError` for values outside of
        their range or counts that do not match.
        """
        self.settings, self.pose, self.world = settings, pose, world
        self.substeps = self.required_substeps = 0  # number in the last frame, and number that its motion requires
        self._device = wp.get_device(device)
        self._start, self._origin = pose, np.round(pose.positions.mean(axis=0) / _GRID) * _GRID
        self._scale = pose.scale
        self._groom = self._checked(groom)
        self._regions = self._checked_regions(regions)
        self._wetness = self._checked_wetness(wetness)
        self._held = np.zeros(len(groom)) if held is None else np.asarray(held, np.float64)
        self._varied = self._checked_varied(varied)
        combed = self._combed()
        vertices = detail.vertices_of(combed, settings.vertex_count)
        self._material, rest = self._shapes(vertices)
        self._rods = Rods(vertices, self._material, rest, self._device)
        self._rods.set_start(pose.turns)
        self._hold()
        self._detail = detail.detail_of(combed, self._rods)
        self._resets = np.zeros((2, len(groom)), int)  # total number, and number of consecutive frames with resets
        self._colliders = Colliders(self._device)
        self._read_obstacles(world.obstacles)
        self._contacts = Contacts(self._rods.arrays.positions, self._colliders)
        self._touching = CollidingStrands(self._rods, self._contacts)
        self._air = Air(self._rods.arrays.slips.shape, self._device)
        self._volume, self._waters = self._new_volume(), self._new_waters()
        self._since_rubbed = 0.0  # [s]

    def _hold(self):
        """Hold guides up to their ties if the settings ask for it, and give each guide its own damping and hold."""
        held = self._held if self.settings.holds_ties else np.zeros_like(self._held)
        self._rods.hold(held, self._pinned_counts())
        self._rods.respond(self._varied.get("damping"), self._varied.get("hold"))

    def _pinned_counts(self):
        """Return the number (G,) of pinned points of each guide; None if guides do not differ."""
        if "pinned" not in self._varied:
            return None
        count = self.settings.vertex_count - 1
        return np.array([pinned_count(fraction, count) for fraction in self._varied["pinned"]])

    def _new_volume(self):
        """Return the `HairVolume`, with cells as large as the spacing of guides."""
        masses = self._material.masses / self._material.masses.mean()
        cell = self.settings.cell_size or max(LEAST_CELL, _mean_distance(self._start.positions))
        regions = to_lanes(self._regions, self._rods.lanes)[:, 0]
        return HairVolume(self._rods.in_lanes(masses, is_padded=False), regions, cell)

    def _new_waters(self):
        """Return the wetness (groups, 1, lanes) of guides; None if all are dry."""
        count = len(self._groom)
        wetness = np.full(count, self.settings.wetness) if self._wetness is None else np.asarray(self._wetness)
        return self._rods.in_lanes(wetness[:, None]) if wetness.any() else None

    def _checked(self, groom):
        groom = np.asarray(groom, np.float64)
        if groom.ndim != 3 or not len(groom) or not np.isfinite(groom).all():
            raise HairError("Guides to simulate need points with finite coordinates.")
        require_count("roots", len(self._start.positions), len(groom))
        return groom - groom[:, :1]

    def _checked_wetness(self, wetness):
        if wetness is not None:
            require_count("wetness", len(wetness), len(self._groom))
            if not (np.isfinite(wetness).all() and np.min(wetness) >= 0.0 and np.max(wetness) <= 1.0):
                raise HairError("The wetness of guides must be from 0 to 1.")
        return wetness

    def _checked_varied(self, varied):
        for name, values in varied.items():
            require_count(f"values of {name}", len(values), len(self._groom))
            if not (np.min(values) >= VARIED[name].low and np.max(values) <= VARIED[name].high):
                low, high = VARIED[name].low, VARIED[name].high
                raise HairError(f"The {name} of guides must be from {low:g} to {high:g}.")
        return varied

    def _checked_regions(self, regions):
        count = len(self._groom)
        regions = np.zeros(count, np.int32) if regions is None else np.asarray(regions, np.int32)
        require_count("regions", regions.size, count)
        return regions

    def _combed(self):
        """Return the groom (G, P, 3) in the pose of the first frame at the present scale, relative to the origin."""
        return replace(self._start, scale=self._scale).carried(self._groom) - self._origin

    def _shapes(self, vertices):
        """Return (`Material`, `RestShape`) of vertices."""
        lengths = np.linalg.norm(np.diff(vertices, axis=1), axis=2)
        material = material_of(self.settings, lengths, self._wetness, self._varied.get("bend_stiffness"))
        if not self.settings.sag_free:
            return material, combed_shape(vertices)
        x, y, z = (self.settings.gravity * component for component in self.world.gravity)
        return material, sag_free.sag_free(vertices, material, (x, y, z)).rest

    def change(
        self,
        settings: DynamicsSettings,
        groom: np.ndarray | None = None,
        wetness: np.ndarray | None = None,
        varied: Mapping[str, np.ndarray] = _NOTHING,
    ) -> None:
        """Continue with other settings, wetness and groom, with the same number of vertices.

        groom: None for no change; wetness: (G,), None for that of the settings; varied: as in `__init__`. Raises
        `HairError` for another number of vertices.
        """
        varied = self._checked_varied(varied)
        wetness = self._checked_wetness(wetness)
        if settings.vertex_count != self.settings.vertex_count:
            raise HairError("A change of the number of points requires a new simulation: play from the start.")
        self.settings, self._wetness, self._varied = settings, wetness, varied
        if groom is not None:
            require_count("guides", len(groom), len(self._groom))
            self._groom = self._checked(groom)
        self._renew()

    def divide(self, regions: np.ndarray | None) -> bool:
        """Continue with other regions of guides, as in `__init__`; returns whether they differ."""
        regions = self._checked_regions(regions)
        is_other = not np.array_equal(regions, self._regions)
        if is_other:
            self._regions = regions
            self._volume = self._new_volume()
        return is_other

    def _renew(self):
        """Update the strands' material and shape from settings, groom and scale."""
        combed = self._combed()
        vertices = detail.vertices_of(combed, self.settings.vertex_count)
        self._material, rest = self._shapes(vertices)
        at_rest = Rods(vertices, self._material, rest, self._device)
        self._detail = detail.detail_of(combed, at_rest)
        self._rods.set_material(self._material, rest)
        self._rods.set_groom(vertices, rest)
        self._hold()
        self._volume, self._waters = self._new_volume(), self._new_waters()

    def advance(self, pose: RootPose, world: World, seconds: float) -> None:
        """Simulate a frame of a duration [s]; pose and world: at the end of the frame.

        Raises `HairError` for invalid input; the simulation is then unchanged.
        """
        require_count("roots", len(pose.positions), len(self._groom))
        if not math.isfinite(seconds) or seconds < 0.0:
            raise HairError("Time does not advance: set the frame rate and the time scale.")
        if seconds == 0.0:
            return
        before = self._carried_along(self.pose, pose)
        self.pose, self.world = pose, world
        if pose.scale != self._scale:
            self._scale = pose.scale
            self._renew()
        self._rods.move_roots(pose.positions - self._origin, pose.turns)
        self._read_obstacles(world.obstacles)
        self.required_substeps = self._substep_count(before, pose)
        count = self.required_substeps if self.settings.automatic_substeps else self.settings.substeps
        step = step_of(self.settings, self._material, seconds, count, world.gravity)
        pinned = self._pinned_counts()
        step = step if pinned is None else replace(step, pinned=int(pinned.min()))
        if self._is_free:
            self._rods.advance(step)
        elif self._colliders.is_still and not world.fields and not self._is_rubbing:
            self._touching.advance(step, 0, count, Surroundings())
            self._since_rubbed += seconds
        else:
            if self._is_rubbing:
                self._volume.fit(self._rods.arrays.positions, self._rods.carried_groom())
            fields = [self._seen(field) for field in world.fields]
            end = 0
            while end < count:
                first, end = end, end + 1 if fields else self._end_of_run(step, end)
                self._advance(step, first, end, fields, world.time - seconds * (1.0 - first / count))
        self.substeps = count
        self._put_back_broken()

    @property
    def _is_free(self):
        """Whether only the surface's motion, gravity and still air act on strands."""
        return self._colliders.mesh is None and not self.world.fields and not self._is_rubbing

    @property
    def _is_rubbing(self):
        settings = self.settings
        return settings.hair_friction > 0.0 or settings.hair_pressure > 0.0

    def _end_of_run(self, step, first):
        """Return the substep at which the hair volume is evaluated next, or the end of the frame."""
        if not self._is_rubbing:
            return step.count
        since, end = self._since_rubbed, first
        while end < step.count and (end == first or since < _LEAST_RUBBING):
            since, end = since + step.size, end + 1
        return end

    def _advance(self, step, first, end, fields, time):
        rods, around = self._rods, Surroundings()
        state = rods.arrays.positions, rods.arrays.velocities
        if fields:
            self._air.blow(fields, *state, time)
            around = Surroundings(airs=self._air.airs, drags=self._air.drags, accelerations=self._air.accelerations)
        if self._colliders.mesh is None:
            rods.advance(step, first, end, surroundings=around)
        else:
            self._touching.advance(step, first, end, around)
        for _ in range(first, end):
            self._since_rubbed += step.size
        if self._is_rubbing and self._since_rubbed >= _LEAST_RUBBING:
            settings = self.settings
            values = settings.hair_friction, settings.hair_pressure, self._waters
            self._volume.rub(*state, self._since_rubbed, *values)
            self._since_rubbed = 0.0

    def _seen(self, field):
        """Return a force field relative to the origin, with its strength scaled by the settings."""
        x, y, z = np.asarray(field.origin) - self._origin
        return replace(field, origin=(x, y, z), strength=self.settings.force_fields * field.strength)

    def _carried_along(self, before, after):
        """Apply the surface's motion that moves strands rigidly; returns the start pose of the remaining motion."""
        origin = np.round(after.positions.mean(axis=0) / _GRID) * _GRID
        shared = None
        if self.settings.inertia < 1.0:
            shared = root_motion.rigid_motion(before, after).part(1.0 - self.settings.inertia)
            before = before.moved(shared)
            self._carry(shared)
        jumping = np.flatnonzero(root_motion.jumps(before, after, self.settings.teleport_distance))
        if len(jumping):
            self._carry(root_motion.jump_of(before, after, jumping), jumping)
            before = before.with_rows(jumping, after)
        if (origin != self._origin).any():
            self._carry(RigidMotion(rotations.IDENTITY, np.zeros(3), self._origin - origin))
        if shared or len(jumping) or (origin != self._origin).any():
            self._origin = origin
            obstacles = self.world.obstacles
            self._read_obstacles([one.moved(shared) for one in obstacles] if shared else obstacles)
            self._contacts.forget()
        return before

    def _carry(self, motion, chosen=None):
        """Move strands rigidly; chosen: (M,) indices of strands with one motion each, None for all strands."""
        count = len(self._groom)
        rows = np.arange(count) if chosen is None else chosen
        is_chosen = np.zeros(count, bool)
        is_chosen[rows] = True
        turns, pivots, places = np.tile(rotations.IDENTITY, (count, 1)), np.zeros((count, 3)), np.zeros((count, 3))
        turns[rows], pivots[rows] = motion.rotation, motion.center - self._origin
        places[rows] = motion.center + motion.way - self._origin
        self._rods.carry(is_chosen, turns, pivots, places)

    def renew_obstacles(self, others: Mapping[str, Obstacle]) -> None:
        """Replace obstacles of the last frame by obstacles in the same pose with other faces.

        others: {name: obstacle}.
        """
        if others:
            self.world = replace(self.world, obstacles=tuple(others.get(one.name, one) for one in self.world.obstacles))
            self._read_obstacles([one for one in self.world.obstacles if one.name not in others])
            self._read_obstacles(self.world.obstacles)
            self._contacts.forget()

    def _read_obstacles(self, obstacles):
        self._colliders.read([obstacle.seen_from(self._origin) for obstacle in obstacles])

    def _substep_count(self, before, after):
        """Return the number of substeps that the motion in the next frame requires."""
        way = max(float(root_motion.ways(before, after).max()), self._colliders.largest_motion)
        longest = min(_LONGEST_WAY, max(float(self._material.lengths.mean()), _SHORTEST_WAY))
        return min(max(math.ceil(way / longest), self.settings.substeps), MOST_SUBSTEPS)

    def _put_back_broken(self):
        """Count the strands that broke in this frame; after `_MOST_RESETS` frames they stay in their groom."""
        counts = self._rods.reset_counts()
        self._resets[1] = np.where(counts > self._resets[0], self._resets[1] + 1, self._resets[1] * self._is_out)
        self._resets[0] = counts

    @property
    def _is_out(self):
        return self._resets[1] >= _MOST_RESETS

    @property
    def broken(self) -> np.ndarray:
        """Indices of strands that broke in the last frame and were reset to their groom."""
        return np.flatnonzero(self._resets[1])

    @property
    def notes(self) -> list[HairError]:
        """Colliders that were ignored in the last frame, with reasons."""
        return self._colliders.notes

    def points(self) -> np.ndarray:
        """Return the points (G, P, 3) float64 [m] of guides."""
        points = detail.detailed_points(self._detail, self._rods).numpy() + self._origin
        if self._is_out.any():
            points[self._is_out] = self.pose.carried(self._groom)[self._is_out]
        return points

    def vertices(self) -> np.ndarray:
        """Return the simulated points (G, vertex_count, 3) float64 [m] of guides."""
        return self._rods.positions() + self._origin

    def stretch(self) -> np.ndarray:
        """Return the strain (G, M) of the simulated segments: length / rest length - 1."""
        return self._rods.stretch()

    def save(self) -> dict[str, np.ndarray]:
        """Return the state from which the simulation can continue, {name: array}, without inputs of `__init__`."""
        rods = {f"rods_{name}": array for name, array in self._rods.save().items()}
        contacts = {f"contacts_{name}": array for name, array in self._contacts.state().items()}
        own = {"origin": self._origin, "resets": self._resets, "since_rubbed": np.array([self._since_rubbed])}
        return rods | contacts | own

    def load(self, state: Mapping[str, np.ndarray], pose: RootPose, world: World) -> None:
        """Continue from a state of `save`; pose and world: in the frame of this state. Raises `HairError`."""
        origin, resets, rubbed = (np.asarray(state.get(name, ())) for name in ("origin", "resets", "since_rubbed"))
        is_finite = all(np.isfinite(array).all() for array in (origin, rubbed))
        if not is_finite or (origin.shape, resets.shape, rubbed.shape) != ((3,), self._resets.shape, (1,)):
            raise HairError("The state of the simulation is of other guides.")
        self._since_rubbed = float(rubbed[0])
        self._rods.load(_of_part(state, "rods_"))
        self.pose, self.world = pose, world
        self._origin, self._resets = origin.astype(np.float64), resets.astype(int)
        if pose.scale != self._scale:
            self._scale = pose.scale
            self._renew()
        self._read_obstacles(world.obstacles)
        self._contacts.load(_of_part(state, "contacts_"))


def _mean_distance(places):
    """Return the mean distance between nearest neighbors of places (G, 3), from samples; 0 for a single place."""
    if len(places) < 2:
        return 0.0
    some = places[:: max(len(places) // _ASKED, 1)]
    distances = np.linalg.norm(some[:, None] - places, axis=2)
    distances[distances == 0.0] = np.inf  # the place itself, or a coincident place
    nearest = distances.min(axis=1)
    return float(nearest[np.isfinite(nearest)].mean()) if np.isfinite(nearest).any() else 0.0


def _of_part(state, prefix):
    return {name.removeprefix(prefix): array for name, array in state.items() if name.startswith(prefix)}
