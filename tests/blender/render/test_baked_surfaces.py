# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of any nodes are baked once by Cycles, and surfaces and the light they reflect have their colors."""

import os
import sys
import time

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.pictures import (
    drawn_meshes,
    kept_files,
    picture_jobs,
    surface_bakes,
    surface_materials,
    unread_nodes,
)
from hair_addon.blender.host import background_process, cli_command
from hair_addon.blender.io.pictures import surface_bake
from hair_addon.blender.render import offscreen
from hair_addon.core.errors import HairError
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from tests.support.pictures.rendering import add_orthographic_camera

SIZE = 48


@pytest.fixture
def stage(scene):
    """Return a scene with a sun, an even world and a camera that looks along Y at two meters."""
    add_orthographic_camera(scene)
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = 2.0, 0.3
    sun = bpy.data.objects.new("Sun", light)
    sun.rotation_euler = (0.9, 0.3, 0.0)
    scene.collection.objects.link(sun)
    scene.world = bpy.data.worlds.new("World")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.3, 0.35, 0.4, 1.0)
    return scene


def wall(material):
    """Return a mesh that faces the camera, without a UV map, with a material."""
    bpy.ops.mesh.primitive_grid_add(size=1.6, x_subdivisions=5, y_subdivisions=3, rotation=(1.5708, 0.0, 0.0))
    placed = bpy.context.object
    placed.data.uv_layers.remove(placed.data.uv_layers[0])
    placed.data.materials.append(material)
    return placed


def node(tree, kind, target=None, coordinates=True, **inputs):
    made = tree.nodes.new(kind)
    for name, value in inputs.items():
        made.inputs[name].default_value = value
    if coordinates:
        tree.links.new(tree.nodes["Coordinates"].outputs["Object"], made.inputs["Vector"])
    if target is not None:
        tree.links.new(made.outputs[0], target)
    return made


def new_tree(name):
    """Return a material, its tree with coordinates, and its Principled BSDF."""
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.new("ShaderNodeTexCoord").name = "Coordinates"
    return material, tree, tree.nodes["Principled BSDF"]


def bricks():
    """Return a material of bricks with noisy roughness."""
    material, tree, shader = new_tree("Bricks")
    node(tree, "ShaderNodeTexBrick", shader.inputs["Base Color"], Scale=2.0, Color1=(0.7, 0.2, 0.1, 1.0))
    node(tree, "ShaderNodeTexNoise", shader.inputs["Roughness"], Scale=2.0)
    return material


