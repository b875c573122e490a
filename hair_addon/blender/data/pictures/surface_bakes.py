# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of surfaces whose materials have nodes that Vellus does not read. Another process bakes them once.

Pictures of an object are stored under the digest of its materials and its mesh.
"""

import hashlib
import zipfile
from dataclasses import dataclass, replace

import numpy as np

from ...host.caches import Cache
from ...host.notices import say
from .. import scene
from . import kept_files, picture_jobs, surface_materials, unread_nodes, world_digest
from .shader_sockets import nodes_of

bake_cache = Cache(capacity=16)  # path → `Bake`, of 20 to 150 MB


@dataclass(frozen=True, eq=False)
class BakedPicture:
    """One picture of a `Bake`: texels (H, W, 4) float32, the lowest row first."""

    texels: np.ndarray


@dataclass(frozen=True, eq=False)
class Bake:
    """Pictures of the materials of an object.

    uvs: (C, 2) float32 of the corners of its mesh; surface: linear color and roughness; normal: in tangent space, None
    without nodes of normals; metallic, weight: (H, W) float16. The weight is the opaque part of the surface.
    """

    uvs: np.ndarray
    surface: BakedPicture
    normal: BakedPicture | None
    metallic: np.ndarray
    weight: np.ndarray

    def fits(self, corner_count, name):
        """Whether the pictures fit a mesh's number of corners; if not, prints a message, unless the name is empty."""
        if len(self.uvs) != corner_count and name:
            say(
                f'The baked materials of "{name}" do not fit its mesh: apply modifiers that change its faces over time.'
            )
        return len(self.uvs) == corner_count

    def material(self, plain, loops):
        """Return a `SurfaceMaterial` with the pictures; loops: (3 F,) indices of its corners."""
        metallic, weight = self.means(loops)
        if weight < 0.5:  # mostly transparent
            return surface_materials.SurfaceMaterial(is_clear=True, name=plain.name, index=plain.index)
        every, roughness = (0.2126, 0.7152, 0.0722, 0.0), (0.0, 0.0, 0.0, 1.0)
        color_image, roughness_image, normal_image = (
            None
            if picture is None
            else surface_materials.ImageMap(picture, "", np.eye(2, 3), channels, "EXTEND", True, True)
            for picture, channels in ((self.surface, every), (self.surface, roughness), (self.normal, every))
        )
        return replace(
            plain,
            metallic=metallic,
            normal_strength=1.0,
            color_image=color_image,
            roughness_image=roughness_image,
            normal_image=normal_image,
            is_baked=True,
        )

    def means(self, loops):
        """Return (metallic, weight) of corners."""
        height, width = self.metallic.shape
        centers = self.uvs[loops].reshape(-1, 3, 2).mean(axis=1)
        column, row = (np.clip(centers * (width, height), 0, (width - 1, height - 1))).astype(int).T
        return tuple(float(one[row, column].mean(dtype=np.float64)) for one in (self.metallic, self.weight))


def find(objects, override, frame, for_render, waits, refused=None):
    """Return {session_uid of a mesh object: `Bake`} of those of the evaluated objects whose materials need one.

    objects: read in turn, as Blender frees the objects of some instances when the next instance is read.

    override: the view layer's material; frame: the time of drivers of nodes; waits: return only when all are baked.
    Without `waits`, an object keeps its last pictures until new coarse ones are baked, and these until the fine ones
    are baked. In Edit Mode it keeps its last pictures, and nothing is baked. refused: called with the sentence and the
    `HairError` of each object that cannot be baked; None: prints the sentence.
    """
    paths, originals, edited = {}, {}, set()
    for one in objects:
        uid = one.original.session_uid
        if one.original.data.is_editmode and not waits:
            edited.add(uid)
        elif uid not in paths and _needs_bake(one, override):
            paths[uid] = _path_of(one)
            originals[paths[uid]] = one.original  # linked objects have common pictures
    bake_cache.make_room(len(paths))
    shown = {**paths, **dict.fromkeys(edited)}

    def read():
        """Return {session_uid: `Bake`}; None for a render if a file was damaged."""
        files, errors = picture_jobs.files_of("surfaces", originals, waits, frame=float(frame), for_render=for_render)
        for error in errors:
            say(str(error)) if refused is None else refused(str(error), error)
        used = {uid: _used(uid, files.get(path)) for uid, path in shown.items()}
        found = {uid: bake_cache.get(path, lambda path=path: _read(path)) for uid, path in used.items() if path}
        whole = {uid: bake for uid, bake in found.items() if bake is not None}
        return None if waits and len(whole) < len(found) else whole

    return picture_jobs.read(read, waits)


