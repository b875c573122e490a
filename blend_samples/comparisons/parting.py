# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/parting.png: a parting by Blender's Interpolate Hair Curves and by Vellus, with a count of stray strands."""

import argparse
import os
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.heads import head
from blend_samples.sheets import picture_files
from hair_addon.blender.data.strands import curves

COUNT = 20_000
SIDE = 500  # pixels of one picture
CAPTION = 64
RADIUS = 1.1e-4  # [m]
NEAR = 0.012  # [m] from the part line
BROWN, SHEEN, ORANGE = (0.10, 0.045, 0.020, 1.0), (0.10, 0.07, 0.05, 1.0), (1.0, 0.32, 0.02, 1.0)


def main():
    """Grow, count and draw all three; the exit status is 0 only if the picture was written."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).resolve().parents[2] / "docs/parting.png")
    out = parser.parse_args().out.resolve()
    hair_addon.register()
    skull = head.build()
    guides, hair = head.grow(skull, guide_count=300, strand_count=COUNT)
    line = draw_part_line(skull)
    grooms = {"Blender, Interpolate Hair Curves": native_strands(guides, skull), "Vellus": strands_of(hair.data)}
    hair.data.vellus.hair.part_lines = line.name
    bpy.context.view_layer.update()
    grooms["Vellus, with a part line"] = strands_of(hair.data)
    combed = strands_of(guides.data)
    for shown in (guides, hair, line):
        shown.hide_render = True
    light()
    pictures, words = [], []
    for column, (name, strands) in enumerate(grooms.items()):
        stray = strays(strands, combed)
        share = stray[is_near(strands)].mean()
        print(f"{name}: {100.0 * share:.1f} % of {is_near(strands).sum()} strands near the part line point across it")
        pictures.append(picture(strands, stray, skull))
        words.append((name, SIDE * column + 16, 26))
        words.append((f"{100.0 * share:.0f} % near the parting point across it", SIDE * column + 16, 50))
    caption = np.full((CAPTION, SIDE * len(pictures), 3), 24, np.uint8)
    picture_files.write(np.concatenate([caption, np.concatenate(pictures, axis=1)]), out, words)


def draw_part_line(skull):
    """Return a poly line on the head where its guides are parted, from the forehead to the nape."""
    data = bpy.data.curves.new("Part Line", "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new("POLY")
    surface = skull.evaluated_get(bpy.context.evaluated_depsgraph_get())
    angles = np.linspace(-0.35 * np.pi, 0.6 * np.pi, 40)
    middle = Vector((head.PARTING, -0.03, 0.74))
    places = []
    for angle in angles:
        away = Vector((0.0, np.sin(angle), np.cos(angle)))
        is_hit, place, _normal, _face = surface.ray_cast(middle + 0.5 * away, -away)
        if is_hit:
            places.append(place)
    spline.points.add(len(places) - 1)
    spline.points.foreach_set("co", np.array([(*place, 1.0) for place in places], np.float32).ravel())
    line = bpy.data.objects.new("Part Line", data)
    bpy.context.scene.collection.objects.link(line)
    return line


def strands_of(datablock):
    """Return (S, P, 3) float32."""
    return curves.read_points(datablock).reshape(len(datablock.curves), -1, 3)


def native_strands(guides, skull):
    """Return (S, P, 3) by Blender's node group as it comes, where the guides grow, and about as many."""
    folder = bpy.utils.system_resource("DATAFILES", path="assets/nodes")
    with bpy.data.libraries.load(os.path.join(folder, "procedural_hair_node_assets.blend"), link=False) as (_, wanted):
        wanted.node_groups = ["Interpolate Hair Curves"]
    copy = bpy.data.objects.new("Native", guides.data.copy())
    copy.parent = skull
    bpy.context.scene.collection.objects.link(copy)
    modifier = copy.modifiers.new("Interpolate", "NODES")
    modifier.node_group = bpy.data.node_groups["Interpolate Hair Curves"]
    inputs = modifier.properties.inputs
    inputs.Input_14.type, inputs.Input_14.attribute_name = "ATTRIBUTE", "scalp"  # density mask
    density = 200_000.0
    for _ in range(3):  # the mask's area is not known
        inputs.Input_15.value = density
        copy.update_tag()
        bpy.context.view_layer.update()
        made = copy.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        density *= COUNT / len(made.curves)
    positions = np.empty((len(made.points), 3), np.float32)
    made.attributes["position"].data.foreach_get("vector", positions.ravel())
    strands = positions.reshape(len(made.curves), -1, 3)
    bpy.data.objects.remove(copy)
    return strands


