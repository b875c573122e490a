# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights whose nodes Cycles renders arrive at hair as in Cycles, and are rendered again only if nodes change."""

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector

from hair_addon.blender.data.pictures import light_panoramas, picture_jobs, world_panoramas
from hair_addon.blender.gpu import lights
from hair_addon.blender.io.pictures import light_panorama
from hair_addon.core.errors import HairError

IES = """IESNA:LM-63-2002
TILT=NONE
1 -1 1.0 5 5 1 2 0 0 0
1.0 1.0 0
0 22.5 45 67.5 90
0 90 180 270 360
1000 800 300 50 0
1000 700 200 20 0
1000 900 600 90 0
1000 500 100 10 0
1000 800 300 50 0
"""
PLACE = np.array([[0.3, 0.2, 0.1]])  # of hair [m]


def emission(tree, name):
    return next(node for node in tree.nodes if node.type == "EMISSION").inputs[name]


def ies(tree):
    node = tree.nodes.new("ShaderNodeTexIES")
    node.ies = bpy.data.texts.new("Lamp")
    node.ies.write(IES)
    tree.links.new(node.outputs[0], emission(tree, "Strength"))


def tinted(tree, kind="ShaderNodeTexCoord", output="Normal"):
    """Color a light by its directions, or by the places on it."""
    tint = tree.nodes.new("ShaderNodeVectorMath")
    tint.operation = "MULTIPLY_ADD"
    tint.inputs[1].default_value, tint.inputs[2].default_value = (0.5, 0.4, -0.3), (0.6, 0.5, 0.4)
    tree.links.new(tree.nodes.new(kind).outputs[output], tint.inputs[0])
    tree.links.new(tint.outputs[0], emission(tree, "Color"))


def in_world(tree):
    tinted(tree, "ShaderNodeNewGeometry", "Normal")


def on_area(tree):
    tinted(tree, "ShaderNodeNewGeometry", "Parametric")


def mixed(tree):
    add, second = tree.nodes.new("ShaderNodeAddShader"), tree.nodes.new("ShaderNodeEmission")
    second.inputs["Color"].default_value = 0.2, 0.4, 0.9, 1.0
    tree.links.new(emission(tree, "Color").node.outputs[0], add.inputs[0])
    tree.links.new(second.outputs[0], add.inputs[1])
    tree.links.new(add.outputs[0], tree.get_output_node("ALL").inputs["Surface"])


def aslant(x, y, z, scale=(1.0, 1.0, 1.0)):
    turn = (Vector(PLACE[0]) - Vector((x, y, z))).to_track_quat("-Z", "Y").to_matrix()
    turn = Euler((0.15, -0.1, 0.0)).to_matrix() @ turn
    return Matrix.Translation((x, y, z)) @ turn.to_4x4() @ Matrix.Diagonal((*scale, 1.0))


LIGHTS = {
    "point, tinted": ("POINT", aslant(1.0, -1.0, 1.5), tinted),
    "point, IES": ("POINT", aslant(0.5, 1.0, 1.0), ies),
    "point, IES, scaled": ("POINT", aslant(0.5, 1.0, 1.0, (2.0, 2.0, 2.0)), ies),
    "point, mirrored": ("POINT", aslant(1.0, -1.0, 1.5, (-1.0, 1.0, 1.0)), tinted),
    "point, unevenly scaled": ("POINT", aslant(1.0, -1.0, 1.5, (3.0, -1.0, 0.5)), tinted),
    "point, by the world's axes, unevenly scaled": ("POINT", aslant(1.0, -1.0, 1.5, (3.0, 1.0, 0.5)), in_world),
    "spot, tinted": ("SPOT", aslant(-1.0, -1.5, 0.5), tinted),
    "spot, by the world's axes": ("SPOT", aslant(-1.0, -1.5, 0.5), in_world),
    "area, by places": ("AREA", aslant(1.0, 2.0, 2.0), on_area),
    "sun, mixed": ("SUN", aslant(0.0, 1.0, 2.0), mixed),
}


def add_light(scene, kind, matrix, nodes):
    light = bpy.data.lights.new("Lamp", kind)
    light.energy, light.color = 2.0 if kind == "SUN" else 100.0, (1.0, 0.9, 0.8)
    if kind == "AREA":
        light.size = 0.2
    lamp = bpy.data.objects.new("Lamp", light)
    scene.collection.objects.link(lamp)
    lamp.matrix_world = matrix
    nodes(light.node_tree)
    return lamp


