# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair is imported onto surfaces that come from FBX and VRM files, with their units, axes and armatures."""

import shutil
from dataclasses import dataclass

import bpy
import numpy as np
import pytest
from mathutils import Euler

from hair_addon import api
from tests.support.dynamics.following import update
from tests.support.exchange.alembic_files import of_maya
from tests.support.exchange.imported import lines_on, select, world


@dataclass(frozen=True)
class Way:
    """How a surface passes through a file. options: of the FBX exporter, None for glTF; reader: in bpy.ops."""

    reader: tuple
    options: dict | None = None
    has_armature: bool = False


MAYA = {"axis_forward": "-Z", "axis_up": "Y"}
WAYS = {
    "fbx": Way(("import_scene", "fbx"), MAYA),
    "fbx with an armature": Way(("import_scene", "fbx"), MAYA, has_armature=True),
    "fbx in centimeters": Way(("import_scene", "fbx"), MAYA | {"apply_scale_options": "FBX_SCALE_UNITS"}),
    "fbx with Z up": Way(("import_scene", "fbx"), {"axis_forward": "Y", "axis_up": "Z"}),
    "fbx by the other importer": Way(("wm", "fbx_import"), MAYA, has_armature=True),
    "vrm": Way(("import_scene", "gltf"), has_armature=True),
}


def add_armature(surface):
    """Let an armature of one bone move a surface."""
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones.new("head").tail = (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    surface.vertex_groups.new(name="head").add(range(len(surface.data.vertices)), 1.0, "REPLACE")
    surface.modifiers.new("Armature", "ARMATURE").object = armature
    matrix = surface.matrix_world.copy()
    surface.parent = armature
    surface.matrix_world = matrix
    update()


def through_file(surface, folder, way):
    """Export a surface, remove it, and return the mesh object that the file's importer makes of it."""
    select(*(one for one in bpy.context.view_layer.objects if one.type in {"MESH", "ARMATURE"}))
    if way.options is not None:
        path = folder / "surface.fbx"
        bpy.ops.export_scene.fbx(filepath=str(path), use_selection=True, **way.options)
    else:
        bpy.ops.export_scene.gltf(filepath=str(folder / "surface.glb"), export_format="GLB", use_selection=True)
        path = folder / "surface.vrm.glb"  # Blender's importer refuses the ending .vrm
        shutil.move(folder / "surface.glb", path)
    bpy.data.batch_remove([*bpy.data.objects])
    module, name = way.reader
    getattr(getattr(bpy.ops, module), name)(filepath=str(path))
    update()
    return max((one for one in bpy.data.objects if one.type == "MESH"), key=lambda one: len(one.data.vertices))


@pytest.mark.filterwarnings("ignore:Setting the shape:DeprecationWarning")  # of Blender's FBX exporter
@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_hair_lies_on_the_surface_of_a_file_and_follows_it(scene, sphere, rng, tmp_path, way):
    """Imported curves are at their places in the world, grow on the imported surface, and move with it."""
    sphere.location, sphere.rotation_euler = (0.3, -0.2, 1.5), Euler((0.3, 0.2, 1.0))
    sphere.scale = (0.1, 0.1, 0.1)
    update()
    lines = np.stack([*lines_on(sphere, rng, 20, least=6, most=6)])
    if way.has_armature:
        add_armature(sphere)
    of_maya(tmp_path / "curves.abc", lines)
    surface = through_file(sphere, tmp_path, way)
    found = api.import_curves(tmp_path / "curves.abc", surface, unit="cm", up="Y")
    assert found.notes == []
    np.testing.assert_allclose(world(found.curves), lines.reshape(-1, 3), atol=2e-6)
    used = api.use_as_hair(found.curves, surface, guide_count=8)
    hair = next(one for one in bpy.data.objects if one.data == used.hair)
    np.testing.assert_allclose(world(hair), lines.reshape(-1, 3), atol=2e-5)
    moved = surface.parent or surface
    moved.location.x += 0.25
    update()
    np.testing.assert_allclose(world(hair), lines.reshape(-1, 3) + np.array([0.25, 0.0, 0.0]), atol=2e-5)
