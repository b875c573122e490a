# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of hair cards, tubes and locks as arrays, with the colors and the alpha of their materials."""

from dataclasses import dataclass

import numpy as np

from ....core import maps
from ....core.errors import HairError
from ....core.geometry.mesh import SurfacePoints
from ...host.notices import name_of
from .. import scene
from ..maps import image_pixels
from . import root_colors

_SHADERS = {"BSDF_PRINCIPLED": "Base Color", "BSDF_DIFFUSE": "Color", "BSDF_HAIR_PRINCIPLED": "Color"}


@dataclass(frozen=True)
class _Material:
    """The linear RGBA color and the alpha of a material, and the images that replace them.

    color_image, alpha_image: {UDIM tile, or None: (H, W, C) pixels} of `image_pixels.read`; alpha_channel: of
    alpha_image.
    """

    color: np.ndarray | None = None
    color_image: dict | None = None
    alpha: float = 1.0
    alpha_image: dict | None = None
    alpha_channel: int = 3


@dataclass(frozen=True)
class HairPieces:
    """An evaluated mesh of hair in the local coordinates of its object.

    vertices (V, 3) float32; triangles (F, 3) int32; corner_uvs: (F, 3, 2), None without a UV map; corner_colors:
    (F, 3, 4) linear, None without a color attribute; materials: `_Material` of each slot; slots: (F,).
    """

    vertices: np.ndarray
    triangles: np.ndarray
    corner_uvs: np.ndarray | None
    corner_colors: np.ndarray | None
    materials: list[_Material]
    slots: np.ndarray

    @property
    def has_colors(self) -> bool:
        """Whether all pieces have a color."""
        used = [self.materials[slot] for slot in np.unique(self.slots)]
        has_own = self.corner_colors is not None
        return has_own or all(one.color_image is not None or one.color is not None for one in used)

    @property
    def has_alpha(self) -> bool:
        """Whether a material may be transparent."""
        used = (self.materials[slot] for slot in np.unique(self.slots))
        return any(one.alpha < 1.0 or one.alpha_image is not None for one in used)

    def alphas(self, places: SurfacePoints) -> np.ndarray:
        """Return the alpha (N,) float64 at places on the mesh."""
        uvs, slots = self._uvs(places), self.slots[places.triangle]
        found = np.empty(len(places))
        for slot in np.unique(slots):
            rows = np.flatnonzero(slots == slot)
            found[rows] = _alphas(self.materials[slot], None if uvs is None else uvs[rows], len(rows))
        return found

    def _uvs(self, places):
        """Return (N, 2) UV coordinates of places, None without a UV map."""
        if self.corner_uvs is None:
            return None
        return np.einsum("nc,ncu->nu", places.barycentric.astype(np.float64), self.corner_uvs[places.triangle])

    def colors(self, places: SurfacePoints) -> np.ndarray:
        """Return (N, 4) float64 at places on the mesh: linear colors multiplied by alpha, and alpha."""
        found = np.ones((len(places), 4))
        weights, slots = places.barycentric.astype(np.float64), self.slots[places.triangle]
        uvs = self._uvs(places)
        for slot in np.unique(slots):
            rows, material = np.flatnonzero(slots == slot), self.materials[slot]
            color = np.ones((len(rows), 3))
            alpha = _alphas(material, None if uvs is None else uvs[rows], len(rows))
            if uvs is not None and material.color_image is not None:
                color = maps.pixels.unpremultiplied(_sampled(material.color_image, uvs[rows]))[0]
            elif self.corner_colors is not None:
                corners = self.corner_colors[places.triangle[rows], :, :3]
                color = np.einsum("nc,ncv->nv", weights[rows], corners)
            elif material.color is not None:
                color[:] = material.color[:3]
            found[rows, :3], found[rows, 3] = color * alpha[:, None], alpha
        return found


def _alphas(material, uvs, count):
    """Return the alpha (count,) of a material at UVs (count, 2), or None."""
    alpha = np.full(count, material.alpha)
    if uvs is not None and material.alpha_image is not None:
        alpha *= _sampled(material.alpha_image, uvs)[:, material.alpha_channel]
    return alpha


