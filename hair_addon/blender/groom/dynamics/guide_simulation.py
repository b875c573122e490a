# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulation of guides in a scene: it starts with their groom and advances frame by frame.

`begin` and `read` use Blender's data; `GuideSimulation.advance` does not, and may run in another thread.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from bpy.types import Curves, Depsgraph, Scene

from ....core import dynamics
from ....core.dynamics.rod.settings import DynamicsSettings
from ....core.errors import HairError
from ....core.files import frame_manifest
from ....core.geometry.affine import Affine
from ....core.params import given
from ...data import surface_space
from ...data.simulation import guide_poses, simulated_world, varied_dynamics, wet_guides
from ...data.simulation.guide_poses import GuidePose
from ...data.simulation.varied_dynamics import VariedDynamics
from ...data.strands import curves, gathered_groups
from ...data.surfaces import cage_of
from ...host import scene_time
from ...host.caches import Cache
from ...settings import preferences, properties
from .. import staleness
from ..guides import guide_regions

# session_uid of guides → ((G,) bend stiffness with which each holds its shape, `_load` of the settings used)
stiffness_cache = Cache()


@dataclass(frozen=True)
class FrameInput:
    """Input of the simulation in one frame. errors: of colliders that were left out or do not move.

    wetness: (G,) of each guide, None if it does not vary; varied: other settings that vary.
    """

    frame: int
    settings: DynamicsSettings
    pose: GuidePose
    world: "dynamics.simulation.World"
    seconds: float
    wetness: np.ndarray | None = None
    varied: VariedDynamics = field(default_factory=VariedDynamics)
    errors: tuple[HairError, ...] = ()


@dataclass
class GuideSimulation:
    """Simulated guides and their current frame.

    digest, topology: of guides and surface; identity: of both, as `_identity_of`; start: their pose in the first frame;
    start_space, space: `surface_space.applied` to guides in the first frame, and now; obstacles: {name: obstacle in its
    last valid state}; masks: {mask of wetness: (G,) its weights, or map of a setting: (G,) its factors}; wetness,
    varied: of the last frame, as in `FrameInput`.
    """

    digest: str
    topology: str
    identity: tuple[str, ...]
    settings: DynamicsSettings
    start: GuidePose
    start_space: Affine
    space: Affine
    roots: np.ndarray  # (G, 3) float32 at rest, local
    simulation: "dynamics.simulation.Simulation"
    meters: float  # per world unit
    obstacles: dict[str, "dynamics.simulation.Obstacle"] = field(default_factory=dict)
    parted_by: tuple[str, ...] = ()  # `guide_regions.parting_keys` when regions were read
    masks: dict[Any, np.ndarray] = field(default_factory=dict)
    wetness: np.ndarray | None = None
    varied: VariedDynamics = field(default_factory=VariedDynamics)
    errors: tuple[HairError, ...] = ()  # of colliders, in the last frame
    may_have_other_faces: bool = False  # whether obstacles may change topology in the next frame

    def see(self, frame: FrameInput) -> FrameInput:
        """Return the input of the next frame, in which colliders with a changed topology keep their former state.

        Call it for each frame in turn, even for frames that are not simulated.
        """
        if self.may_have_other_faces:
            self.may_have_other_faces = False
            others = dynamics.topology_changes.divided(frame.world.obstacles, self.obstacles)
            self.obstacles |= others
            self.simulation.renew_obstacles(others)
        obstacles, notes = dynamics.topology_changes.stopped(frame.world.obstacles, self.obstacles, frame.frame)
        self.obstacles = {obstacle.name: obstacle for obstacle in obstacles}
        return replace(frame, world=replace(frame.world, obstacles=obstacles), errors=(*frame.errors, *notes))

    def advance(self, frame: FrameInput) -> np.ndarray:
        """Simulate the next frame; returns (G, P, 3) float32 points at rest, in local coordinates."""
        frame = self.see(frame)
        self._change(frame)
        self.simulation.advance(self._root_pose(frame.pose), frame.world, frame.seconds)
        self.errors = (*frame.errors, *self.simulation.notes)
        points = frame.pose.to_rest(self.simulation.points())
        points[:, 0] = self.roots  # exact, because later stages compare roots
        return points

    def _change(self, frame):
        """Use the settings, the wetness and the varied settings of a frame."""
        are_same = _are_same(frame.wetness, self.wetness) and frame.varied.is_same(self.varied)
        if frame.settings != self.settings or not are_same:
            settings = in_meters(frame.settings, self.meters)
            self.simulation.change(settings, wetness=frame.wetness, varied=frame.varied.values(settings))
            self.settings, self.wetness, self.varied = frame.settings, frame.wetness, frame.varied

    def follow_parting(self, guides: Curves, depsgraph: Depsgraph) -> bool:
        """Update the regions of guides to the present parting; returns whether they changed. Raises `HairError`."""
        keys = guide_regions.parting_keys(guides)
        if keys == self.parted_by:
            return False
        is_other = self.simulation.divide(guide_regions.regions_of(guides, depsgraph))
        self.parted_by = keys
        return is_other

    def resume(self, state: Mapping[str, np.ndarray], frame: FrameInput) -> None:
        """Resume from a state that `save` returned in a frame; frame: as from `see`. Raises `HairError`."""
        self.obstacles = {obstacle.name: obstacle for obstacle in frame.world.obstacles}
        self._change(frame)
        self.simulation.load(state, self._root_pose(frame.pose), frame.world)

    def is_of(self, guides: Curves, settings: DynamicsSettings) -> bool:
        """Whether it simulates the present combed shape of guides, with the number of vertices of the settings."""
        return (
            self.topology == guides.vellus.topology
            and self.settings.vertex_count == settings.vertex_count
            and self.digest == staleness.guides_digest(guides)
        )

    def follow_applied(self, guides: Curves) -> Affine | None:
        """Continue in the present local coordinates after transforms were applied to the surface, or undone.

        Returns the change of local coordinates; None if the guides have changed in the world too. Strands, velocities
        and rest shapes are in world axes and do not change.
        """
        if self.identity != _identity_of(guides):
            return None
        since = surface_space.applied(guides) @ self.space.inverse
        self.space, self.may_have_other_faces = surface_space.applied(guides), True
        self.digest, self.topology = staleness.guides_digest(guides), guides.vellus.topology
        self.roots = combed_points(guides)[:, 0].copy()
        return since

    def has_other_space(self, guides: Curves) -> bool:
        """Whether a transform was applied to the surface since the last `follow_applied`."""
        return not np.array_equal(surface_space.applied(guides).matrix, self.space.matrix)

    def _root_pose(self, pose):
        """Return the `RootPose` of a pose in present coordinates, relative to the groom of the first frame."""
        change = self.space @ self.start_space.inverse
        if change.is_identity:
            return pose.root_pose(self.start)
        start = self.start.after(change)
        found = pose.root_pose(start)
        return replace(found, turns=dynamics.rod.rotations.product(found.turns, start.turn_to(self.start)))