def by_cycles(scene, matrix, folder):
    """Return the RGB of a small white plane at the place of hair that faces a light, by Cycles."""
    turn = matrix.to_quaternion() if scene.objects["Lamp"].data.type == "SUN" else None
    away = turn @ Vector((0, 0, 1)) if turn else matrix.translation - Vector(PLACE[0])
    facing = Matrix.Translation(PLACE[0]) @ away.to_track_quat("Z", "Y").to_matrix().to_4x4()
    mesh = bpy.data.meshes.new("Plane")
    mesh.from_pydata([(-1e-3, -1e-3, 0), (1e-3, -1e-3, 0), (1e-3, 1e-3, 0), (-1e-3, 1e-3, 0)], [], [(0, 1, 2, 3)])
    plane = bpy.data.objects.new("Plane", mesh)
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale, camera.clip_start = "ORTHO", 1e-3, 1e-4
    scene.camera = bpy.data.objects.new("Camera", camera)
    for one in (plane, scene.camera):
        scene.collection.objects.link(one)
    plane.matrix_world, scene.camera.matrix_world = facing, facing @ Matrix.Translation((0, 0, 0.1))
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 512
    scene.cycles.use_denoising, scene.cycles.max_bounces = False, 0
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(folder / "plane.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.reshape(image.pixels, (-1, 4))[:, :3].mean(axis=0)
    bpy.data.images.remove(image)
    bpy.data.objects.remove(plane)
    return pixels


def without_nodes(light):
    """Let a light shine evenly."""
    plain = light.node_tree.nodes.new("ShaderNodeEmission")
    plain.inputs["Strength"].default_value = 1.0
    light.node_tree.links.new(plain.outputs[0], light.node_tree.get_output_node("ALL").inputs["Surface"])


@pytest.mark.parametrize(
    "name", [name if name.endswith("IES") else pytest.param(name, marks=pytest.mark.long) for name in LIGHTS]
)
def test_light_of_nodes_arrives_as_in_cycles(scene, tmp_path, monkeypatch, name):
    """The factor toward hair is that of Cycles within 2 %, for moved, turned, scaled and mirrored lights."""
    kind, matrix, nodes = LIGHTS[name]
    lamp = add_light(scene, kind, matrix, nodes)
    options = []

    def kept_or_rendered(_kind, light, _path, _waits, frame, matrix):
        options.append(matrix)
        bpy.data.libraries.write(str(tmp_path / "light.blend"), {light.original}, fake_user=True)

    monkeypatch.setattr(world_panoramas, "kept_or_rendered", kept_or_rendered)
    evaluated = lamp.evaluated_get(bpy.context.evaluated_depsgraph_get())
    place, is_scaled = np.array(lamp.matrix_world), light_panoramas._is_scaled(evaluated.data)
    assert light_panoramas.find(evaluated.data, place, 1.0, False) is None
    shone = by_cycles(scene, matrix, tmp_path)
    without_nodes(lamp.data)
    shone /= by_cycles(scene, matrix, tmp_path)
    light_panorama.render(tmp_path / "light.blend", "Lamp", options[0], 1.0, False, tmp_path / "light.npz")
    factor = light_panoramas._read(tmp_path / "light.npz", is_scaled).factor(place, PLACE)
    np.testing.assert_allclose(factor, shone, rtol=0.02)


@pytest.mark.parametrize("damaged_count", [1, 2])
def test_a_damaged_panorama_is_rendered_again(scene, tmp_path, monkeypatch, damaged_count):
    """A render waits for another panorama, or fails if that one is damaged too. A view has the plain light."""
    kind, matrix, nodes = LIGHTS["point, tinted"]
    light = add_light(scene, kind, matrix, nodes).evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    path, made = tmp_path / f"{damaged_count}.npz", []

    def kept_or_rendered(*_given, **_values):
        if not path.exists():
            np.savez(path, lit=np.ones((4, 8, 3)), plain=np.ones((4, 8)))
            made.append(path.read_bytes())
            path.write_bytes(made[-1][:200] if len(made) <= damaged_count else made[-1])
        return path

    monkeypatch.setattr(world_panoramas, "kept_or_rendered", kept_or_rendered)
    if damaged_count == 1:
        assert light_panoramas.find(light, np.eye(4), 1.0, False) is None
        assert light_panoramas.find(light, np.eye(4), 1.0, True).lit.shape == (4, 8, 3)
    else:
        with pytest.raises(HairError, match="damaged"):
            light_panoramas.find(light, np.eye(4), 1.0, True)
    assert len(made) == 2


def test_hair_receives_the_mean_of_its_places():
    """The factor is the light at all places relative to that without nodes; without light, that of all directions."""
    lit, plain = np.zeros((64, 128, 3)), np.ones((64, 128))
    lit[:32] = 4.0  # below
    panorama = light_panoramas.Panorama(lit, plain)
    places = np.array([[0.0, 0.1, -1.0], [0.1, 0.0, 2.0]])
    turned = np.array(Matrix.Translation((1.0, 2.0, 3.0)) @ Euler((1.0, 0.5, 0.2)).to_matrix().to_4x4())
    moved = places @ turned[:3, :3].T + turned[:3, 3]
    weights = 1.0 / np.square(np.linalg.norm(places, axis=1))
    np.testing.assert_allclose(panorama.factor(turned, moved), np.full(3, 4.0 * weights[0] / weights.sum()))
    np.testing.assert_allclose(panorama.factor(turned, ()), np.full(3, 2.0))
    dark = light_panoramas.Panorama(lit, np.where(np.arange(64)[:, None] < 32, plain, 0.0))
    np.testing.assert_allclose(dark.factor(turned, moved[1:]), np.full(3, 4.0))


@pytest.mark.farm
def test_another_process_renders_a_light_once(scene):
    """The power of a light has the factor of its nodes; a moved light is not rendered again, a changed one is."""
    lamp = add_light(scene, "POINT", aslant(1.0, -1.0, 1.5), mixed)

    def power():
        (found,), *_others = lights.read_lights(bpy.context.evaluated_depsgraph_get(), True, PLACE)
        return found["power"][:3]

    lit = power()
    path = picture_jobs.last_of(lamp.data)
    lamp.location.x = 0.5
    np.testing.assert_allclose(power(), lit, rtol=0.01)
    assert picture_jobs.last_of(lamp.data) == path
    without_nodes(lamp.data)
    np.testing.assert_allclose(lit / power(), (1.2, 1.4, 1.9), rtol=0.01)
