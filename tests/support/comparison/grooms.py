# SPDX-License-Identifier: GPL-3.0-or-later
"""Small grooms of many kinds for digests.py, created by public names only."""

import math
from pathlib import Path

import bpy
import numpy as np

import hair_addon
from hair_addon import api

ROOT = Path(hair_addon.__file__).resolve().parents[1]
HEAD = ROOT / "blend_samples" / "head.obj"
SIZE = {"width": 96, "height": 72}


# Scenes.


def update():
    bpy.context.view_layer.update()


def activate(chosen):
    for other in bpy.context.view_layer.objects:
        other.select_set(other == chosen)
    bpy.context.view_layer.objects.active = chosen
    return chosen


def objects_of(*datablocks):
    """Return the objects of Curves datablocks."""
    return [next(o for o in bpy.data.objects if o.data == datablock) for datablock in datablocks]


def link(name, data, location=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0)):
    """Return a new object in the scene."""
    made = bpy.data.objects.new(name, data)
    made.location, made.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(made)
    return made


def film(distance=6.0, height=0.0):
    """Add a camera that looks along Y, and a sun and a soft light with shadows."""
    camera = link("Camera", bpy.data.cameras.new("Camera"), (0.0, -distance, height), (math.pi / 2, 0.0, 0.0))
    bpy.context.scene.camera = camera
    sun = link("Sun", bpy.data.lights.new("Sun", "SUN"), rotation=(math.pi / 3, 0.2, 0.3))
    sun.data.energy = 3.0
    area = link("Area", bpy.data.lights.new("Area", "AREA"), (2.0, -2.0, height + 2.0), (0.8, 0.0, 0.8))
    area.data.energy, area.data.size = 60.0, 0.5
    update()


def vertices(mesh_object):
    """Return (V, 3) float32 positions of vertices."""
    found = np.empty((len(mesh_object.data.vertices), 3), np.float32)
    mesh_object.data.vertices.foreach_get("co", found.ravel())
    return found


def weigh(mesh_object, name, weights):
    """Add a vertex group of weights (V,)."""
    group = mesh_object.vertex_groups.new(name=name)
    for vertex in np.flatnonzero(weights > 0.0):
        group.add([int(vertex)], float(weights[vertex]), "REPLACE")


