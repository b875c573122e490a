# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights have the same brightness in the shaders and in Cycles, measured on a white wall."""

import math

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix

from hair_addon.blender.gpu import lights as door
from hair_addon.blender.gpu.programs import uniforms
from hair_addon.core.imaging import lamps
from tests.support.pictures import glsl

SIZE = 17  # pixels along a side of the picture
WALL = 4.0  # meters along a side of the picture
SMALL = 0.002  # of a light, which the shaders take for a point [m]
ABOVE = Matrix.Translation((0.2, -0.1, 2.0))
ASLANT = Matrix.Translation((-0.5, 0.3, 1.5)) @ Euler((0.5, 0.2, 0.3)).to_matrix().to_4x4()


@pytest.fixture
def wall(scene):
    """Return a scene of a matte white wall in the plane z = 0, seen from the front by Cycles, without lights."""
    mesh = bpy.data.meshes.new("Wall")
    mesh.from_pydata([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("White")
    nodes = material.node_tree.nodes
    nodes.clear()
    white, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    white.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    material.node_tree.links.new(white.outputs["BSDF"], output.inputs["Surface"])
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("Wall", mesh))
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", WALL
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.location.z = 1.0
    scene.collection.objects.link(scene.camera)

    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.max_bounces = "CPU", 64, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    # A sample is a pixel's middle, not its area: the edge of a cone stays where it is.
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 0.01
    return scene


def add_light(scene, kind, matrix, **settings):
    light = bpy.data.lights.new("Light", kind)
    for name, value in settings.items():
        setattr(light, name, value)
    light_object = bpy.data.objects.new("Light", light)
    light_object.matrix_world = matrix
    scene.collection.objects.link(light_object)


def cycles_irradiance(scene, folder):
    """Return (SIZE², 3) irradiance [W/m²] of the wall by Cycles, from the radiance E / pi of a white matte wall."""
    scene.render.filepath = str(folder / "wall.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(SIZE * SIZE * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return math.pi * pixels.reshape(-1, 4)[:, :3]


def shader_irradiance(lights):
    """Return (SIZE², 3) irradiance of the wall by the shaders' functions, from a `uniforms.LIGHTS` record."""
    middles = (np.arange(SIZE) + 0.5) / SIZE * WALL - 0.5 * WALL
    x, y = (grid.ravel() for grid in np.meshgrid(middles, middles))
    text = glsl.source("light/lights.glsl") + (
        "vec3 irradiance(Light light, vec3 at)\n"
        "{\n"
        "  vec3 facing = light_irradiance(light.kind, light.position.xyz, light.axis.xyz, light.power.rgb,\n"
        "                                 light.cos_cone, light.blend, light.radius, at);\n"
        "  return facing * max(to_light(light.kind, light.position.xyz, light.axis.xyz, at).z, 0.0);\n"
        "}\n"
    )
    structs = uniforms.LIGHT.source + uniforms.LIGHTS.source
    blocks = {"lights": ("Lights", lights)}
    wall = np.stack([x, y, np.zeros_like(x)], axis=-1)
    return glsl.evaluate(text, "vec3", "irradiance(lights.light[0], at)", structs=structs, blocks=blocks, at=wall)


LIGHTS = {
    "sun": ("SUN", ASLANT, {"energy": 3.0, "angle": 0.01}),
    "sun, not normalised": ("SUN", ABOVE, {"energy": 3.0, "angle": 0.1, "normalize": False}),
    "sun without size, not normalised": ("SUN", ABOVE, {"energy": 3.0, "angle": 0.0, "normalize": False}),
    "point": ("POINT", ABOVE, {}),
    "point, coloured": ("POINT", ABOVE, {"color": (1.0, 0.5, 0.2)}),
    "point, brighter by exposure": ("POINT", ABOVE, {"exposure": 1.5}),
    "point, warm": ("POINT", ABOVE, {"use_temperature": True, "temperature": 3000.0, "color": (0.9, 1.0, 0.8)}),
    "point, not normalised": ("POINT", ABOVE, {"normalize": False}),
    "point without size, not normalised": ("POINT", ABOVE, {"normalize": False, "shadow_soft_size": 0.0}),
    "point, scaled, not normalised": ("POINT", ABOVE @ Matrix.Scale(2.0, 4), {"normalize": False}),
    "spot": ("SPOT", ABOVE, {"spot_size": 1.0, "spot_blend": 0.0}),
    "spot, soft": ("SPOT", ABOVE, {"spot_size": 1.2, "spot_blend": 0.5}),
    "spot, aslant": ("SPOT", ASLANT, {"spot_size": 1.4, "spot_blend": 1.0}),
    "spot, not normalised": ("SPOT", ABOVE, {"spot_size": 1.0, "spot_blend": 0.5, "normalize": False}),
    "square": ("AREA", ABOVE, {"shape": "SQUARE"}),
    "square, aslant": ("AREA", ASLANT, {"shape": "SQUARE"}),
    "square, scaled": ("AREA", ABOVE @ Matrix.Scale(1.5, 4), {"shape": "SQUARE"}),
    "rectangle": ("AREA", ABOVE, {"shape": "RECTANGLE"}),
    "disk": ("AREA", ABOVE, {"shape": "DISK"}),
    "ellipse": ("AREA", ABOVE, {"shape": "ELLIPSE"}),
    "square, not normalised": ("AREA", ABOVE, {"shape": "SQUARE", "normalize": False}),
    "rectangle, stretched": ("AREA", ABOVE @ Matrix.Diagonal((2, 3, 5, 1)), {"shape": "RECTANGLE", "normalize": False}),
    "disk, not normalised": ("AREA", ABOVE, {"shape": "DISK", "normalize": False}),
    "ellipse, not normalised": ("AREA", ABOVE, {"shape": "ELLIPSE", "normalize": False}),
    "square, gathered": ("AREA", ABOVE, {"shape": "SQUARE", "spread": math.radians(100.0)}),
    "square, beam": ("AREA", ASLANT, {"shape": "SQUARE", "spread": math.radians(40.0)}),
}


@pytest.mark.parametrize("name", LIGHTS)
def test_irradiance_equals_cycles(wall, tmp_path, name):
    kind, matrix, settings = LIGHTS[name]
    if kind != "SUN":
        settings = {"energy": 100.0, "shadow_soft_size": SMALL, **settings}
    if kind == "AREA":
        settings = {"size": SMALL, "size_y": 2.0 * SMALL, **settings}
    add_light(wall, kind, matrix, **settings)
    rendered = cycles_irradiance(wall, tmp_path)
    found, *_others = door.read_lights(bpy.context.evaluated_depsgraph_get(), for_render=True)
    assert len(found) == 1
    lights = uniforms.LIGHTS.record()
    lights["light"][:1] = found
    computed = shader_irradiance(lights)
    assert rendered.max() > 0.0
    # A pixel may lie where a hard cone ends for one part of the light and not for another.
    is_close = np.isclose(computed, rendered, rtol=0.01, atol=2e-3 * rendered.max()).all(axis=1)
    assert (~is_close).sum() <= 4, (computed[~is_close], rendered[~is_close])


def test_a_scene_without_lights_is_dark(wall):
    assert len(door.read_lights(bpy.context.evaluated_depsgraph_get(), for_render=True)[0]) == 0


@pytest.mark.parametrize("radius", [0.02, 0.4, 1.5])
def test_a_disk_lights_by_its_solid_angle(radius):
    """The irradiance of small balls above and beside a disk equals the integral over the disk."""
    height, beside = (grid.ravel() for grid in np.meshgrid([0.2, 0.5, 1.0, 3.0], [0.0, 0.3, 0.7, 1.2, 2.5]))
    part, turn = (np.arange(400) + 0.5) / 400, 2.0 * np.pi * (np.arange(200) + 0.5) / 200
    out = radius * np.sqrt(part)[:, None]
    x, y = out * np.cos(turn), out * np.sin(turn)
    received = [np.mean(h / (h**2 + (x - b) ** 2 + y**2) ** 1.5) for h, b in zip(height, beside, strict=True)]
    found = glsl.evaluate(
        glsl.source("light/lights.glsl"),
        "float",
        f"disk_irradiance(height, beside, {radius})",
        structs=uniforms.LIGHT.source,
        height=height.astype(np.float32),
        beside=beside.astype(np.float32),
    )
    np.testing.assert_allclose(found, received, rtol=0.2)  # where the disk's edge is next to the ball
    assert np.mean(np.abs(found / received - 1.0)) < 0.06
    np.testing.assert_allclose(found[beside == 0.0], np.array(received)[beside == 0.0], rtol=2e-3)


def test_python_has_the_irradiance_of_the_shaders(rng):
    """Python and the shaders compute the same irradiance for lamps of all kinds, inside and outside their cones and
    beams.
    """
    count = 400
    some = np.zeros(count, uniforms.LIGHT.dtype)
    some["kind"] = np.arange(count) % 4
    some["position"][:, :3] = rng.normal(size=(count, 3)) * 3.0
    axes = rng.normal(size=(count, 3)) - some["position"][:, :3]
    some["axis"][:, :3] = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    some["power"][:, :3], some["radius"] = rng.uniform(0.0, 100.0, (count, 3)), rng.uniform(0.0, 2.0, count)
    some["cos_cone"] = np.where(rng.random(count) < 0.2, 0.0, rng.uniform(0.0, 0.95, count))
    some["blend"] = rng.uniform(0.0, 1.0, count)
    places = rng.normal(size=(count, 3))
    given = {name: some[name][:, :3] if some[name].ndim == 2 else some[name] for name in some.dtype.names}
    names = ("kind", "position", "axis", "power", "cos_cone", "blend", "radius")
    shown = glsl.evaluate(
        glsl.source("light/lights.glsl"),
        "vec3",
        f"light_irradiance({', '.join(names)}, place)",
        structs=uniforms.LIGHT.source,
        **{name: given[name] for name in names},
        place=places.astype(np.float32),
    )
    computed = np.concatenate(
        [lamps.irradiance(some[i : i + 1], places[i : i + 1].astype(np.float32))[0] for i in range(count)]
    )
    assert (computed.max(axis=1) > 0.0).mean() > 0.4
    np.testing.assert_allclose(computed, shown, rtol=2e-3, atol=1e-4 * shown.max())
