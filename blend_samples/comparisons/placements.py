# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/guide_placement.png: 400 guides on the scalp, random, by Blender's Poisson disks, and as Vellus places them."""

import argparse
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from blend_samples.heads import head
from blend_samples.sheets import picture_files
from hair_addon.blender.data import scene
from hair_addon.core.geometry import sampling
from hair_addon.core.geometry.mesh import normals, positions
from hair_addon.core.grooming.groom import GuideSettings
from hair_addon.core.placement import cvt

COUNT = 400
SIDE = 520  # pixels of one picture
CAPTION = 44
DOT = 0.0024  # [m]


def main():
    """Draw all three; the exit status is 0 only if the picture was written."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).resolve().parents[2] / "docs/guide_placement.png")
    out = parser.parse_args().out.resolve()
    skull = head.build()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    mesh = scene.read_surface(skull, depsgraph).mesh
    density = scene.read_vertex_group(skull, depsgraph, "scalp")
    chance = sampling.sample_surface(mesh, COUNT, 1, density)
    placed = cvt.place(mesh, COUNT, 1, GuideSettings().relax_iterations, density=density)
    ways = {
        "random": positions(mesh, chance) + DOT / 3 * normals(mesh, chance),
        "Poisson disks": _poisson_disks(skull),
        "Vellus": positions(mesh, placed) + DOT / 3 * normals(mesh, placed),
    }
    _light()
    pictures = [_picture(places) for places in ways.values()]
    words = [(f"{name}, {len(places)} guides", SIDE * i + 14, 28) for i, (name, places) in enumerate(ways.items())]
    caption = np.full((CAPTION, SIDE * len(ways), 3), 24, np.uint8)
    sheet = np.concatenate([caption, np.concatenate(pictures, axis=1)])
    picture_files.write(sheet, out, words, picture_files.PAGE_BITS)


def _poisson_disks(skull):
    """Return (n, 3): Blender's node on the scalp, the distance halved to and fro until nearly as many come."""
    group = bpy.data.node_groups.new("Poisson", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    names = ("NodeGroupInput", "GeometryNodeInputNamedAttribute", "GeometryNodeDistributePointsOnFaces")
    names += ("GeometryNodePointsToVertices", "NodeGroupOutput")
    into, weight, distribute, vertices, out = (group.nodes.new(name) for name in names)
    weight.inputs["Name"].default_value = "scalp"
    distribute.distribute_method = "POISSON"
    group.links.new(into.outputs[0], distribute.inputs["Mesh"])
    group.links.new(weight.outputs["Attribute"], distribute.inputs["Density Factor"])
    group.links.new(distribute.outputs["Points"], vertices.inputs["Points"])
    group.links.new(vertices.outputs[0], out.inputs[0])
    skull.modifiers.new("Poisson", "NODES").node_group = group
    low, high = 0.001, 0.03
    for _ in range(14):
        distance = 0.5 * (low + high)
        distribute.inputs["Distance Min"].default_value = distance
        distribute.inputs["Density Max"].default_value = 4.0 / distance**2
        skull.update_tag()
        found = skull.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
        places = np.empty((len(found.vertices), 3), np.float32)
        found.vertices.foreach_get("co", places.ravel())
        low, high = (distance, high) if len(places) > COUNT else (low, distance)
    skull.modifiers.remove(skull.modifiers["Poisson"])
    return places


def _light():
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    next(n for n in world.node_tree.nodes if n.type == "BACKGROUND").inputs["Color"].default_value = (
        0.6,
        0.6,
        0.6,
        1.0,
    )
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = 165.0
    camera.data.clip_start = 0.01
    camera.location = (0.45, 0.75, 1.25)
    head.point_at(camera, (0.0, -0.01, 0.765))
    bpy.context.scene.collection.objects.link(camera)
    lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    lamp.data.energy = 2.0
    lamp.rotation_euler = (0.5, 0.4, 0.0)
    bpy.context.scene.collection.objects.link(lamp)
    drawn = bpy.context.scene
    drawn.camera = camera
    drawn.render.engine, drawn.cycles.samples, drawn.cycles.use_denoising = "CYCLES", 24, True
    drawn.render.resolution_x = drawn.render.resolution_y = SIDE
    drawn.render.image_settings.file_format = "PNG"
    drawn.view_settings.view_transform = "Standard"


def _picture(places):
    """Return (SIDE, SIDE, 3) uint8, the top row first: the head with a dot at each place."""
    corners, faces = _ball()
    vertices = (places[:, None] + DOT * corners).reshape(-1, 3)
    every = (np.arange(len(places))[:, None, None] * len(corners) + faces).reshape(-1, 3)
    cloud = bpy.data.meshes.new("Dots")
    cloud.from_pydata(vertices.tolist(), [], every.tolist())
    cloud.shade_smooth()
    material = bpy.data.materials.new("Dots")
    node = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    node.inputs["Base Color"].default_value = (0.02, 0.05, 0.25, 1.0)
    cloud.materials.append(material)
    dots = bpy.data.objects.new("Dots", cloud)
    bpy.context.scene.collection.objects.link(dots)
    pixels = picture_files.rendered()
    bpy.data.objects.remove(dots)
    return pixels


def _ball():
    """Return (V, 3) vertices and (F, 3) triangles of a ball of radius 1."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=1.0)
    ball = bpy.context.object
    vertices = np.array([vertex.co for vertex in ball.data.vertices])
    triangles = np.array([polygon.vertices for polygon in ball.data.polygons])
    bpy.data.objects.remove(ball)
    return vertices, triangles


if __name__ == "__main__":
    main()
