# SPDX-License-Identifier: GPL-3.0-or-later
"""A file whose names are not UTF-8 is used by test_unreadable_names.py in a process of its own.

Blender ends where such a datablock is printed, as a failed assertion of pytest's does.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

import hair_addon
from hair_addon import api
from hair_addon.blender.io import inspection

SMALL = {"width": 16, "height": 12}


def refused(call):
    """The sentence of what is refused."""
    try:
        call()
    except api.HairError as error:
        return str(error)
    return ""


def make(path):
    """Save the file: mesh, groups, objects, guides and hair have names with bytes that no text has."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    sphere = bpy.context.object
    sphere.name, sphere.data.name, sphere.data.uv_layers.active.name = "QQQQsphere", "QQQQmesh", "QQQQmap"
    sphere.vertex_groups.new(name="QQQQtop").add(range(100), 1.0, "REPLACE")
    guides = api.distribute_guides(sphere, guide_count=20, density_group="QQQQtop")
    hair = api.interpolate_hair(guides, strand_count=100)
    guides.name, hair.name = "QQQQguides", "QQQQhair"
    bpy.data.objects["Hair"].name, bpy.data.objects["Guides"].name = "QQQQstrands", "QQQQlocks"
    for name, data in (("Camera", bpy.data.cameras.new("Camera")), ("QQQQsun", bpy.data.lights.new("QQQQsun", "SUN"))):
        made = bpy.data.objects.new(name, data)
        made.location, made.rotation_euler = (0.0, -6.0, 0.0), (1.57, 0.0, 0.0)
        bpy.context.scene.collection.objects.link(made)
    bpy.context.scene.camera = bpy.data.objects["Camera"]
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
    path.write_bytes(path.read_bytes().replace(b"QQQQ", b"\xff\xfe\xff\xfe"))


def use(folder):
    """Everything works but what needs the names, and that is said."""
    bpy.ops.wm.open_mainfile(filepath=str(folder / "damaged.blend"))
    hair, guides = (next(c for c in bpy.data.hair_curves if c.vellus.kind == kind) for kind in ("HAIR", "GUIDES"))
    assert np.isfinite(api.draw(samples_per_side=1, **SMALL)).all()
    api.render(folder / "a.png", sample_count=1, **SMALL)
    assert api.points(hair).shape == (100, 41, 3)
    hair.vellus.hair.strand_count = 50
    guides.vellus.guides.length = 0.3
    bpy.context.view_layer.update()
    assert "not valid UTF-8" in guides.vellus.status, guides.vellus.status
    assert "not valid UTF-8" in hair.vellus.status and len(hair.curves) == 100, (hair.vellus.status, len(hair.curves))
    assert "not valid UTF-8" in refused(lambda: api.settings_of(hair))
    assert "not valid UTF-8" in refused(lambda: api.apply_settings(hair, api.GroomSettings()))
    assert inspection.open_file()["hair"][0]["strands"] == 100
    new = api.interpolate_hair(api.distribute_guides(hair.surface, guide_count=5), strand_count=20)
    assert len(new.curves) == 20
    hair.surface.vertex_groups[0].name = guides.vellus.guides.density_group = "top"
    guides.vellus.guides.length = 0.3
    bpy.context.view_layer.update()
    assert guides.vellus.status == "", guides.vellus.status
    assert (hair.vellus.status, len(hair.curves)) == ("", 50), (hair.vellus.status, len(hair.curves))
    assert abs(api.settings_of(hair).guides.length - 0.3) < 1e-6
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "saved.blend"))


if __name__ == "__main__":
    hair_addon.register()
    make(Path(sys.argv[1]) / "damaged.blend")
    use(Path(sys.argv[1]))
    print("all was used")
