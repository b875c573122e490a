# SPDX-License-Identifier: GPL-3.0-or-later
"""Use of a file whose names are not UTF-8, for test_unreadable_names.py, in a separate process.

Blender crashes when such a datablock is printed, as by a failed assertion of pytest.
"""

import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

import hair_addon
from hair_addon import api
from hair_addon.blender.io import inspection
from hair_addon.blender.ui import panels
from tests.support.interface import layout
from tests.support.scenes import shrink_shadows

SMALL = {"width": 16, "height": 12}


def refused(call):
    """Return the message of a refused call."""
    try:
        call()
    except api.HairError as error:
        return str(error)
    return ""


def make(path):
    """Save the file: mesh, groups, objects, guides and hair have names with bytes that are not UTF-8."""
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
    damage(path)


def damage(path):
    """Save the open file, and write bytes that are not UTF-8 to its names."""
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
    path.write_bytes(path.read_bytes().replace(b"QQQQ", b"\xff\xfe\xff\xfe"))


def make_styled(path):
    """Save a file with two hair objects: names in the styles of both, and in settings of the first, are unreadable."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    sphere = bpy.context.object
    sphere.name = "QQQQsphere"
    sphere.vertex_groups.new(name="QQQQtop").add(range(100), 1.0, "REPLACE")
    for name, data in (("QQQQcutter", None), ("QQQQlines", drawn_line())):
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, data))
    image = bpy.data.images.new("QQQQimage", 8, 8)
    image.pack()
    image.use_fake_user = True
    guides, others = (api.distribute_guides(sphere, guide_count=20) for _ in range(2))
    hair, other = (api.interpolate_hair(curves, strand_count=100) for curves in (guides, others))
    for curves in (hair, guides):
        curves.attributes.new("QQQQregion", "INT", "CURVE")
    sphere.data.attributes.new("QQQQregion", "INT", "FACE")
    style(hair)
    style(other)
    bpy.context.view_layer.update()
    assert hair.vellus.status == guides.vellus.status == "", (hair.vellus.status, guides.vellus.status)
    keyed = "styles[2].curl.radius", "hair.keep_length"
    for curves, paths in ((hair, keyed), (other, keyed), (guides, ("guides.gravity",))):
        for setting, frame in ((f"vellus.{path}", frame) for path in paths for frame in (1, 3)):
            owner, _, name = setting.rpartition(".")
            setattr(curves.path_resolve(owner), name, 0.1 * frame)
            curves.keyframe_insert(setting, frame=frame)
    settings = hair.vellus.hair
    settings.part_lines, settings.region_attribute, settings.region_group = "QQQQlines", "QQQQregion", "QQQQtop"
    settings.density_image = guides.vellus.guides.density_image = "QQQQimage"
    guides.vellus.guides.flow_lines = "QQQQlines"
    guides.name, hair.name, other.name = "QQQQguides", "QQQQhair", "QQQQother"
    bpy.context.view_layer.update()
    damage(path)


def style(hair):
    """Add styles that refer to an object, a vertex group and an image."""
    styles = [
        api.Trim(factor=0.8, cutter="QQQQcutter", mask="QQQQtop"),
        api.Lean(direction="OBJECT", target="QQQQcutter", mask_image="QQQQimage"),
        api.Curl(mask="QQQQtop"),
    ]
    api.set_styles(hair, styles)
    for item in hair.vellus.styles:
        item.name = f"QQQQ{item.kind}"


def drawn_line():
    """Return a line beside the sphere's pole."""
    curve = bpy.data.curves.new("QQQQline", "CURVE")
    curve.dimensions = "3D"
    curve.splines.new("POLY").points.add(1)
    curve.splines[0].points[0].co, curve.splines[0].points[1].co = (0.0, 0.1, 1.0, 1.0), (0.5, 0.1, 0.85, 1.0)
    return curve


def use_styled(path):
    """Check that handlers and panels work, whatever Blender reports."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    sphere, view_layer = bpy.data.hair_curves[0].surface, bpy.context.view_layer
    cutter, lines = (next(o for o in bpy.data.objects if o.type == kind) for kind in ("EMPTY", "CURVE"))
    for _ in range(2):
        for other in (cutter, lines):
            other.location.x += 0.1
            view_layer.update()
        lines.data.splines[0].points[0].co.x += 0.05
        for guides in (c for c in bpy.data.hair_curves if c.vellus.kind == "GUIDES"):
            comb(guides)
        sphere.data.vertices[0].co.z += 0.05
        sphere.data.update()
        view_layer.update()
        for mode in ("WEIGHT_PAINT", "VERTEX_PAINT", "TEXTURE_PAINT", "OBJECT"):
            view_layer.objects.active = sphere
            bpy.ops.object.mode_set(mode=mode)
            sphere.data.update()
            bpy.data.images[0].update_tag()
            view_layer.update()
            see(sphere)
        for frame in (2, 3, 1):
            bpy.context.scene.frame_set(frame)
        for shown in (sphere, *(o for o in bpy.data.objects if o.type == "CURVES")):
            see(shown)
    for hair in (c for c in bpy.data.hair_curves if c.vellus.kind == "HAIR"):
        assert "not valid UTF-8" in hair.vellus.status, hair.vellus.status
        assert [item.name[-4:] for item in hair.vellus.styles] == ["TRIM", "LEAN", "CURL"]
        for item in hair.vellus.styles:
            item.name = "Renamed"
        assert hair.vellus.styles[2].name == "Renamed.002"
    bpy.ops.wm.save_as_mainfile(filepath=str(path.with_name("saved_styled.blend")))


def comb(guides):
    """Move the tip of a guide."""
    guides.points[len(guides.points) - 1].position.z += 0.01
    guides.update_tag()
    bpy.context.view_layer.update()


def see(active):
    """Draw every panel for an active object."""
    bpy.context.view_layer.objects.active = active
    for panel in panels.CLASSES:
        if issubclass(panel, bpy.types.Panel):
            layout.draw(panel)


def use(folder):
    """Check that everything works except functions that need the names, which raise `HairError`."""
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


def rename_layer(path):
    """Check that a layer's name is made readable when the file is opened, as Blender would crash, and renamed."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    api.add_layer(api.distribute_guides(bpy.context.object, guide_count=10), "QQQQ")
    damage(path)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    guides = bpy.data.hair_curves[0]
    (name,) = api.layers(guides)
    assert name
    guides.vellus.layers[0].name = "Fringe"
    assert list(api.layers(guides)) == ["Fringe"]


if __name__ == "__main__":
    hair_addon.register()
    shrink_shadows(pytest.MonkeyPatch())
    make(Path(sys.argv[1]) / "damaged.blend")
    use(Path(sys.argv[1]))
    make_styled(Path(sys.argv[1]) / "styled.blend")
    use_styled(Path(sys.argv[1]) / "styled.blend")
    rename_layer(Path(sys.argv[1]) / "layers.blend")
    print("all was used")