def is_near(strands):
    """Return (S,) bool: whether strands are rooted beside the parting, on top of the head."""
    roots = strands[:, 0]
    return (np.abs(roots[:, 0] - head.PARTING) < NEAR) & (roots[:, 2] > 0.8)


def strays(strands, combed):
    """Return (S,) bool: strands near the parting that lean to its sides by less than half of what guides there do."""

    def lean(these):
        arm = these[:, these.shape[1] // 4] - these[:, 0]
        return np.abs(arm[:, 0]) / np.linalg.norm(arm, axis=1)

    return is_near(strands) & (lean(strands) < 0.5 * np.median(lean(combed[is_near(combed)])))


def light():
    """A camera above the head, a sun from the left and one from behind, and a gray world."""
    scene = bpy.context.scene
    top = Vector((head.PARTING - 0.012, -0.055, 0.80))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens, camera.data.clip_start = 90.0, 0.01
    camera.location = top + Vector((0.0, -0.14, 0.75))
    head.point_at(camera, top)
    scene.collection.objects.link(camera)
    scene.camera = camera
    for direction, strength in (((-0.7, -0.5, 0.6), 3.0), ((0.5, 0.9, 0.6), 1.5)):
        sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
        sun.data.energy = strength
        sun.rotation_euler = Vector(direction).to_track_quat("Z", "Y").to_euler()
        scene.collection.objects.link(sun)
    world = scene.world = bpy.data.worlds.new("World")
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.25, 0.26, 0.28, 1.0)
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 24, False
    scene.cycles.max_bounces = 1
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.image_settings.file_format = "PNG"


def picture(strands, stray, skull):
    """Return (SIDE, SIDE, 3) uint8, the top row first: strands, those that stray in orange."""
    data = bpy.data.hair_curves.new("Picture")
    data.add_curves([strands.shape[1]] * len(strands))
    data.set_types(type="POLY")
    data.attributes["position"].data.foreach_set("vector", np.ascontiguousarray(strands, np.float32).ravel())
    radii = np.tile(np.linspace(RADIUS, 0.2 * RADIUS, strands.shape[1]), len(strands)).astype(np.float32)
    data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radii)
    data.attributes.new("stray", "FLOAT", "CURVE").data.foreach_set("value", stray.astype(np.float32))
    data.materials.append(_material())
    shown = bpy.data.objects.new("Picture", data)
    shown.parent = skull
    bpy.context.scene.collection.objects.link(shown)
    pixels = picture_files.rendered()
    bpy.data.objects.remove(shown)
    return pixels


def _material():
    """Brown with a sheen along the strands, and plain orange where the attribute `stray` is one."""
    material = bpy.data.materials.new("Hair")
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output, mix, both = (nodes.new(f"ShaderNode{name}") for name in ("OutputMaterial", "MixShader", "AddShader"))
    sheen, brown, stray = (nodes.new(f"ShaderNodeBsdf{name}") for name in ("Hair", "Diffuse", "Diffuse"))
    mask = nodes.new("ShaderNodeAttribute")
    mask.attribute_name = "stray"
    sheen.inputs["Color"].default_value = SHEEN
    brown.inputs["Color"].default_value, stray.inputs["Color"].default_value = BROWN, ORANGE
    links.new(brown.outputs[0], both.inputs[0])
    links.new(sheen.outputs[0], both.inputs[1])
    links.new(mask.outputs["Fac"], mix.inputs["Fac"])
    links.new(both.outputs[0], mix.inputs[1])
    links.new(stray.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], output.inputs["Surface"])
    return material


if __name__ == "__main__":
    main()