def sphere():
    """Return a mesh object of radius 1 with a UV map. In Blender's UV sphere the order of corners varies by run."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4)
    bpy.context.object.name = "Sphere"
    return bpy.context.object


def comb(guides, chosen, offset):
    """Move the tips of some guides as a brush does, and tag the update."""
    points = np.empty((len(guides.data.points), 3), np.float32)
    guides.data.attributes["position"].data.foreach_get("vector", points.ravel())
    strands = points.reshape(len(guides.data.curves), -1, 3)
    along = np.linspace(0.0, 1.0, strands.shape[1], dtype=np.float32)[:, None]
    strands[chosen] += along**2 * np.float32(offset)
    guides.data.attributes["position"].data.foreach_set("vector", points.ravel())
    guides.data.update_tag()
    update()


def image(name, pixels):
    """Return an image of (H, W, 4) float32."""
    made = bpy.data.images.new(name, pixels.shape[1], pixels.shape[0], float_buffer=True, is_data=True)
    made.pixels.foreach_set(pixels.ravel())
    made.update()
    return made


def grown(surface, guides=None, hair=None, look=None):
    """Return objects of guides and hair on a mesh object."""
    settings = api.GroomSettings(
        api.GuideSettings(**{"guide_count": 60} | (guides or {})),
        api.HairSettings(**{"strand_count": 800} | (hair or {})),
        look or api.Appearance(),
    )
    made = objects_of(*api.add_hair(surface, settings))
    made[1].data.vellus.marschner.size = 64
    update()
    return made


# Grooms. Each begins in an empty file, adds its digests, and may write into a folder.


def cube(found, _folder):
    """Hair by Kajiya-Kay, with few neighbors and defaults for all settings that are fitted to the surface."""
    bpy.ops.mesh.primitive_cube_add()
    guides = api.distribute_guides(bpy.context.object, guide_count=50)
    hair = api.interpolate_hair(guides, strand_count=800, neighbour_limit=2, keep_length=0.3, guide_map=False)
    api.shade(hair, "GINGER", model="KAJIYA_KAY", random_color=0.0)
    film()
    for name, strands in zip(("guides", "strands"), objects_of(guides, hair), strict=True):
        found.add_strands(name, strands)
    found.add_picture()
    api.shade(hair, tip_absorption=0.3, random_color=0.4)
    update()
    found.add_picture("picture of strands that differ")


def suzanne(found, _folder):
    """Hair with density by curvature, mirrored guides, varied strands and Energy Conserving, on a subdivided
    surface.
    """
    bpy.ops.mesh.primitive_monkey_add()
    surface = bpy.context.object
    surface.modifiers.new("Subdivision", "SUBSURF").levels = 1
    update()
    guides, hair = grown(surface, {"curvature": 3.0, "symmetric": True, "seed": 5}, {"seed": 6, "tip_taper": 0.5})
    film()
    api.shade(hair, "DYED_PINK", mode="energy", random_roughness=0.3)
    update()
    found.add_strands("guides", guides)
    found.add_strands("strands", hair)
    found.add_picture()
    found.add_node_groups()


def masked_by_group(found, _folder):
    """Hair with masks and a region of weights and the classic mode, on a turned and stretched object."""
    surface = sphere()
    height = vertices(surface)[:, 2]
    weigh(surface, "top", np.clip(height + 0.3, 0.0, 1.0))
    weigh(surface, "crown", np.clip(height, 0.0, 1.0))
    weigh(surface, "left", np.where(vertices(surface)[:, 0] < 0.0, 1.0, 0.0))
    surface.rotation_euler, surface.scale, surface.location = (0.3, -0.2, 0.5), (1.2, 0.8, -1.0), (0.2, 0.1, -0.1)
    update()
    hair = {"density_group": "crown", "region_group": "left", "influence_distance": 0.4, "automatic_influence": False}
    guides, hair = grown(surface, {"density_group": "top", "relax_iterations": 4}, hair)
    film()
    api.shade(hair, mode="classic", random_color=0.0)
    update()
    found.add_strands("guides", guides)
    found.add_strands("strands", hair)
    found.add_picture()
    found.add_picture("transparent picture", is_transparent=True)


def masked_by_image(found, _folder):
    """Hair with a mask by an image; strands follow when it is painted over."""
    surface = sphere()
    side = np.linspace(0.0, 1.0, 32, dtype=np.float32)
    pixels = np.ones((32, 32, 4), np.float32)
    pixels[..., :3] = (side[:, None] * side[None, :])[..., None]
    mask = image("Mask", pixels)
    material = bpy.data.materials.new("Painted")  # without users Blender does not report painting
    material.node_tree.nodes.new("ShaderNodeTexImage").image = mask
    surface.data.materials.append(material)
    guides, hair = grown(surface, {"density_image": "Mask"})
    found.add_strands("guides", guides)
    found.add_strands("strands", hair)
    mask.pixels.foreach_set(np.ascontiguousarray(pixels[::-1]).ravel())
    mask.update_tag()
    update()
    found.add_strands("painted guides", guides)
    found.add_strands("painted strands", hair)


def parted(found, _folder):
    """Hair with a part line and regions of faces, on guides combed apart, deleted, restored and selected."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=20, y_subdivisions=20, size=1.0)
    surface = bpy.context.object
    regions = surface.data.attributes.new("region", "INT", "FACE")
    regions.data.foreach_set("value", np.arange(len(regions.data), dtype=np.int32) // 100)
    lines = bpy.data.curves.new("Parting", "CURVE")
    lines.dimensions = "3D"
    spline = lines.splines.new("POLY")
    spline.points.add(2)
    for place, corner in zip(spline.points, ((0.02, -0.6, 0.0), (0.05, 0.0, 0.01), (-0.04, 0.6, 0.0)), strict=True):
        place.co = (*corner, 1.0)
    link("Parting", lines)
    update()
    guides, hair = grown(surface, {"length": 0.2, "tilt": 0.1}, {"angle_limit": math.pi, "length_limit": 1e6})
    roots = api.points(guides)[:, 0]
    comb(guides, np.flatnonzero(roots[:, 0] < 0.0), (-0.2, 0.0, -0.1))
    comb(guides, np.flatnonzero(roots[:, 0] >= 0.0), (0.2, 0.0, -0.1))
    found.add_strands("guides", guides)
    found.add_strands("strands", hair)
    hair.data.vellus.hair.part_lines = "Parting"
    update()
    found.add_strands("parted strands", hair)
    hair.data.vellus.hair.region_attribute = "region"
    update()
    found.add_strands("strands in regions", hair)


def head(found, _folder):
    """Hair on the sample head by the panel's operator and steps of a stroke, with the classic mode and guides shown
    and removed.
    """
    bpy.ops.wm.obj_import(filepath=str(HEAD))
    surface = activate(bpy.context.selected_objects[0])
    surface.data.transform(surface.matrix_world)
    surface.matrix_world.identity()
    weigh(surface, "scalp", np.clip((vertices(surface)[:, 2] - 0.76) / 0.01, 0.0, 1.0))
    bpy.ops.vellus.add_hair(guide_count=80, strand_count=3000, density_group="scalp", length=0.15, gravity=0.8)
    guides, hair = bpy.data.objects["Hair Guides"], bpy.data.objects["Hair"]
    hair.data.vellus.marschner.size = 64
    api.shade(hair, "AUBURN", mode="classic", random_color=0.0)
    film(0.8, 0.75)
    found.add_strands("guides", guides)
    found.add_strands("strands", hair)
    found.add_picture()
    for step in range(3):
        comb(guides, np.arange(10 * step, 10 * step + 8), (0.02, -0.01, 0.01))
        found.add(f"points after stroke {step}", api.points(hair))
    found.add_picture("picture of combed hair")
    hair.data.vellus.hair.neighbour_limit = 3
    hair.data.vellus.hair.radius = 2e-4
    guides.data.vellus.show_guides = True
    update()
    found.add_strands("combed guides", guides)
    found.add_strands("strands of other settings", hair)
    hair.data.vellus.viewport_percentage = 30
    found.add_picture("picture of other settings")
    guides.data.remove_curves(indices=[1, 5, 70])
    guides.data.update_tag()
    update()
    found.add_strands("strands of fewer guides", hair)


def carried(found, folder):
    """Hair on a surface deformed by a shape key and a modifier: strands in other frames, with motion blur."""
    surface = sphere()
    guides, hair = grown(surface, {"length": 0.4}, {"radius": 0.004})
    rest = vertices(surface)
    surface.shape_key_add(name="Basis")
    key = surface.shape_key_add(name="Bent")
    key.data.foreach_set("co", (rest + 0.3 * rest[:, [1, 2, 0]] ** 2).ravel())
    for frame, value in ((1, 0.0), (11, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)
    twist = surface.modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 0.5
    film()
    for frame in (1, 7, 11):
        bpy.context.scene.frame_set(frame)
        found.add_strands(f"guides in frame {frame}", guides)
        found.add_strands(f"strands in frame {frame}", hair)
    found.add_picture()
    hair.data.vellus.is_drawn = False
    update()
    found.add_strands("strands that Blender draws", hair)
    hair.data.vellus.is_drawn = True
    moving = api.render(folder / "moving.exr", frame=7, **SIZE, sample_count=4, has_passes=True)
    found.add_pixels("moving", moving)
    bpy.context.scene.render.use_motion_blur = True
    bpy.context.scene.vellus.motion_steps = 3
    found.add_pixels("blurred", api.render(folder / "blurred.exr", frame=7, **SIZE, sample_count=6))
    found.add_node_groups()


def hand_made(found, _folder):
    """Guides from unattached curves with unequal point counts and a modifier, some of them reversed."""
    surface = sphere()
    rng = np.random.Generator(np.random.PCG64(20260101))
    lines = []
    for _ in range(60):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        along = np.linspace(0.0, 1.0, rng.integers(2, 13))[:, None]
        line = direction * (1.0 + 0.4 * along) + [0.0, 0.0, -0.1] * along**2
        lines.append(line[:: rng.choice([-1, 1])])
    data = bpy.data.hair_curves.new("Drawn")
    data.add_curves([len(line) for line in lines])
    data.set_types(type="POLY")
    data.attributes["position"].data.foreach_set("vector", np.concatenate(lines).astype(np.float32).ravel())
    drawn = link("Drawn", data, rotation=(0.0, 0.0, 0.1))
    update()
    guides = api.use_as_guides(drawn, surface, every=2)
    hair = api.interpolate_hair(guides, strand_count=500, seed=3)
    for name, strands in zip(("guides", "strands"), objects_of(guides, hair), strict=True):
        found.add_strands(name, strands)


def lit_by_the_world(found, folder):
    """Hair lit by an image of the world, with Energy Conserving, dual scattering and shadows; the render engine with
    passes.
    """
    bpy.ops.mesh.primitive_plane_add(size=6.0, location=(0.0, 0.0, -1.0))
    surface = sphere()
    _guides, hair = grown(surface, {"length": 0.3}, {"radius": 0.006})
    u, v = np.meshgrid((np.arange(32) + 0.5) / 32, (np.arange(16) + 0.5) / 16)
    sky = np.stack([0.5 + 0.4 * np.sin(2.0 * np.pi * u), v, 0.0 * u + 0.3, 0.0 * u + 1.0], axis=-1).astype(np.float32)
    sky[4:6, 10:12, :3] = 12.0
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    node = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image("Sky", sky)
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    world.node_tree.links.new(node.outputs["Color"], background.inputs["Color"])
    film()
    for preset in ("BLOND", "GREY"):
        api.shade(hair, preset, mode="energy", random_color=0.0, random_roughness=0.0)
        update()
        found.add_picture(f"picture, {preset}")
        found.add_tree(f"material, {preset}", hair.data.materials[0].node_tree)
    layer = bpy.context.view_layer
    layer.vellus.has_hair_mask = layer.vellus.has_lobes = True
    passes = api.render(folder / "passes.exr", **SIZE, sample_count=4, has_passes=True)
    found.add_pixels("passes", passes)
    found.add_pixels("render", api.render(folder / "render.exr", **SIZE, sample_count=5, is_transparent=True))
    shown = bpy.data.images.load(str(api.render(folder / "render.png", **SIZE, sample_count=1)))
    found.add("render.png", np.array(shown.pixels[:], np.float32))


def edited(found, folder):
    """Hair whose surface is sculpted and scaled, with two systems, in a file that is saved and opened."""
    surface = sphere()
    first = grown(surface)
    second = grown(surface, {"seed": 9, "guide_count": 20, "gravity": 1.0}, {"strand_count": 200, "seed": 2})
    moved = vertices(surface)
    moved[:, 2] *= 1.5
    surface.data.vertices.foreach_set("co", moved.ravel())
    surface.data.update()
    update()
    for name, made in (("first", first), ("second", second)):
        found.add_strands(f"{name} guides", made[0])
        found.add_strands(f"{name} strands", made[1])
    surface.scale = (2.0, 2.0, 2.0)
    update()
    activate(surface)
    bpy.ops.vellus.apply_scale()
    update()
    found.add_strands("strands of an applied scale", first[1])
    first[0].data.vellus.guides.length = 0.7
    update()
    found.add_strands("guides of another length", first[0])
    found.add_strands("strands of another length", first[1])
    names = [[made.name for made in system] for system in (first, second)]
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(folder / "saved.blend"))
    for guides, hair in names:
        found.add_strands(f"opened {guides}", bpy.data.objects[guides])
        found.add_strands(f"opened {hair}", bpy.data.objects[hair])
    again = bpy.data.objects[names[1][1]]
    again.data.vellus.hair.seed = 77
    update()
    found.add_strands("opened strands of another seed", again)


GROOMS = (cube, suzanne, masked_by_group, masked_by_image, parted, head, carried, hand_made, lit_by_the_world, edited)