def _sampled(tiles, uvs):
    """Return (N, C) float64 of {UDIM tile, or None: (H, W, C) pixels} at UVs (N, 2); zero where there is no tile."""
    uvs = np.where(np.isfinite(uvs) & (np.abs(uvs) < 1e6), uvs, 0.0)
    if None in tiles:
        # The ends of cards that fill a texture must not mix with its opposite side.
        is_inside = ((uvs >= 0.0) & (uvs <= 1.0)).all()
        return root_colors.look_up(tiles[None], uvs, "EXTEND" if is_inside else "REPEAT", False).astype(np.float64)
    cells = np.floor(uvs).astype(np.int64)
    numbers = 1001 + cells[:, 0] + 10 * cells[:, 1]
    found = np.zeros((len(uvs), next(iter(tiles.values())).shape[2]))
    for tile, values in tiles.items():
        rows = np.flatnonzero(numbers == tile)
        found[rows] = root_colors.look_up(values, uvs[rows] - cells[rows], "EXTEND", False)
    return found


def read(mesh_object, depsgraph) -> HairPieces:
    """Return the `HairPieces` of the evaluated mesh of an object. Raises `HairError`."""
    evaluated = mesh_object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        if not len(mesh.polygons):
            raise HairError('"{name}" has no faces: pick a mesh of cards, tubes or locks.', name=name_of(mesh_object))
        faces = scene.faces_of(mesh)
        corners = scene.triangle_corners(mesh, faces, name_of(mesh_object))
        slots = np.zeros(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", slots)
        polygons = np.searchsorted(faces.starts, corners[:, 0], side="right") - 1
        present = [slot.material for slot in evaluated.material_slots] or [None]
        slots, corner_uvs = np.clip(slots[polygons], 0, len(present) - 1), _corner_uvs(mesh, corners)
        used, has_uvs = set(np.unique(slots).tolist()), corner_uvs is not None
        return HairPieces(
            scene.vertex_positions(mesh),
            faces.corner_vertices[corners],
            corner_uvs,
            _corner_colors(mesh, faces, corners),
            [_read_material(one, has_uvs) if slot in used else _Material() for slot, one in enumerate(present)],
            slots,
        )
    finally:
        evaluated.to_mesh_clear()


def _corner_uvs(mesh, corners):
    layer = mesh.uv_layers.active
    if layer is None or len(layer.uv) != len(mesh.loops):
        return None
    uvs = np.empty((len(mesh.loops), 2), np.float32)
    layer.uv.foreach_get("vector", uvs.ravel())
    return np.where(np.isfinite(uvs), uvs, np.float32(0.0))[corners]


def _corner_colors(mesh, faces, corners):
    layer = mesh.color_attributes.active_color
    if layer is None or layer.domain not in {"POINT", "CORNER"}:
        return None
    colors = np.empty((len(layer.data), 4), np.float32)
    layer.data.foreach_get("color", colors.ravel())
    found = colors[faces.corner_vertices[corners] if layer.domain == "POINT" else corners]
    return np.maximum(np.where(np.isfinite(found), found, np.float32(0.0)), 0.0)


def _read_material(material, has_uvs):
    """Return the `_Material` of a Blender material, by its first shader of `_SHADERS`. Raises `HairError`.

    has_uvs: whether the mesh has UV coordinates; without them, no image is read.
    """
    if material is None:
        return _Material()
    shaders = [] if material.node_tree is None else [n for n in material.node_tree.nodes if n.type in _SHADERS]
    if not shaders:
        return _Material(np.array(material.diffuse_color))
    color, alpha = shaders[0].inputs[_SHADERS[shaders[0].type]], shaders[0].inputs.get("Alpha")
    image, _ = _image_before(color)
    alpha_image, output = (None, "") if alpha is None else _image_before(alpha)
    constant = 1.0 if alpha is None or alpha.is_linked else float(alpha.default_value)
    is_alpha = output == "Alpha"
    return _Material(
        None if color.is_linked else np.array(color.default_value),
        image_pixels.read(image, True) if has_uvs and image is not None else None,
        constant,
        image_pixels.read(alpha_image, is_alpha) if has_uvs and alpha_image is not None else None,
        3 if is_alpha else 0,
    )


def _image_before(socket):
    """Return (`Image`, name of its output) of the first image with pixels that leads to a socket; (None, "")."""
    waiting, known = [socket], set()
    while waiting:
        for link in waiting.pop(0).links:
            node = link.from_node
            if node.type == "TEX_IMAGE" and node.image is not None and all(node.image.size):
                return node.image, link.from_socket.name
            if node.name not in known:
                known.add(node.name)
                waiting += [one for one in node.inputs if one.is_linked]
    return None, ""
