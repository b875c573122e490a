# SPDX-License-Identifier: GPL-3.0-or-later
"""Cryptomatte passes have a matte per object, hair system, material and asset, which other programs read."""

import json

import bpy
import numpy as np
import OpenEXR
import pytest
from mathutils import Vector

from hair_addon.blender.render import film
from tests.support.cryptomatte_reader import mattes
from tests.support.pictures.rendering import configure, rendered

KINDS = ("object", "material", "asset")


@pytest.fixture
def three(lit):
    """Return a sphere with three hair systems, parented to an empty, in front of nothing."""
    sphere = bpy.data.objects["Sphere"]
    root = bpy.data.objects.new("Root", None)
    bpy.context.scene.collection.objects.link(root)
    sphere.parent = root
    sphere.data.materials.append(bpy.data.materials.new("Skin"))
    for name, length in (("Fringe", 0.3), ("Crown", 0.2)):
        bpy.context.view_layer.objects.active = sphere
        before = set(bpy.data.objects)
        bpy.ops.vellus.add_hair(guide_count=8, strand_count=150, length=length, radius=0.01)
        (new,) = [one for one in set(bpy.data.objects) - before if one.data.vellus.kind == "HAIR"]
        new.name = name
    layer = bpy.context.view_layer
    for kind in KINDS:
        setattr(layer, f"use_pass_cryptomatte_{kind}", True)
    layer.vellus.has_hair_mask = True
    bpy.context.scene.render.film_transparent = True
    return lit


def read(folder, kind="Object", **settings):
    passes = rendered(folder, **settings)
    return passes, mattes(folder / "rendered.exr", f"ViewLayer.Crypto{kind}")


def cameras_lens(scene):
    scene.camera.data.type = "PERSP"
    scene.camera.data.dof.use_dof = True
    scene.camera.data.dof.focus_distance, scene.camera.data.dof.aperture_fstop = 3.0, 0.5


def motion(scene):
    sphere = bpy.data.objects["Sphere"]
    for frame, place in ((0, -0.3), (2, 0.3)):
        sphere.location.x = place
        sphere.keyframe_insert("location", frame=frame)
    scene.render.use_motion_blur, scene.vellus.motion_steps = True, 3


