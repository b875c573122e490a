# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh objects → a file of their own for engines, or the whole scene as a .blend."""

import contextlib
from pathlib import Path

import bpy

from ...core.errors import HairError
from ...core.files import gltf_springs, vrm
from ...core.files.atomic_file import atomic_file, require_writable_path
from ..data.made import armature_weights, chain_armatures
from ..host import paths
from .chosen_objects import only_chosen


def _blend(path):
    return bpy.ops.wm.save_as_mainfile(filepath=path, copy=True, relative_remap=True)


def _gltf(path):
    bpy.ops.export_scene.gltf(filepath=path, export_format="GLB", use_selection=True, export_tangents=True)
    gltf_springs.add(Path(path), chain_armatures.all_springs())


def _vrm(path):
    partial = Path(path).with_suffix(".glb")  # the exporter would append its own ending
    try:
        _gltf(str(partial))
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def _fbx(path):
    return bpy.ops.export_scene.fbx(
        filepath=path, use_selection=True, object_types={"MESH", "ARMATURE"}, use_tspace=True
    )


def _usd(path):
    return bpy.ops.wm.usd_export(filepath=path, selected_objects_only=True, export_textures_mode="KEEP")


def _obj(path):
    return bpy.ops.wm.obj_export(filepath=path, export_selected_objects=True, export_materials=False)


# Extension → (export function, its operator, whether the format embeds textures).
_FORMATS = {
    ".blend": (_blend, "wm.save_as_mainfile", True),
    ".glb": (_gltf, "export_scene.gltf", True),
    ".vrm": (_vrm, "export_scene.gltf", True),
    ".fbx": (_fbx, "export_scene.fbx", False),
    ".usdc": (_usd, "wm.usd_export", False),
    ".obj": (_obj, "wm.obj_export", False),
}
ENDINGS = tuple(_FORMATS)


def require_writable(path):
    """Raise `HairError` unless this build of Blender can write meshes to a path, by its extension."""
    ending = path.suffix.lower()
    if ending not in _FORMATS:
        raise HairError(
            "Meshes are exported as {endings}, not as {ending}.",
            endings=", ".join(ENDINGS),
            ending=ending or "a file without an extension",
        )
    if not paths.has_operator(_FORMATS[ending][1]):
        raise HairError(f"{path} cannot be written: this build of Blender lacks its exporter, {_FORMATS[ending][1]}.")
    require_writable_path(path)


def has_textures(path):
    """Whether the format of a path embeds textures."""
    return _FORMATS[path.suffix.lower()][2]


def write(path, objects):
    """Write mesh objects of the view layer with their armatures; a .blend has the whole scene.

    Raises `HairError`.
    """
    require_writable(path)
    export = _FORMATS[path.suffix.lower()][0]
    rigs = [modifier.object for one in objects for modifier in armature_weights.armatures_of(one)]
    above = [rig.parent for rig in rigs if rig.parent is not None and rig.parent.type == "ARMATURE"]
    chosen, humanoid = [*dict.fromkeys([*objects, *rigs, *above])], None
    if export is _vrm:
        chosen, humanoid, bones = _avatar(chosen)
    with contextlib.nullcontext() if export is _blend else only_chosen(chosen), atomic_file(path) as partial:
        export(str(partial.absolute()))  # exporters derive texture paths from this path
        if humanoid is not None:
            vrm.add(partial, humanoid.name, bones, path.stem)


def _avatar(chosen):
    """Return (objects of an avatar, its armature, bones of the humanoid); chosen: meshes of hair and armatures.

    An avatar has all visible meshes of its armature, and hair of the finest level. Raises `HairError`.
    """
    rigs = [one for one in chosen if one.type == "ARMATURE"]
    humanoid, bones = _humanoid(rigs)
    bpy.context.view_layer.update()  # else it lists removed objects as None
    shown = bpy.context.view_layer.objects
    body = [one for one in shown if one.type == "MESH" and not one.hide_render and _follows(one, humanoid)]
    hair = [one for one in chosen if one.type == "MESH" and not one.hide_render]
    return [*dict.fromkeys([*hair, *body, *rigs])], humanoid, bones


def _humanoid(rigs):
    """Return (armature object, bones) of the largest humanoid among armatures.

    Raises `HairError` that names the bones that the largest armature lacks.
    """
    largest = sorted(rigs, key=lambda one: -len(one.data.bones))
    for rig in largest:
        # Controls of a generated rig can have the usual names too, but they do not deform.
        for bones in ([bone for bone in rig.data.bones if bone.use_deform], rig.data.bones):
            with contextlib.suppress(HairError):
                return rig, vrm.humanoid_bones(bone.name for bone in bones)
    return None, vrm.humanoid_bones(bone.name for rig in largest[:1] for bone in rig.data.bones)


def _follows(mesh_object, armature_object):
    return any(modifier.object == armature_object for modifier in armature_weights.armatures_of(mesh_object))
