# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames with missing libraries, images or caches are refused with a message, or form another sequence if allowed."""

import os
import subprocess
import sys

import bpy
import numpy as np
import OpenEXR
import pytest

from hair_addon import api
from hair_addon.blender.data.pictures import rendered_files
from hair_addon.core.errors import HairError
from tests.support.commands import ROOT, run_here
from tests.support.reading import read_picture

SIZE = ("--width", "16", "--height", "16", "--samples", "1")
SKY, OTHER_SKY = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0)


def write_image(path, color=SKY):
    """Write a small .exr of one color."""
    path.parent.mkdir(exist_ok=True)
    image = bpy.data.images.new("made", 8, 4, float_buffer=True)
    image.generated_color, image.filepath_raw, image.file_format = color, str(path), "OPEN_EXR"
    image.save()
    bpy.data.images.remove(image)
    return path


def new_image(path, source="FILE"):
    image = bpy.data.images.new(path.name, 8, 4)
    image.filepath, image.source = str(path), source
    return image


def image_node(tree, image, kind="ShaderNodeTexImage"):
    node = tree.nodes.new(kind)
    node.image = image
    return node


@pytest.fixture
def sky(lit):
    """Return the node of a world's missing image."""
    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    node = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    world.node_tree.links.new(node.outputs[0], world.node_tree.nodes["Background"].inputs[0])
    return node


def save(path):
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def named(numbers=(1,)):
    return rendered_files.missing(bpy.context.scene, numbers)


def render(shot, *words, out="f_####.exr"):
    return run_here("render", shot, "--out", shot.with_name("out") / out, "--json", *SIZE, *words)


def test_a_missing_image_is_refused_and_named(sky, tmp_path):
    sky.image = new_image(tmp_path / "sky.exr")
    shot = save(tmp_path / "shot.blend")
    refused = render(shot, "--frames", "1-2")
    assert (refused.status, refused.out, [*tmp_path.glob("out/*")]) == (1, "", [])
    assert refused.errors == (
        "vellus: Files are missing or damaged: //sky.exr; restore or relink them, or render without them by "
        "--allow-missing.\n"
    )
    allowed = render(shot, "--frames", "1", "--allow-missing")
    assert (allowed.status, [line["frame"] for line in allowed.results]) == (0, [1])
    assert allowed.errors == "vellus: warning: rendered without missing files: //sky.exr.\n"
    # Frames without it do not count as complete when it is there.
    write_image(tmp_path / "sky.exr")
    mixed = render(shot, "--frames", "1-2")
    assert mixed.status == 1 and "belongs to another sequence (files: //sky.exr)" in mixed.errors
    assert [line["frame"] for line in render(shot, "--frames", "1-2", "--overwrite").results] == [1, 2]
    assert read_picture(tmp_path / "out" / "f_0001.exr")[:3] == pytest.approx(SKY[:3], abs=1e-3)
    assert render(shot, "--frames", "1-2").results == []


