# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes drawn at random: `recipe(seed)` draws one as plain values, `build(recipe)` makes it in Blender.

A body of about two meters (a plane, a sphere or Suzanne), one or two systems of hair or a beard, styles, no to three
lights of any kind, a gray world or a studio's picture, and a camera that may be close or without perspective.
"""

import math

import bpy
import numpy as np
from mathutils import Vector

from hair_addon import api
from hair_addon.core.shading.presets import PRESETS

_STYLES = ("CURL", "WAVE", "FRIZZ", "CLUMP", "BEND", "WET", "BRAID")
_CLOSEST = 0.25  # of the distance at which a camera holds everything


def recipe(seed):
    """Everything that differs between scenes, as plain values by name: the same for the same seed."""
    rng = np.random.default_rng(seed)
    body = _one(rng, ("plane", "sphere", "monkey"))
    is_split = body != "plane" and rng.random() < 0.3
    areas = (("top",), ("beard",), ("top", "beard"))[rng.integers(3)] if is_split else ("",)
    hair = [_hair(rng, area) for area in areas]
    light_count = int(rng.choice([0, 1, 1, 2, 3]))
    color = rng.uniform(0.05, 0.8) * np.array([1.0, rng.uniform(0.5, 1.0), rng.uniform(0.4, 1.0)])
    return {
        "seed": seed,
        "body": body,
        "body_color": None if rng.random() < 0.3 else color.round(3).tolist(),
        "hair": hair,
        "lights": [_light(rng, body) for _ in range(light_count)],
        "world": _world(rng, is_alone=light_count == 0),
        "camera": _camera(rng, body),
    }


def _one(rng, choices):
    return choices[rng.integers(len(choices))]


def _hair(rng, area):
    styles = [_one(rng, _STYLES) for _ in range(rng.integers(1, 3))] if rng.random() < 0.4 else []
    return {
        "area": area,
        "look": _one(rng, list(PRESETS)),
        "roughness": round(rng.uniform(0.15, 0.6), 3) if rng.random() < 0.5 else None,
        "length": round(float(np.exp(rng.uniform(math.log(0.06), math.log(0.9)))), 4),
        "radius": round(float(np.exp(rng.uniform(math.log(0.0006), math.log(0.004)))), 5),
        "strand_count": int(np.exp(rng.uniform(math.log(6e3), math.log(6e4)))),
        "guide_count": int(rng.integers(150, 500)),
        "length_variation": round(rng.uniform(0.0, 0.3), 3),
        "tilt": round(rng.uniform(0.0, 0.9), 3),
        "gravity": round(float(rng.choice([0.0, rng.uniform(0.1, 0.6)])), 3),
        "styles": styles,
        "seed": int(rng.integers(1000)),
    }


def _direction(rng, least_z):
    """Return a unit vector, a list, evenly distributed above a height."""
    z, turn = rng.uniform(least_z, 1.0), rng.uniform(0.0, 2.0 * math.pi)
    across = math.sqrt(1.0 - z * z)
    return [round(across * math.cos(turn), 4), round(across * math.sin(turn), 4), round(z, 4)]


def _light(rng, body):
    # A quarter of the lights behind a plane is below it.
    direction = _direction(rng, -0.33 if body == "plane" else -0.6)
    kind = _one(rng, ("SUN", "POINT", "SPOT", "AREA"))
    saturation = rng.uniform(0.0, 0.8) if rng.random() < 0.4 else 0.0
    color = 1.0 - saturation * rng.random(3)
    return {
        "kind": kind,
        "direction": direction,
        "distance": round(rng.uniform(1.1, 1.8) if rng.random() < 0.15 else rng.uniform(1.8, 5.0), 3),
        "irradiance": round(float(rng.uniform(1.0, 4.0)), 3),  # at the origin, of a small light [W/m²]
        "color": (color / color.max()).round(3).tolist(),
        "size": round(rng.uniform(0.0, 0.3) if kind != "AREA" else float(np.exp(rng.uniform(-2.0, 0.8))), 3),
    }


def _world(rng, is_alone):
    kind = _one(rng, ("grey", "studio") if is_alone else ("black", "black", "grey", "studio"))
    if kind == "black":
        return {"kind": kind}
    strength = rng.uniform(0.3, 1.0) if is_alone else rng.uniform(0.05, 0.5)
    if kind == "grey":
        return {"kind": kind, "strength": round(strength, 3)}
    lamps = []
    for _ in range(rng.integers(1, 5)):
        radiance = rng.uniform(2.0, 25.0) * (1.0 - rng.uniform(0.0, 0.4) * rng.random(3))
        place, size = (rng.uniform(-180, 180), rng.uniform(-20, 70)), rng.uniform(5, 25, 2)
        lamps.append([round(float(value), 2) for value in (*place, *size, *radiance)])
    room = (rng.uniform(0.05, 0.4) * rng.uniform(0.7, 1.0, 3)).round(3).tolist()
    return {"kind": kind, "strength": round(strength, 3), "room": room, "lamps": lamps}


def _camera(rng, body):
    return {
        "direction": _direction(rng, 0.1 if body == "plane" else -0.5),
        "is_orthographic": bool(rng.random() < 0.2),
        "lens": round(rng.uniform(35.0, 85.0), 1),
        "closeness": round(rng.uniform(_CLOSEST, 0.5), 3) if rng.random() < 0.25 else 1.0,
    }


def build(values):
    """Make the scene of a `recipe` in an empty Blender file; returns the hair's Curves."""
    bpy.ops.wm.read_homefile(use_empty=True)
    body = _add_body(values["body"])
    _color(body, values["body_color"])
    curves = [_grow(body, hair) for hair in values["hair"]]
    for light in values["lights"]:
        _add_light(light)
    _set_world(values["world"])
    reach = max(np.linalg.norm(api.points(hair), axis=-1).max() for hair in curves)
    _add_camera(values["camera"], max(float(reach), 1.0))
    bpy.context.view_layer.update()
    return curves


