# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own importers read back the files of a groom and its surface."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.io import groom_files
from tests.support.dynamics.following import update


def hide_all():
    """Hide each object of the groom in another way."""
    kept = bpy.data.collections.new("Kept")
    bpy.context.scene.collection.children.link(kept)
    hair = bpy.data.objects["Hair"]
    for collection in hair.users_collection:
        collection.objects.unlink(hair)
    kept.objects.link(hair)
    update()
    kept.hide_render = kept.hide_select = True
    bpy.data.objects["Guides"].hide_render = True
    bpy.data.objects["Guides"].hide_set(True)
    bpy.data.objects["Sphere"].hide_select = True


def state():
    """Return visibility and selection of objects, and their collections."""
    objects = {o: (o.hide_get(), o.hide_select, o.hide_render, o.select_get()) for o in bpy.data.objects}
    return objects, {o: {*o.users_collection} for o in objects}, {*bpy.data.collections}


@pytest.mark.parametrize("ending", [".usdc", ".abc"])
def test_a_file_has_the_groom_and_its_surface_whatever_hides_them(hair, tmp_path, ending):
    bpy.ops.mesh.primitive_cube_add()
    hide_all()
    update()
    before = state()
    groom_files.write(tmp_path / f"groom{ending}", bpy.data.objects["Guides"].data, hair.data, np.eye(3))
    is_as_before = state() == before
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if ending == ".abc":
        bpy.ops.wm.alembic_import(filepath=str(tmp_path / "groom.abc"), as_background_job=False)
    else:
        bpy.ops.wm.usd_import(filepath=str(tmp_path / "groom.usdc"))
    assert sorted(o.type for o in bpy.data.objects if o.type != "EMPTY") == ["CURVES", "CURVES", "MESH"]
    assert is_as_before