@pytest.mark.parametrize("owner", ["world", "light", "surface"])
def test_a_damaged_image_is_named(sky, owner, tmp_path):
    """A truncated image of a world, a lamp or a surface is refused like a missing one, until it is whole again."""
    if owner == "world":
        node = sky
    elif owner == "light":
        tree = bpy.data.objects["Sun"].data.node_tree
        node = image_node(tree, None)
        tree.links.new(node.outputs[0], next(one for one in tree.nodes if one.type == "EMISSION").inputs[0])
    else:
        material = bpy.data.materials.new("Skin")
        bpy.data.meshes["Icosphere"].materials.append(material)
        node = image_node(material.node_tree, None)
        material.node_tree.links.new(node.outputs[0], material.node_tree.nodes["Principled BSDF"].inputs[0])
    path = write_image(tmp_path / "a.exr")
    node.image = new_image(path)
    whole = path.read_bytes()
    for data, expected in ((whole, []), (whole[: len(whole) // 2], [str(path)]), (whole, []), (b"", [str(path)])):
        path.write_bytes(data)
        os.utime(path, (0, len(data)))
        assert named() == expected


def test_a_missing_or_damaged_light_profile_is_named(lit, tmp_path):
    tree = bpy.data.objects["Sun"].data.node_tree
    node, path = tree.nodes.new("ShaderNodeTexIES"), tmp_path / "lamp.ies"
    node.mode, node.filepath = "EXTERNAL", str(path)
    assert named() == []  # no link
    tree.links.new(node.outputs[0], next(one for one in tree.nodes if one.type == "EMISSION").inputs["Strength"])
    assert named() == [str(path)]
    profile = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1.0 2 1 1 2 0 0 0\n1.0 1.0 0\n0 90\n0\n1000 500\n"
    for data, expected in ((profile, []), (profile[:-5], [str(path)]), ("not a lamp", [str(path)])):
        path.write_text(data)
        os.utime(path, (0, len(data)))
        assert named() == expected


def test_frames_with_another_texture_are_not_mixed(sky, tmp_path):
    path = write_image(tmp_path / "sky.exr")
    sky.image = new_image(path)
    shot = save(tmp_path / "shot.blend")
    assert render(shot, "--frames", "1").status == 0
    write_image(path, OTHER_SKY)
    os.utime(path, (path.stat().st_atime, path.stat().st_mtime + 10.0))
    mixed = render(shot, "--frames", "1-2")
    assert mixed.status == 1 and "(files: //sky.exr)" in mixed.errors
    assert render(shot, "--frames", "1", "--overwrite").status == 0
    assert read_picture(tmp_path / "out" / "f_0001.exr")[:3] == pytest.approx(OTHER_SKY[:3], abs=1e-3)


def test_scripts_and_the_engine_refuse_too(sky, tmp_path):
    sky.image = new_image(tmp_path / "sky.exr")
    with pytest.raises(HairError, match=r"Files are missing or damaged: .*sky\.exr"):
        api.render(tmp_path / "still.exr", width=16, height=16, sample_count=1)
    assert not (tmp_path / "still.exr").exists()
    api.render(tmp_path / "still.exr", width=16, height=16, sample_count=1, allow_missing=True)
    scene = bpy.context.scene
    scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "VELLUS", 16, 16
    with pytest.raises(RuntimeError, match=r"Files are missing or damaged: .*sky\.exr"):
        bpy.ops.render.render()


def test_only_what_a_render_reads_is_asked_for(sky, tmp_path):
    """Only what a render reads is required: no unused, packed or generated image, and none that only viewports show."""
    tree, gone = bpy.context.scene.world.node_tree, tmp_path / "gone.png"
    new_image(gone).use_fake_user = True
    image_node(tree, new_image(gone))
    muted = image_node(tree, new_image(gone), "ShaderNodeTexEnvironment")
    tree.links.new(muted.outputs[0], tree.nodes["Background"].inputs[1])
    muted.mute = True
    packed = new_image(write_image(tmp_path / "packed.exr"))
    packed.pack()
    (tmp_path / "packed.exr").unlink()
    sky.image = packed
    empty = bpy.data.objects.new("Empty", None)
    empty.empty_display_type, empty.data = "IMAGE", new_image(gone)
    bpy.context.scene.collection.objects.link(empty)
    bpy.context.scene.camera.data.background_images.new().image = new_image(gone)
    bpy.context.scene.tool_settings.image_paint.canvas = new_image(gone)
    assert named() == []
    sky.image = bpy.data.images.new("Generated", 4, 4)
    assert named() == []


def test_empty_and_unreadable_files_are_missing(sky, tmp_path, monkeypatch):
    empty, text = tmp_path / "empty.exr", tmp_path / "text.tga"
    empty.touch()
    text.write_text("no image")
    for path in (empty, text):
        sky.image = new_image(path)
        assert named() == [str(path)]
    path = write_image(tmp_path / "sky.exr")
    sky.image = new_image(path)
    with monkeypatch.context() as patched:
        patched.setattr(rendered_files.Path, "open", refused)
        assert named() == [str(path)]
    assert named() == []


def refused(path, *_given):
    raise PermissionError(f"no permission to read {path}")


def test_files_with_layers_or_parts_are_read(sky, tmp_path):
    """Decoders of single pictures refuse files with layers, which Blender renders."""
    path, pixels = tmp_path / "layers.exr", np.ones((8, 8), np.float32)
    layers = [{f"View Layer.{name}.{color}": pixels for color in "RGB"} for name in ("Combined", "Emission")]
    parts = [OpenEXR.Part({}, layer, name) for layer, name in zip(layers, "ab", strict=True)]
    for written in (OpenEXR.File({}, layers[0] | layers[1]), OpenEXR.File(parts)):
        written.write(str(path))
        sky.image = new_image(path)
        whole = path.read_bytes()
        assert named() == []
        path.write_bytes(whole[:-1])
        assert named() == [str(path)]


def test_each_tile_and_each_number_is_asked_for(sky, tmp_path):
    tiled = new_image(write_image(tmp_path / "skin.1001.exr").with_name("skin.<UDIM>.exr"), "TILED")
    tiled.tiles.new(tile_number=1002)
    material = bpy.data.materials.new("Skin")
    bpy.data.objects["Sphere"].data.materials.append(material)
    tree = material.node_tree
    node = image_node(tree, tiled)
    tree.links.new(node.outputs[0], next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED").inputs["Base Color"])
    assert named() == [tiled.filepath]
    write_image(tmp_path / "skin.1002.exr")
    assert named() == []
    for number in (11, 12, 14):
        write_image(tmp_path / "sky" / f"plate2_{number:03}.exr")
    sky.image = new_image(tmp_path / "sky" / "plate2_011.exr", "SEQUENCE")
    user = sky.image_user
    user.frame_start, user.frame_duration, user.frame_offset, user.use_auto_refresh = 5, 4, 10, True
    assert [named([frame]) != [] for frame in range(5, 9)] == [False, False, True, False]
    damaged = tmp_path / "sky" / "plate2_012.exr"
    whole = damaged.read_bytes()
    damaged.write_bytes(whole[: len(whole) // 2])
    assert named([6]) == [sky.image.filepath] and named([5, 6]) == []  # frame 6 is checked again before it
    damaged.write_bytes(whole)
    scene, tested = bpy.context.scene, range(-3, 14)
    for is_cyclic in (False, True):
        user.use_cyclic = is_cyclic
        numbers = []
        for frame in tested:
            scene.frame_set(frame)
            world = bpy.context.evaluated_depsgraph_get().scene_eval.world
            numbers.append(world.node_tree.nodes[sky.name].image_user.frame_current)
        assert numbers == [rendered_files._image_number(user, frame) for frame in tested]  # as Blender counts
    # The sequence of pictures knows all images of a numbered row, whichever frames a process renders.
    before = rendered_files.states(scene)
    write_image(tmp_path / "sky" / "plate2_013.exr")
    changed = {name for name, state in rendered_files.states(scene).items() if before[name] != state}
    assert changed == {sky.image.filepath}


def test_caches_and_masks_are_asked_for(lit, tmp_path):
    sphere = bpy.data.objects["Sphere"]
    (tmp_path / "walk.usdc").write_text("#usda 1.0\n")
    bpy.ops.cachefile.open(filepath=str(tmp_path / "walk.usdc"))
    (cache,) = bpy.data.cache_files
    sphere.modifiers.new("Cache", "MESH_SEQUENCE_CACHE").cache_file = cache
    assert named() == []
    (tmp_path / "walk.usdc").unlink()
    assert named() == [cache.filepath]
    sphere.modifiers.clear()
    mask = new_image(tmp_path / "mask.png")
    assert named() == []
    bpy.data.objects["Hair"].data.vellus.hair.density_image = mask.name
    assert named() == [mask.filepath]


def test_long_lists_are_shortened():
    assert rendered_files.in_short(list("abcd")) == "a, b, c, d"
    assert rendered_files.in_short(list("abcdefg")) == "a, b, c, d + 3"


# Libraries: a shot links a chair from a.blend, and the mesh of the chair is linked from b.blend.

_LINKS = """
import sys, bpy
folder = sys.argv[-1]
def fresh(): bpy.ops.wm.read_factory_settings(use_empty=True)
def save(name): bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/{name}.blend")
def link(name, kind, wanted):
    with bpy.data.libraries.load(f"{folder}/{name}.blend", link=True, relative=True) as (_there, taken):
        setattr(taken, kind, [wanted])
    return getattr(taken, kind)[0]
fresh(); bpy.data.meshes.new("Seat").use_fake_user = True; save("b")
fresh(); save("a")
chair = bpy.data.objects.new("Chair", link("b", "meshes", "Seat"))
bpy.context.scene.collection.objects.link(chair); save("a")
fresh(); save("shot"); scene = bpy.context.scene
scene.collection.objects.link(link("a", "objects", "Chair"))
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
scene.collection.objects.link(camera); scene.camera = camera; save("shot")
fresh(); bpy.data.meshes.new("Stool").use_fake_user = True; save("other")
"""


@pytest.fixture(scope="module")
def linked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("linked")
    done = subprocess.run([sys.executable, "-c", _LINKS, folder], cwd=ROOT, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.farm
@pytest.mark.parametrize(
    ("file", "becomes", "reported"),
    [
        ("a", None, "//a.blend;"),
        ("b", None, "//b.blend;"),
        ("b", "other", '//b.blend (Mesh "Seat");'),
        ("a", "b", '//a.blend (Object "Chair");'),
    ],
    ids=["library", "indirect library", "datablock of an indirect library", "datablock"],
)
def test_a_missing_library_is_refused_and_named(linked, scene, tmp_path, file, becomes, reported):
    for name in ("a", "b", "shot"):
        (tmp_path / f"{name}.blend").write_bytes((linked / f"{name}.blend").read_bytes())
    shot, out = tmp_path / "shot.blend", "f.png"
    if file == "b" and becomes is None:
        before = rendered_files_of(shot)
        assert set(before) == {"//a.blend", "//b.blend"} and "missing" not in before.values()
        assert render(shot, out=out).status == 0
    path = tmp_path / f"{file}.blend"
    path.unlink()
    if becomes is not None:
        path.write_bytes((linked / f"{becomes}.blend").read_bytes())
    refused = render(shot, out="g.png")
    assert refused.status == 1 and f"Files are missing or damaged: {reported}" in refused.errors
    assert not (tmp_path / "out" / "g.png").exists()
    allowed = render(shot, "--allow-missing", out="g.png")
    assert allowed.status == 0 and "warning: rendered without missing files: //" in allowed.errors


def rendered_files_of(path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return rendered_files.states(bpy.context.scene)