def _used(uid, made):
    """Return the file of an object's pictures: `made`, or its last file if that is None; None without one."""
    last = picture_jobs.last_cache
    path = last.get(uid) if made is None else last.keep(uid, made)
    return path if path is not None and path.is_file() else None


def add_uv_map(mesh, name, uvs):
    """Add a UV map (C, 2) and make it active, but not for renders. Returns None if the mesh has too many UV maps."""
    shown = next((layer.name for layer in mesh.uv_layers if layer.active_render), None)
    layer = mesh.uv_layers.new(name=name, do_init=False)
    if layer is None:
        return None
    layer.uv.foreach_set("vector", uvs.ravel())
    if shown is not None:
        mesh.uv_layers[shown].active_render = True
    layer = mesh.uv_layers[name]
    layer.active = True
    return layer


def _needs_bake(mesh_object, override):
    materials = (override,) if override is not None else [slot.material for slot in mesh_object.material_slots]
    if override is not None or not len(mesh_object.data.polygons):
        return False
    return any(one is not None and unread_nodes.baked_labels(one) for one in materials)


def _path_of(mesh_object):
    """Return the file of the pictures of an evaluated object."""
    original, evaluated = mesh_object.original.data, mesh_object.data
    found = hashlib.blake2b(digest_size=16)
    materials = [slot.material for slot in mesh_object.material_slots]
    found.update(repr([one and world_digest.digest_of(one) for one in materials]).encode())
    if any(_is_placed(one) for one in materials if one is not None):
        found.update(repr(world_digest.settings_of(mesh_object)).encode("utf-8", "replace"))
    faces = scene.cached_faces(mesh_object.original, evaluated)
    found.update(np.ascontiguousarray(faces.corner_vertices))
    found.update(np.ascontiguousarray(faces.starts))
    for attribute in original.attributes:
        if attribute.data_type in _COMPONENTS:
            name, components, dtype = _COMPONENTS[attribute.data_type]
            values = np.empty(len(attribute.data) * components, dtype)
            attribute.data.foreach_get(name, values)
            found.update(attribute.name.encode())
            found.update(values)
    return kept_files.folder("surfaces") / f"{found.hexdigest()}.npz"


# Data types of attributes that materials read → name, number and type of their components.
_COMPONENTS = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
}


def _is_placed(material):
    """Whether a material depends on the transform, name, color or custom properties of its object."""
    return material.node_tree is not None and any(
        one.type in {"NEW_GEOMETRY", "OBJECT_INFO", "VECT_TRANSFORM"}
        or (one.type == "ATTRIBUTE" and one.node.attribute_type != "GEOMETRY")
        or (one.type == "TEX_COORD" and one.node.object is not None)
        for one in nodes_of(material.node_tree)
    )


def _read(path):
    """Return the `Bake` of a file. A damaged file is removed and gives None, so it is baked again."""
    try:
        return _read_arrays(path)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        path.unlink(missing_ok=True)
        return None


def _read_arrays(path):
    with path.open("rb") as file, np.load(file) as found:
        color, normal = found["color"], found["normal"]
        texels = np.concatenate([color, found["roughness"][..., None]], axis=-1).astype(np.float32)
        bent = None
        if normal.size:
            bent = np.ones((*normal.shape[:2], 4), np.float32)
            bent[..., :3] = normal
        return Bake(
            found["uvs"],
            BakedPicture(texels),
            None if bent is None else BakedPicture(bent),
            found["metallic"],
            found["weight"],
        )