def _identity_of(guides):
    """Return digests of guides and faces that applied transforms do not change; () without guides."""
    if not len(guides.curves):
        return ()
    parts = curves.even_local_points(guides), cage_of(guides.vellus.topology)
    return tuple(surface_space.known_as(guides, frame_manifest.digest(part)) for part in parts)


def _are_same(one, other):
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other)


def begin(guides: Curves, scene: Scene, depsgraph: Depsgraph) -> GuideSimulation:
    """Start a simulation of guides in the frame that a depsgraph was evaluated for. Raises `HairError`."""
    settings = simulated(properties.dynamics_of(guides.vellus))
    simulated_world.require_colliders(settings, depsgraph)
    masks: dict[Any, np.ndarray] = {}
    frame = read(guides, scene, depsgraph, settings, masks)
    pose, meters = frame.pose, simulated_world.meters_of(scene, settings)
    local = combed_points(guides)
    simulation = dynamics.simulation.Simulation(
        pose.groom(local),
        in_meters(settings, meters),
        pose.root_pose(pose),
        frame.world,
        preferences.device(),
        regions=guide_regions.regions_of(guides, depsgraph),
        wetness=frame.wetness,
        held=held_of(guides),
        varied=frame.varied.values(settings),
    )
    for _ in range(settings.preroll):
        simulation.advance(pose.root_pose(pose), frame.world, frame.seconds)
    digest, topology = staleness.guides_digest(guides), guides.vellus.topology
    _keep_stiffness(guides, frame, local)
    ids, space = _identity_of(guides), surface_space.applied(guides)
    begun = GuideSimulation(digest, topology, ids, settings, pose, space, space, local[:, 0].copy(), simulation, meters)
    begun.parted_by = guide_regions.parting_keys(guides)
    begun.masks, begun.wetness, begun.varied = masks, frame.wetness, frame.varied
    begun.see(frame)
    return begun


