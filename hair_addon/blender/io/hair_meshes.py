# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair → meshes for games: strands as arrays beside their surface, and tubes."""

from dataclasses import dataclass, replace

import numpy as np

from ...core.cards import bone_chains, tubes
from ...core.cards.polygon_mesh import PolygonMesh
from ...core.errors import HairError
from ...core.geometry.mesh import TriMesh
from ...core.long_work import Stage
from ...core.shading import appearance, strand_colors
from ...core.shading.appearance import Appearance
from ...core.shading.strand_looks import StrandLooks
from ..data import scene, whole_changes
from ..data.made import armature_weights, chain_armatures, made_meshes
from ..data.maps import strand_maps
from ..data.strands import curves, exported_curves
from ..host import scene_time
from ..host.datablocks import Remembered
from ..host.notices import name_of
from ..materials import card_material
from ..settings import properties
from . import modified_strands, strand_arrays


@dataclass(frozen=True)
class HairBeside:
    """Strands of length above zero in world axes around their surface's origin, in the scene's unit.

    points (S, P, 3), radii (S, P), randoms (S,); surface: the posed mesh in this space; to_local (3, 3): this space →
    the surface's local coordinates; notes: on omitted parts.
    """

    name: str
    surface_object: Remembered
    points: np.ndarray
    radii: np.ndarray
    randoms: np.ndarray
    look: Appearance
    surface: TriMesh
    to_local: np.ndarray
    looks: StrandLooks | None  # by maps
    notes: list[HairError]

    def colors(self) -> np.ndarray:
        """Linear RGB (S, P, 3)."""
        return strand_colors.colors(self.look, self.randoms, self.points.shape[1], self.looks)

    def roughness(self) -> np.ndarray | None:
        """Longitudinal roughness (S,) by a map, without random variation; None if it is that of the look."""
        if self.looks is None or (self.looks.roughness == 1.0).all():
            return None
        return np.clip(appearance.shaded(self.look).roughness * self.looks.roughness, 0.0, 1.0).astype(np.float32)

    def mean_look(self) -> Appearance:
        """Return the look with the mean roughness of the strands."""
        if self.looks is None:
            return self.look
        return replace(self.look, roughness=float(np.clip(self.look.roughness * self.looks.roughness.mean(), 0.0, 1.0)))

    def local(self, made: PolygonMesh) -> PolygonMesh:
        """Transform a mesh to the surface's local coordinates."""
        return made.transformed(self.to_local)

    def joints(self, settings) -> np.ndarray | None:
        """Joints (C, B + 1, 3) of the bone chains in `CardSettings` or `TubeSettings`, or None without them."""
        if not settings.chain_count:
            return None
        return bone_chains.chains(self.points, min(settings.chain_count, len(self.points)), settings.bone_count)


def read_hair(hair):
    """Return the `HairBeside` of hair Curves at the present time. Raises `HairError`."""
    surface_object = hair.surface
    if surface_object is None:
        raise HairError('"{name}" has no surface: attach it to a mesh.', name=name_of(hair))
    meters = strand_arrays.meters_per_unit(scene_time.present_scene())
    points = strand_arrays.shown_points(hair) / meters - np.array(surface_object.matrix_world.translation)
    if not np.isfinite(points).all():
        raise HairError('"{name}" has points with non-finite coordinates: regenerate the hair.', name=name_of(hair))
    shown = modified_strands.curves_of(hair) or hair
    radii = exported_curves.read_radii(shown, points.shape[1])(slice(None)) * (strand_arrays.world_scale(hair) / meters)
    is_hair = np.linalg.norm(np.diff(points, axis=1), axis=-1).sum(axis=1) > 1e-9
    if not is_hair.any():
        raise HairError('"{name}" has no strands.', name=name_of(hair))
    surface = scene.read_surface(surface_object, scene.present_depsgraph())
    looks = strand_maps.read_looks(hair)
    return HairBeside(
        name_of(hair),
        Remembered(surface_object),
        points[is_hair].astype(np.float32),
        radii[is_hair].astype(np.float32),
        curves.read_randoms(hair)[is_hair],
        properties.look_of(hair.vellus),
        surface.posed_mesh,
        surface.to_local_axes,
        None if looks is None else looks[is_hair],
        list(modified_strands.notes_of(hair)),
    )


def strand_count(hair):
    """Current number of strands of hair Curves, for panels."""
    return len(hair.curves)


@dataclass(frozen=True)
class MadeTubes:
    """Object of tubes, number of tubes and of triangles, and notes on omitted hair."""

    mesh_object: object
    tube_count: int
    triangle_count: int
    notes: list[HairError]


@whole_changes.whole
def making_tubes(hair, settings):
    """Make a mesh object of strands as tubes, as work in steps; returns `MadeTubes`. Raises `HairError`."""
    settings.require_size(strand_count(hair))
    yield Stage("Reading strands", 0.0)
    read = read_hair(hair)
    made, joints = yield lambda progress: _tubes(read, settings, progress)
    name = f"{read.name} Tubes"
    pieces = Pieces(read, name, joints)
    tube_count = settings.count_of(len(read.points))
    material = card_material.new_material(name, read.mean_look(), has_colors=made.colors is not None)
    mesh_object = pieces.new_object(name, made, material, tube_count, settings.side_count)
    return MadeTubes(mesh_object, tube_count, made.triangle_count, read.notes)


def _tubes(read, settings, progress):
    progress("Making tubes", 0.2)
    colors = None if read.looks is None else read.colors()
    return tubes.tubes(read.points, read.radii, settings, colors), read.joints(settings)


class Pieces:
    """A new collection of meshes of pieces, which follow the surface, its armature or new bone chains."""

    def __init__(self, read, name, joints):
        """joints: of the chains, or None."""
        self._read, self._surface_object = read, read.surface_object.find()
        self._collection, self._chains = made_meshes.new_collection(name, self._surface_object), None
        if joints is not None:
            self._chains = chain_armatures.new(read.name, joints, self._surface_object, read.surface, self._collection)

    def new_object(self, name, made, material, piece_count, vertices_across):
        """Return a new mesh object of a `PolygonMesh` of equal pieces, with as many vertices across at each place."""
        if self._chains is None:
            local = self._read.local(made)
            mesh_object = made_meshes.new_object(name, local, self._surface_object, self._collection, material)
            armature_weights.bind(mesh_object, self._surface_object, len(made.vertices) // piece_count)
            return mesh_object
        parent = self._chains.armature_object
        mesh_object = made_meshes.new_object(name, made, parent, self._collection, material)
        lines = made.vertices.reshape(piece_count, -1, vertices_across, 3).mean(axis=2)
        self._chains.bind(mesh_object, lines, vertices_across)
        return mesh_object