def _add_body(kind):
    if kind == "monkey":
        bpy.ops.mesh.primitive_monkey_add(size=2.0)
    elif kind == "plane":
        bpy.ops.mesh.primitive_grid_add(size=2.0, x_subdivisions=20, y_subdivisions=20)
    else:
        # Blender's UV sphere orders its faces differently each time.
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5, radius=0.9)
    body = bpy.context.object
    body.data.shade_smooth()
    body.is_holdout = True  # only hair is measured
    heights = np.empty((len(body.data.vertices), 3), np.float32)
    body.data.vertices.foreach_get("co", heights.ravel())
    for area, inside in (
        ("top", heights[:, 2] > 0.25),
        ("beard", (heights[:, 2] < -0.1) & (heights[:, 1] < 0.2)),
    ):
        body.vertex_groups.new(name=area).add(np.flatnonzero(inside).tolist(), 1.0, "REPLACE")
    return body


def _color(body, color):
    if color is None:  # without a material surfaces are 0.8
        return
    material = bpy.data.materials.new("Body")
    material.diffuse_color = (*color, 1.0)
    nodes = material.node_tree.nodes
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (*color, 1.0)
    material.node_tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    body.data.materials.append(material)


def _grow(body, hair):
    guides = api.distribute_guides(
        body,
        guide_count=hair["guide_count"],
        seed=hair["seed"],
        length=hair["length"],
        length_variation=hair["length_variation"],
        tilt=hair["tilt"],
        gravity=hair["gravity"],
        density_group=hair["area"],
    )
    curves = api.interpolate_hair(
        guides, strand_count=hair["strand_count"], seed=hair["seed"], radius=hair["radius"], density_group=hair["area"]
    )
    for style in hair["styles"]:
        api.add_style(curves, style)
    changes = {} if hair["roughness"] is None else {"roughness": hair["roughness"]}
    api.shade(curves, hair["look"], model="MARSCHNER", mode="energy", **changes)
    next(found for found in bpy.data.objects if found.data == guides).hide_render = True
    return curves


def _add_light(values):
    kind, distance = values["kind"], values["distance"]
    light = bpy.data.lights.new("Light", kind)
    light.color = values["color"]
    spread = {"SUN": 1.0, "AREA": math.pi * distance**2}.get(kind, 4.0 * math.pi * distance**2)
    light.energy = values["irradiance"] * spread
    if kind == "SUN":
        light.angle = values["size"]
    elif kind == "AREA":
        light.size = values["size"]
    else:
        light.shadow_soft_size = values["size"]
    if kind == "SPOT":
        light.spot_size = math.radians(80.0)
    _place(bpy.data.objects.new("Light", light), Vector(values["direction"]), distance)


def _place(placed, direction, distance):
    placed.location = direction * distance
    placed.rotation_euler = (-direction).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(placed)


def _set_world(values):
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    color, strength = background.inputs["Color"], background.inputs["Strength"]
    color.default_value, strength.default_value = (1.0, 1.0, 1.0, 1.0), values.get("strength", 0.0)
    if values["kind"] == "studio":
        texture = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
        texture.image = _studio(values["room"], values["lamps"])
        world.node_tree.links.new(texture.outputs["Color"], color)


def _studio(room, lamps, width=512, height=256):
    """Return a picture by longitude and latitude [degrees]: a room that is brighter above, and lamps with soft
    borders.
    """
    longitude = 180.0 - 360.0 * (np.arange(width) + 0.5) / width
    latitude = 180.0 * (np.arange(height) + 0.5) / height - 90.0
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = (1.0 + 0.6 * np.sin(np.radians(latitude)))[:, None, None] * np.array(room)
    for middle, high, half_width, half_height, *radiance in lamps:
        turn = (longitude - middle + 180.0) % 360.0 - 180.0
        across = np.abs(turn) * np.cos(np.radians(high)) / half_width
        inside = np.maximum(across[None, :], np.abs(latitude - high)[:, None] / half_height)
        pixels[..., :3] += np.clip(4.0 * (1.0 - inside), 0.0, 1.0)[..., None] * np.array(radiance)
    image = bpy.data.images.new("Studio", width, height, float_buffer=True, is_data=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image


def _add_camera(values, reach):
    camera = bpy.data.cameras.new("Camera")
    camera.clip_start = 0.01
    direction = Vector(values["direction"])
    target = direction * (0.5 * reach * (1.0 - values["closeness"]))
    size = 2.2 * reach * values["closeness"]  # [m] that the picture is wide
    if values["is_orthographic"]:
        camera.type, camera.ortho_scale, distance = "ORTHO", size, 4.0 * reach
    else:
        camera.lens = values["lens"]
        distance = max(size * values["lens"] / camera.sensor_width, 1.1 * (reach - target.length))
    placed = bpy.data.objects.new("Camera", camera)
    _place(placed, direction, distance)
    placed.location += target
    bpy.context.scene.camera = placed