def layered():
    """Return a material whose shaders, one of them in a group, are mixed by a voronoi texture."""
    material, tree, shader = new_tree("Layered")
    shader.inputs["Base Color"].default_value = (0.1, 0.5, 0.8, 1.0)
    shader.inputs["Specular IOR Level"].default_value = 0.0
    inside = bpy.data.node_groups.new("Coat", "ShaderNodeTree")
    inside.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    diffuse = inside.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (0.9, 0.6, 0.1, 1.0)
    inside.links.new(diffuse.outputs[0], inside.nodes.new("NodeGroupOutput").inputs[0])
    group, mix = tree.nodes.new("ShaderNodeGroup"), tree.nodes.new("ShaderNodeMixShader")
    group.node_tree = inside
    node(tree, "ShaderNodeTexVoronoi", mix.inputs[0], Scale=3.0)
    tree.links.new(shader.outputs[0], mix.inputs[1])
    tree.links.new(group.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    return material


def by_cycles(tmp_path):
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 64, False
    scene.cycles.max_bounces, scene.cycles.pixel_filter_type = 0, "BOX"
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.resolution_percentage, scene.render.film_transparent = 100, True
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(tmp_path / "cycles.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath, check_existing=False)
    return np.array(image.pixels[:], np.float32).reshape(SIZE, SIZE, 4)


def regions(picture):
    """Return the mean colors of 6 × 6 parts of a picture that the surface covers."""
    inner = picture[6:-6, 6:-6, :3]
    return inner.reshape(6, 6, 6, 6, 3).mean(axis=(1, 3))


@pytest.mark.farm
def test_baked_surfaces_are_as_in_cycles(stage, tmp_path):
    """A wall of bricks of varied roughness, and one of mixed shaders, have the colors of Cycles within 2 %, as does the
    light that they reflect; both are baked once.
    """
    walls = [wall(bricks()), wall(layered())]
    walls[1].location.z = 50.0
    stage.view_layers[0].update()
    for shown in (0, 1):
        walls[shown].location.z, walls[1 - shown].location.z = 0.0, 50.0
        bpy.context.view_layer.update()
        drawn = offscreen.draw_picture(PictureSettings(SIZE, SIZE, 4, is_transparent=True))
        expected = regions(by_cycles(tmp_path))
        assert np.abs(regions(drawn) / expected - 1.0).mean() < 0.02
        depsgraph = bpy.context.evaluated_depsgraph_get()
        (mesh,) = (one for one in drawn_meshes.read_drawn_meshes(depsgraph) if one.to_world[2, 3] == 0.0)
        ((_count, color),) = mesh.colors
        np.testing.assert_allclose(mesh.triangle_materials[:, :3].mean(axis=0), color, rtol=0.02)
    assert not picture_jobs.sentences()


def plain_color(name, color):
    """Return a material with one color by a node that is baked, and the node's socket Value, a factor."""
    material, tree, shader = new_tree(name)
    changed = node(tree, "ShaderNodeHueSaturation", shader.inputs["Base Color"], coordinates=False)
    changed.inputs["Color"].default_value = (*color, 1.0)
    return material, changed.inputs["Value"]


def linked_wall(name, color, path):
    """Return a wall that is linked from a file."""
    placed = wall(plain_color(name, color)[0])
    placed.name = name
    bpy.data.libraries.write(str(path), {placed})
    bpy.data.objects.remove(placed)
    with bpy.data.libraries.load(str(path), link=True) as (_names, wanted):
        wanted.objects = [name]
    bpy.context.collection.objects.link(wanted.objects[0])
    return wanted.objects[0]


@pytest.mark.farm
def test_each_material_of_each_object_is_baked(stage, tmp_path, monkeypatch):
    """One job bakes objects with several materials and drivers, linked objects, objects with custom properties, and
    images with unsaved pixels; copies are baked once. An object that cannot be baked leaves the others as they are, and
    removed pictures are baked again.
    """
    baked, start = [], picture_jobs.PictureJob.__init__
    monkeypatch.setattr(
        picture_jobs.PictureJob,
        "__init__",
        lambda self, kind, objects, *given: (baked.append(len(objects)), start(self, kind, objects, *given))[1],
    )
    (red, value), (blue, _value), (gray, factor) = (
        plain_color(name, color)
        for name, color in (("Red", (0.8, 0.1, 0.1)), ("Blue", (0.1, 0.2, 0.8)), ("Gray", (0.5,) * 3))
    )
    value.driver_add("default_value").driver.expression = "frame / 20"
    stage.frame_set(10)
    full, both = wall(red), wall(red)
    for _layer in range(8):
        full.data.uv_layers.new()
    both.data.materials.append(blue)
    for polygon in both.data.polygons:
        polygon.material_index = polygon.index % 2
    stage.collection.objects.link(both.copy())
    head = linked_wall("Head", (0.3, 0.6, 0.1), tmp_path / "head.blend")
    dirty = wall(gray)
    dirty["dirt"] = 0.4
    attribute = gray.node_tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_type, attribute.attribute_name = "OBJECT", "dirt"
    gray.node_tree.links.new(attribute.outputs["Fac"], factor)
    skin, image = plain_color("Skin", (0.0, 0.0, 0.0))[0], bpy.data.images.new("Skin", 4, 4, float_buffer=True)
    painted = wall(skin)
    texture = node(skin.node_tree, "ShaderNodeTexImage", coordinates=False)
    texture.image = image
    changed = next(one for one in skin.node_tree.nodes if one.type == "HUE_SAT")
    skin.node_tree.links.new(texture.outputs["Color"], changed.inputs["Color"])

    def paint(color):
        image.pixels.foreach_set(np.tile(np.array((*color, 1.0), np.float32), 16))

    def colors():
        bpy.context.view_layer.update()
        meshes = drawn_meshes.read_drawn_meshes(bpy.context.evaluated_depsgraph_get())
        return {mesh.owner[0]: [color for _count, color in mesh.colors] for mesh in meshes}

    paint((0.1, 0.2, 0.3))
    found = colors()
    np.testing.assert_allclose(found[both.session_uid], [(0.4, 0.05, 0.05), (0.1, 0.2, 0.8)], atol=1e-3)
    np.testing.assert_allclose(found[head.session_uid], [(0.3, 0.6, 0.1)], atol=1e-3)
    np.testing.assert_allclose(found[dirty.session_uid], [(0.2, 0.2, 0.2)], atol=1e-3)
    np.testing.assert_allclose(found[painted.session_uid], [(0.1, 0.2, 0.3)], atol=1e-3)
    assert baked == [5]
    ((sentence, _is_error),) = picture_jobs.sentences()
    assert full.name in sentence and "UV maps" in sentence
    paint((0.3, 0.1, 0.2))
    dirty["dirt"] = 1.0
    dirty.update_tag()
    for file in kept_files.folder("surfaces").glob("*.npz"):
        file.unlink()
    again = colors()
    np.testing.assert_allclose(again.pop(dirty.session_uid), [(0.5, 0.5, 0.5)], atol=1e-3)
    np.testing.assert_allclose(again.pop(painted.session_uid), [(0.3, 0.1, 0.2)], atol=1e-3)
    assert all(np.allclose(again[uid], found[uid]) for uid in again)
    assert baked == [5, 4]


@pytest.mark.parametrize("damaged_count", [1, 2])
def test_damaged_pictures_are_baked_again(stage, tmp_path, monkeypatch, damaged_count):
    """A render waits for other pictures, or fails if these are damaged too."""
    placed, made = wall(plain_color("Skin", (0.5, 0.5, 0.5))[0]), []

    def files_of(_kind, owners, _waits, **_values):
        (key,) = owners
        path = tmp_path / f"{damaged_count}.npz"
        if not path.exists():
            flat = np.ones((2, 2), np.float16)
            arrays = {"roughness": flat, "metallic": flat, "weight": flat, "normal": np.zeros(0, np.float16)}
            np.savez(path, uvs=np.zeros((4, 2), np.float32), color=np.ones((2, 2, 3), np.float16), **arrays)
            made.append(path.read_bytes())
            path.write_bytes(made[-1][:200] if len(made) <= damaged_count else made[-1])
        return {key: path}, []

    monkeypatch.setattr(picture_jobs, "files_of", files_of)
    bpy.context.view_layer.update()
    shown = [placed.evaluated_get(bpy.context.evaluated_depsgraph_get())]
    if damaged_count == 1:
        assert list(surface_bakes.find(shown, None, 1.0, True, True)) == [placed.session_uid]
    else:
        with pytest.raises(HairError, match="damaged"):
            surface_bakes.find(shown, None, 1.0, True, True)
    assert len(made) == 2


def test_a_render_without_a_bake_fails(stage, tmp_path, monkeypatch):
    """A picture with plain colors instead of materials that cannot be baked is not a valid result."""
    wall(plain_color("Skin", (0.5, 0.5, 0.5))[0])
    add_orthographic_camera(stage)
    errors = [HairError('Cycles cannot bake the materials of "Wall".')]
    monkeypatch.setattr(
        picture_jobs, "files_of", lambda _kind, _owners, waits, **_values: ({}, errors if waits else [])
    )
    with pytest.raises(HairError, match='cannot bake the materials of "Wall"'):
        api.render(tmp_path / "wall.png", width=8, height=8, sample_count=1)
    assert not (tmp_path / "wall.png").exists()


def test_unsaved_pixels_are_of_the_local_image(stage, tmp_path):
    """Unsaved pixels are restored in the local object's image, not in an image of a library with the same name."""
    files = [tmp_path / "library.blend", tmp_path / "owners.blend"]
    for side, file in zip((2, 4), files, strict=True):
        material, tree, shader = new_tree("Skin")
        texture = node(tree, "ShaderNodeTexImage", shader.inputs["Base Color"], coordinates=False)
        texture.image = bpy.data.images.new("Skin", side, side)
        placed = wall(material)
        placed.name = file.stem
        bpy.data.libraries.write(str(file), {placed})
        bpy.data.batch_remove([placed, material, texture.image])
    objects = surface_bake._loaded(files[1], [(str(files[0]), "library"), ("", "owners")])
    assert [one.name for one in objects] == ["library", "owners"]
    assert tuple(bpy.data.images["Skin"].size) == (4, 4)


def test_files_in_use_are_kept(tmp_path, monkeypatch):
    """The oldest files are removed, except those in use, while another process removes some of them too."""
    monkeypatch.setattr(kept_files, "_MOST_KEPT", 2)
    files = [tmp_path / f"{index}.npz" for index in range(5)]
    for index, file in enumerate(files):
        file.touch()
        os.utime(file, (index, index))
    stat, taken = type(tmp_path).stat, files[4]
    monkeypatch.setattr(
        type(tmp_path), "stat", lambda self, **how: stat(tmp_path / "gone" if self == taken else self, **how)
    )
    kept_files.remove_oldest(files[0], used={files[0]})
    monkeypatch.undo()
    assert sorted(tmp_path.iterdir()) == [files[0], files[2], files[3]]


def test_folders_of_killed_jobs_are_removed_after_a_day(tmp_path):
    """A new job removes the folders that former jobs left behind when Blender was killed, not those of other jobs."""
    old, recent, other = tmp_path / ".old", tmp_path / ".recent", tmp_path / "kept.npz"
    for folder in (old, recent):
        folder.mkdir()
        (folder / "owners.blend").touch()
    other.touch()
    for each in (old, other):
        os.utime(each, (0.0, 0.0))
    made = kept_files.new_job(tmp_path)
    assert sorted(tmp_path.iterdir()) == sorted([made, recent, other])


def test_a_view_keeps_plain_colors_until_nodes_are_baked(stage, monkeypatch):
    """A view starts one job for all surfaces. Until it ends, and after an error, the view has plain colors and a
    sentence.
    """
    placed = wall(bricks())
    wall(layered())
    for one in bpy.data.materials:
        next(iter(one.node_tree.nodes)).name = one.name  # nodes of no other test
    principled = next(one for one in placed.active_material.node_tree.nodes if one.type == "BSDF_PRINCIPLED")
    principled.inputs["Base Color"].default_value = (0.2, 0.3, 0.4, 1.0)
    background_process.end()
    monkeypatch.setattr(cli_command, "words", lambda: [sys.executable, "-c", "raise SystemExit('no Cycles')"])
    depsgraph = bpy.context.evaluated_depsgraph_get()
    objects = [one.evaluated_get(depsgraph) for one in stage.objects if one.type == "MESH"]
    assert surface_bakes.find(objects, None, 1.0, for_render=False, waits=False) == {}
    assert len(picture_jobs.running()) == 1 and len(picture_jobs.sentences()) == 2
    for _look in range(200):
        if picture_jobs.look() is None:
            break
        time.sleep(0.05)
    assert surface_bakes.find(objects, None, 1.0, for_render=False, waits=False) == {}
    assert all(is_error and "no Cycles" in sentence for sentence, is_error in picture_jobs.sentences())
    assert not picture_jobs.running() and len(picture_jobs.sentences()) == 2
    mesh = next(one for one in drawn_meshes.read_drawn_meshes(depsgraph) if one.owner[0] == placed.session_uid)
    np.testing.assert_allclose(mesh.colors[0][1], (0.2, 0.3, 0.4), rtol=1e-6)


def test_meshes_in_edit_mode_keep_their_last_pictures(stage, tmp_path, capsys):
    """In Edit Mode a mesh has its last pictures while they fit, without bakes and messages."""
    placed = wall(bricks())
    corners = len(placed.data.loops)
    made = {name: np.zeros((4, 4), np.float16) for name in ("roughness", "metallic", "weight")}
    uvs, color = np.zeros((corners, 2), np.float32), np.zeros((4, 4, 3), np.float16)
    path = tmp_path / "bake.npz"
    np.savez(path, uvs=uvs, color=color, normal=color[:0], **{**made, "weight": made["weight"] + 1})
    picture_jobs.last_cache.keep(placed.session_uid, path)

    view = next(a.spaces.active for s in bpy.data.screens for a in s.areas if a.type == "VIEW_3D")

    def is_baked():
        bpy.context.view_layer.update()
        meshes = drawn_meshes.read_drawn_meshes(bpy.context.evaluated_depsgraph_get(), view)
        return [material.is_baked for mesh in meshes for _count, material in mesh.materials]

    bpy.ops.object.mode_set(mode="EDIT")
    assert is_baked() == [True] and not picture_jobs.running()
    bpy.ops.mesh.extrude_region_move(TRANSFORM_OT_translate={"value": (0.0, 0.0, 1.0)})
    assert is_baked() == [False] and not picture_jobs.running()
    assert "Vellus" not in capsys.readouterr().err


def test_tiles_of_udim_are_baked_without_a_message(scene, capsys):
    material, tree, shader = new_tree("Skin")
    image = node(tree, "ShaderNodeTexImage", shader.inputs["Base Color"], coordinates=False)
    image.image = bpy.data.images.new("Skin", 4, 4, tiled=True)
    assert unread_nodes.baked_labels(material) == ["Image Texture"]
    surface_materials.read_material(material)
    assert "Vellus" not in capsys.readouterr().err


def test_instances_of_geometry_nodes_are_read_in_turn(stage, monkeypatch):
    """Instances of objects by Geometry Nodes have the pictures of the objects; instances of meshes are not baked."""
    asked = []
    monkeypatch.setattr(surface_bakes, "_needs_bake", lambda one, _override: asked.append(one.original.name))
    rock, target = wall(bricks()), wall(bricks())
    rock.name, target.name = "Rock", "Target"
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    begin, end, joined = map(tree.nodes.new, ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeJoinGeometry"))
    sources = [tree.nodes.new("GeometryNodeObjectInfo"), tree.nodes.new("GeometryNodeMeshCube")]
    sources[0].inputs["Object"].default_value = rock
    sources[0].inputs["As Instance"].default_value = True
    for source in sources:
        on_points = tree.nodes.new("GeometryNodeInstanceOnPoints")
        tree.links.new(begin.outputs[0], on_points.inputs["Points"])
        tree.links.new(source.outputs[-1 if source is sources[0] else 0], on_points.inputs["Instance"])
        tree.links.new(on_points.outputs[0], joined.inputs[0])
    tree.links.new(joined.outputs[0], end.inputs[0])
    target.modifiers.new("Scatter", "NODES").node_group = tree
    bpy.context.view_layer.update()
    meshes = drawn_meshes.read_drawn_meshes(bpy.context.evaluated_depsgraph_get())
    points = len(target.data.vertices)
    assert len(meshes) == 2 * points + 1
    assert sorted(asked) == ["Rock"] * (points + 1) + ["Target"]


def test_pictures_belong_to_nodes_and_meshes(stage):
    """Pictures are kept while an object moves or is posed; changed nodes, attributes and faces get new ones."""
    placed = wall(bricks())

    def path():
        bpy.context.view_layer.update()
        return surface_bakes._path_of(placed.evaluated_get(bpy.context.evaluated_depsgraph_get()))

    first = path()
    placed.location.x = 1.0
    placed.modifiers.new("Bend", "SIMPLE_DEFORM")
    assert path() == first
    placed.data.attributes.new("Paint", "FLOAT", "POINT")
    second = path()
    placed.modifiers.new("Smooth", "SUBSURF")
    third = path()
    brick = next(one for one in placed.active_material.node_tree.nodes if one.type == "TEX_BRICK")
    brick.inputs["Scale"].default_value = 3.0
    assert len({first, second, third, path()}) == 4


def test_only_nodes_that_are_not_read_are_baked(scene):
    """Images in UV coordinates and constants are read; images in other coordinates and other nodes are baked."""
    material, tree, shader = new_tree("Skin")
    image = node(tree, "ShaderNodeTexImage", shader.inputs["Base Color"], coordinates=False)
    image.image = bpy.data.images.new("Skin", 4, 4)
    node(tree, "ShaderNodeValue", shader.inputs["Roughness"], coordinates=False)
    assert unread_nodes.baked_labels(material) == []
    tree.links.new(tree.nodes["Coordinates"].outputs["Object"], image.inputs["Vector"])
    assert unread_nodes.baked_labels(material) == ["Image Texture"]
    tree.links.remove(image.inputs["Vector"].links[0])
    bump = node(tree, "ShaderNodeBump", shader.inputs["Normal"], coordinates=False)
    assert unread_nodes.baked_labels(material) == ["Bump"]
    tree.nodes.remove(bump)
    assert unread_nodes.baked_labels(material) == []