def held_of(guides: Curves) -> np.ndarray | None:
    """Return (G,) float32: the fraction of each guide's length up to its tie; None if none is gathered."""
    gathered = gathered_groups.read(guides)
    return None if gathered is None else gathered.held


def read(
    guides: Curves,
    scene: Scene,
    depsgraph: Depsgraph,
    settings: DynamicsSettings,
    masks: dict[Any, np.ndarray],
) -> FrameInput:
    """Return the `FrameInput` of guides in the frame that a depsgraph was evaluated for. Raises `HairError`.

    masks: as in `GuideSimulation`; missing ones are read and added.
    """
    pose = guide_poses.read(guides, depsgraph, simulated_world.meters_of(scene, settings))
    local = combed_points(guides)
    ways = local[:, 1] - local[:, 0]
    world, errors = simulated_world.read(scene, depsgraph, settings, pose, guides.surface, ways)
    seconds = settings.time_scale / scene_time.animation_rate(scene)
    wetness = wet_guides.of_guides(guides, pose.pose.surface, depsgraph, masks)
    varied = varied_dynamics.of_guides(guides, pose.pose.surface, masks)
    return FrameInput(scene_time.frame_of(scene), settings, pose, world, seconds, wetness, varied, tuple(errors))


def simulated(settings: DynamicsSettings) -> DynamicsSettings:
    """Return settings with those that affect only hair, not guides, at their defaults, for comparison."""
    return replace(settings, keeps_hair_outside=False)


def unkeyed(guides: Curves, settings: DynamicsSettings) -> dict[str, Any]:
    """Return {name: value} of the settings without keyframes or drivers."""
    keyed = properties.keyed_dynamics_of(guides.vellus)
    return {name: value for name, value in given(settings).items() if name not in keyed}


def needed_stiffness(guides: Curves, scene: Scene, depsgraph: Depsgraph) -> np.ndarray:
    """Return the (G,) bend stiffness with which each guide holds its shape, 0 if it hangs. Raises `HairError`."""
    settings = properties.dynamics_of(guides.vellus)
    return _keep_stiffness(guides, read(guides, scene, depsgraph, settings, {}), combed_points(guides))


def known_stiffness(guides: Curves, settings: DynamicsSettings) -> np.ndarray | None:
    """Return `needed_stiffness` from the start of the simulation, for the present settings; None if never simulated."""
    cached = stiffness_cache.get(guides.session_uid)
    if cached is None or len(cached[0]) != len(guides.curves):
        return None
    stiffness, ratio = cached
    return stiffness * (_load(settings) / ratio)


def _keep_stiffness(guides, frame, local):
    """Cache and return (G,) bend stiffnesses; frame: `FrameInput`; local: `combed_points`."""
    settings, pose = frame.settings, frame.pose
    groom = pose.groom(local)
    standing = pose.root_pose(pose).carried(groom - groom[:, :1])
    vertices = dynamics.rod.detail.vertices_of(standing, settings.vertex_count)
    lengths = np.linalg.norm(np.diff(vertices, axis=1), axis=2)
    stiffness = frame.varied.values(settings).get("bend_stiffness")
    material = dynamics.rod.material.material_of(settings, lengths, frame.wetness, stiffness)
    x, y, z = (settings.gravity * component for component in frame.world.gravity)
    factors = dynamics.rod.sag_free.least_stiffnesses(vertices, material, (x, y, z))
    needed = factors * settings.bend_stiffness
    stiffness_cache.keep(guides.session_uid, (needed, _load(settings)))
    return needed


def _load(settings):
    """Measure of the stiffness that the material needs, independent of its own stiffness."""
    one = replace(settings, bend_stiffness=1.0)
    return dynamics.rod.stiffness_advice.weight_ratio(one, 1.0, abs(settings.gravity)) or 1.0


def in_meters(settings: DynamicsSettings, meters: float) -> DynamicsSettings:
    """Convert settings with lengths in world units to meters."""
    return replace(
        settings, cell_size=meters * settings.cell_size, collision_distance=meters * settings.collision_distance
    )


def combed_points(guides: Curves) -> np.ndarray:
    """Return (G, POINT_COUNT, 3) float32: guides as combed, local coordinates at rest."""
    if not len(guides.curves):
        raise HairError('"{name}" has no guides to simulate.', name=guides.name)
    points = curves.even_local_points(guides)
    if not np.isfinite(points).all():
        raise HairError('"{name}" has non-finite coordinates: undo, or delete those guides.', name=guides.name)
    return points