def behind_glass(scene):
    """Place a pane of glass that covers half of the picture in front of everything."""
    pane = bpy.data.meshes.new("Pane")
    corners = [
        scene.camera.matrix_world @ Vector(place) for place in ((-9, -9, -1), (0, -9, -1), (0, 9, -1), (-9, 9, -1))
    ]
    pane.from_pydata(corners, [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("Glass")
    next(one for one in material.node_tree.nodes if one.type == "BSDF_PRINCIPLED").inputs[
        "Transmission Weight"
    ].default_value = 1.0
    pane.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("Pane", pane))


def test_glass_has_no_matte(three, tmp_path):
    """Behind glass, which adds reflections to the picture, objects have the same coverages."""
    passes, found = read(tmp_path)
    behind_glass(bpy.context.scene)
    reflecting, others = read(tmp_path)
    assert np.abs(reflecting["Combined"] - passes["Combined"]).max() > 0.01
    assert set(found) == set(others) and all(np.array_equal(found[name], others[name]) for name in found)


def test_openimageio_reads_the_same_mattes(three, tmp_path):
    """OpenImageIO, which other programs read files with, finds the same numbers, coverages and manifests."""
    _passes, found = read(tmp_path)
    bpy.utils.expose_bundled_modules()
    oiio = pytest.importorskip("OpenImageIO")
    image = oiio.ImageBuf(str(tmp_path / "rendered.exr"))
    texts = {one.name: one.value for one in image.spec().extra_attribs if one.name.startswith("cryptomatte/")}
    (key,) = (name[:-5] for name, text in texts.items() if name.endswith("/name") and text == "ViewLayer.CryptoObject")
    manifest, channels = json.loads(texts[f"{key}/manifest"]), {}
    for part in range(image.nsubimages):
        part_of_file = oiio.ImageBuf(str(tmp_path / "rendered.exr"), part, 0)
        layer, pixels = part_of_file.spec()["oiio:subimagename"], np.asarray(part_of_file.get_pixels(oiio.FLOAT))
        for index, name in enumerate(part_of_file.spec().channelnames):
            channels[name if "." in name else f"{layer}.{name}"] = pixels[::-1, :, index]
    ranks = sorted({name.rpartition(".")[0] for name in channels if name.startswith("ViewLayer.CryptoObject")})
    pairs = [[channels[f"{rank}.{one}"] for one in pair] for rank in ranks for pair in ("RG", "BA")]
    assert set(manifest) == set(found) and pairs
    for name, digits in manifest.items():
        number = np.uint32(int(digits, 16)).view(np.float32)
        covered = sum(np.where(numbers == number, coverage, 0.0) for numbers, coverage in pairs)
        np.testing.assert_allclose(covered, found[name], atol=1e-6)
    total = sum(coverage for _numbers, coverage in pairs)
    assert total.max() < 1.001


@pytest.mark.parametrize("how", ["filter", "motion blur", "depth of field", "tiles"])
def test_coverages_are_those_of_the_samples(three, tmp_path, monkeypatch, how):
    """Coverages and the empty part sum to 1 within 0.001, and the coverage of hair is the hair mask."""
    scene, settings = bpy.context.scene, {"filter_size": 0.75}
    if how == "motion blur":
        motion(scene)
    elif how == "depth of field":
        cameras_lens(scene)
        settings["sample_count"] = 16
    passes, found = read(tmp_path, **settings)
    if how == "tiles":
        monkeypatch.setattr(film, "largest_tile", lambda *_settings: 50)
        tiled, others = read(tmp_path, **settings)
        is_same = np.isclose(tiled["Combined"][..., 3], passes["Combined"][..., 3], atol=1e-5)
        assert is_same.mean() > 0.999  # a strand at the border of a tile may lose a sample
        assert all(np.abs(found[name] - others[name])[is_same].max() < 1e-5 for name in found)
        passes, found = tiled, others
    alpha = passes["Combined"][..., 3]
    hair = {name for name in found if name != "Sphere"}
    assert hair == {"Hair", "Fringe", "Crown"} and all(found[name].max() > 0.3 for name in found)
    assert np.abs(sum(found.values()) + (1.0 - alpha) - 1.0).max() < 1e-3
    assert np.abs(sum(found[name] for name in hair) - passes["Hair Mask"]).max() < 1e-3
    assert ((alpha > 0.01) & (alpha < 0.99)).sum() > 50


def test_materials_and_assets_group_objects(three, tmp_path):
    """The matte of a material has the objects that use it, the matte of an asset those below its topmost parent."""
    _passes, objects = read(tmp_path)
    materials, assets = (mattes(tmp_path / "rendered.exr", f"ViewLayer.Crypto{kind}") for kind in ("Material", "Asset"))
    np.testing.assert_allclose(materials["Skin"], objects["Sphere"], atol=1e-6)
    tops = {}
    for name in objects:
        top = bpy.data.objects[name]
        while top.parent is not None:
            top = top.parent
        tops[top.name] = tops.get(top.name, 0.0) + objects[name]
    assert "Root" in tops and set(tops) == set(assets)
    for name, cover in tops.items():
        np.testing.assert_allclose(assets[name], cover, atol=1e-6)


def test_ranks_and_indices_follow_the_view_layer(three, tmp_path):
    layer = bpy.context.view_layer
    layer.pass_cryptomatte_depth, layer.use_pass_object_index, layer.use_pass_material_index = 2, True, True
    three.pass_index, bpy.data.materials["Skin"].pass_index = 5, 7
    passes, found = read(tmp_path)
    assert {name for name in passes if name.startswith("CryptoObject")} == {"CryptoObject00"}
    is_hair = found["Hair"] > 0.5
    assert is_hair.any() and (passes["Object Index"][is_hair] == 5.0).all()
    is_skin = found["Sphere"] > 0.9
    assert is_skin.any() and (passes["Material Index"][is_skin] == 7.0).all()
    assert (passes["Object Index"][passes["Combined"][..., 3] == 0.0] == 0.0).all()


def test_hair_that_is_composited_has_mattes_of_its_own(three, tmp_path):
    """In the hair scene of Composite Hair, surfaces hide hair and have no matte."""
    _passes, whole = read(tmp_path)
    passes, found = read(tmp_path, is_hair_only=True)
    assert set(found) == {"Hair", "Fringe", "Crown"}
    np.testing.assert_allclose(sum(found.values()), passes["Combined"][..., 3], atol=1e-3)
    assert all(np.abs(found[name] - whole[name]).max() < 1e-5 for name in found)


def test_the_compositor_reads_each_hair_system(three, tmp_path):
    """Blender's Cryptomatte node gives the coverages of the file."""
    scene = bpy.context.scene
    _passes, found = read(tmp_path)
    tree = bpy.data.node_groups.new("Mattes", "CompositorNodeTree")
    scene.compositing_node_group = tree
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    output, node = tree.nodes.new("NodeGroupOutput"), tree.nodes.new("CompositorNodeCryptomatteV2")
    node.source, node.scene = "RENDER", scene
    tree.links.new(node.outputs["Matte"], output.inputs[0])
    configure()
    scene.render.image_settings.media_type, scene.render.image_settings.file_format = "IMAGE", "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    for kind, names in (("Object", ("Fringe", "Sphere")), ("Material", ("Skin",))):
        node.layer_name = f"ViewLayer.Crypto{kind}"
        expected = mattes(tmp_path / "rendered.exr", f"ViewLayer.Crypto{kind}")
        for name in names:
            node.matte_id = name
            scene.render.filepath = str(tmp_path / "matte.exr")
            assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
            with OpenEXR.File(scene.render.filepath, separate_channels=True) as file:
                red = np.array(file.channels()["R"].pixels, np.float32)[::-1]
            np.testing.assert_allclose(red, expected[name], atol=1e-5)
    assert found["Fringe"].max() > 0.5


def test_panoramas_refuse_mattes(three, tmp_path):
    bpy.context.scene.camera.data.type = "PANO"
    with pytest.raises(RuntimeError, match="no mattes"):
        rendered(tmp_path)
