# SPDX-License-Identifier: GPL-3.0-or-later
"""World light has the image's radiance as in Cycles, and arrives among strands and on surfaces."""

import math
import os
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.pictures import kept_files, picture_jobs, world_digest, world_panoramas
from hair_addon.blender.gpu import ambient_visibility, lights, strand_textures, surface_textures, world_texture
from hair_addon.blender.host import background_process, cli_command
from hair_addon.blender.io.pictures import world_panorama
from hair_addon.blender.render import offscreen
from hair_addon.core.errors import HairError
from hair_addon.core.files import light_images
from hair_addon.core.imaging import environment
from hair_addon.core.imaging.pixel_sampling import PictureSettings

HEIGHT = 64

pytestmark = pytest.mark.usefixtures("fine_world")


def picture(rng):
    """Return a Blender image of a smooth colored picture with one bright spot."""
    width, height = 64, 32
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., 0] = 0.5 + 0.4 * np.sin(2.0 * np.pi * u)
    pixels[..., 1] = v
    pixels[..., 2] = 0.3
    pixels[..., :3] += np.array([6.0, 5.0, 4.0]) * np.exp(-200.0 * ((u - 0.3) ** 2 + (v - 0.7) ** 2))[..., None]
    image = bpy.data.images.new("Surroundings", width, height, float_buffer=True, is_data=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    return image


def environment_node(scene, image, **settings):
    """Light the scene with a picture, and return the environment node."""
    scene.world = bpy.data.worlds.new("World")
    # Cycles would look for bright places at more pixels than the picture has, for a second.
    scene.world.cycles.sampling_method, scene.world.cycles.sample_map_resolution = "MANUAL", 64
    tree = scene.world.node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    for name, value in settings.items():
        setattr(node, name, value)
    tree.links.new(node.outputs["Color"], background.inputs["Color"])
    return node


def turn(node, kind, rotation, scale=(1.0, 1.0, 1.0)):
    """Add a Mapping node before an environment node."""
    tree = node.id_data
    mapping, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    mapping.vector_type = kind
    mapping.inputs["Rotation"].default_value, mapping.inputs["Scale"].default_value = rotation, scale
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])


def panorama(scene, folder):
    """Return (H, 2 H, 3) radiance of the world by longitude and latitude, rendered by Cycles."""
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.panorama_type = "PANO", "EQUIRECTANGULAR"
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.rotation_euler = (0.5 * math.pi, 0.0, -0.5 * math.pi)  # looks along +x, z up
    scene.collection.objects.link(scene.camera)
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 64, False
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 2 * HEIGHT, HEIGHT, 100
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(folder / "panorama.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(2 * HEIGHT * HEIGHT * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(HEIGHT, 2 * HEIGHT, 4)[..., :3]


@pytest.mark.parametrize(
    ("settings", "mapping"),
    [
        ({}, None),
        ({}, ("POINT", (0.3, 0.5, 1.1))),
        ({}, ("TEXTURE", (0.3, 0.5, 1.1), (1.0, 2.0, 0.5))),
        ({}, ("VECTOR", (0.0, 0.0, 2.0), (1.0, -1.0, 1.0))),
        ({"projection": "MIRROR_BALL"}, ("POINT", (0.0, 0.4, 0.0))),
    ],
)
def test_environment_orientation_equals_cycles(scene, rng, tmp_path, settings, mapping):
    node = environment_node(scene, picture(rng), **settings)
    if mapping:
        turn(node, *mapping)
    unrolled = world_texture._unrolled(lights.read_world(scene))
    rendered = panorama(scene, tmp_path)
    # Where a mirror ball's or a longitude's seam lies, a texel is a mean of both sides.
    is_close = np.isclose(unrolled, rendered, rtol=0.05, atol=0.05).all(axis=-1)
    assert is_close.mean() > 0.97


def test_decomposition_of_an_environment_conserves_light(scene, rng):
    environment_node(scene, picture(rng))
    world = lights.read_world(scene)
    unrolled = world_texture._unrolled(world)
    lobes, sides = world_texture.light_of(world)
    _directions, solid_angles = environment._texels(*unrolled.shape[:2])
    # A plane that faces a lobe receives its light at slightly oblique angles.
    in_lobes = sum(lobe.irradiance / (1.0 - lobe.variance) for lobe in lobes)
    assert len(lobes) == 1
    found = in_lobes + 4.0 * np.pi * sides.mean(axis=0)
    np.testing.assert_allclose(found, solid_angles @ unrolled.reshape(-1, 3), rtol=0.01)


def mixed_world(scene):
    """Light the scene with nodes that Vellus does not read: a sky without its sun, and a turned gradient below it."""
    scene.world = bpy.data.worlds.new("World")
    scene.world.color = (0.1, 0.2, 0.3)
    tree = scene.world.node_tree
    (output,) = (node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    sky, gradient = tree.nodes.new("ShaderNodeTexSky"), tree.nodes.new("ShaderNodeTexGradient")
    sky.sky_type, sky.sun_direction = "PREETHAM", (0.3, -0.5, 0.8)
    coordinates, mapping = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0.4, 0.2, 1.0)
    add, mix = tree.nodes.new("ShaderNodeAddShader"), tree.nodes.new("ShaderNodeMixShader")
    camera_only, path = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeLightPath")
    first, second = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeBackground")
    camera_only.inputs["Color"].default_value = (9.0, 0.0, 9.0, 1.0)
    for source, sink in (
        (sky.outputs["Color"], first.inputs["Color"]),
        (coordinates.outputs["Generated"], mapping.inputs["Vector"]),
        (mapping.outputs["Vector"], gradient.inputs["Vector"]),
        (gradient.outputs["Color"], second.inputs["Color"]),
        (first.outputs[0], add.inputs[0]),
        (second.outputs[0], add.inputs[1]),
        (path.outputs["Is Camera Ray"], mix.inputs[0]),
        (add.outputs[0], mix.inputs[1]),
        (camera_only.outputs[0], mix.inputs[2]),
        (mix.outputs[0], output.inputs["Surface"]),
    ):
        tree.links.new(source, sink)
    return mapping.inputs["Rotation"], mix.inputs[0]


@pytest.mark.farm
def test_cycles_renders_a_world_of_other_nodes(scene, tmp_path, monkeypatch):
    """The panorama has the radiance that light rays see in Cycles, in all directions, and is rendered once."""
    if Path("/dev/shm").is_dir():
        monkeypatch.setattr(tempfile, "tempdir", "/dev/shm")  # a file system of its own
    rotation, camera_part = mixed_world(scene)
    unrolled = world_texture.picture_of(lights.read_world(scene))
    made = world_panoramas.file_of(scene.world, 1.0, waits=False)
    assert made is not None and not picture_jobs.running()
    rotation.default_value = (0.4, 0.2, 1.5)
    assert world_digest.digest_of(scene.world) != made.stem
    rotation.default_value = (0.4, 0.2, 1.0)
    assert world_digest.digest_of(scene.world) == made.stem
    camera_part.links[0].is_muted = True
    camera_part.default_value = 0.0
    rendered = panorama(scene, tmp_path)
    np.testing.assert_allclose(unrolled, rendered, rtol=0.02, atol=0.01)


@pytest.mark.farm
def test_the_sun_of_a_sky_has_all_its_light(scene, tmp_path, monkeypatch):
    """The light of a sky with a sun is within 1 % of that with many samples, also in the first picture of views."""
    scene.world = bpy.data.worlds.new("World")
    sky = scene.world.node_tree.nodes.new("ShaderNodeTexSky")
    sky.sun_elevation, sky.sun_rotation = 0.4, 2.0
    scene.world.node_tree.links.new(sky.outputs[0], scene.world.node_tree.nodes["Background"].inputs["Color"])
    bpy.data.libraries.write(str(tmp_path / "sky.blend"), {scene.world})
    name = scene.world.name

    def light(is_coarse):
        world_panorama.render(tmp_path / "sky.blend", name, "sky", 1.0, is_coarse, tmp_path / "sky.exr")
        colors = light_images.read_layers(tmp_path / "sky.exr")[""].astype(float)
        widths = np.cos(np.pi * ((np.arange(len(colors)) + 0.5) / len(colors) - 0.5))
        return np.einsum("h,hwc->c", widths, colors) / len(colors) ** 2

    coarse, fine = light(True), light(False)
    monkeypatch.setattr(world_panorama, "SUN_SAMPLES", 2048)
    monkeypatch.setattr(world_panorama, "_AROUND_SUN", 8)
    exact = light(False)
    np.testing.assert_allclose(fine, exact, rtol=0.01)
    np.testing.assert_allclose(coarse, exact, rtol=0.01)


@pytest.mark.farm
def test_a_panorama_is_of_its_own_nodes_and_frame(tmp_path, monkeypatch):
    """A fine picture reuses the scene of the coarse one before it, but not that of other nodes or of another frame."""
    monkeypatch.setattr(world_panorama, "SIZE", (8, 4))
    world = bpy.data.worlds.new("Sky")
    strength = world.node_tree.nodes["Background"].inputs["Strength"]
    strength.keyframe_insert("default_value", frame=2.0)
    bpy.data.libraries.write(str(tmp_path / "2.blend"), {world})
    strength.default_value = 3.0
    strength.keyframe_insert("default_value", frame=3.0)
    bpy.data.libraries.write(str(tmp_path / "3.blend"), {world})

    def light(file, frame, is_coarse):
        world_panorama.render(tmp_path / f"{file}.blend", "Sky", file, frame, is_coarse, tmp_path / "sky.exr")
        return float(light_images.read_layers(tmp_path / "sky.exr")[""].mean())

    one = light("2", 3.0, True)
    np.testing.assert_allclose(light("2", 3.0, False), one, rtol=1e-6)
    jobs = [("3", 3.0, True), ("3", 2.0, True), ("3", 2.0, False), ("3", 3.0, False), ("2", 3.0, True)]
    np.testing.assert_allclose([light(*job) for job in jobs], np.multiply([3.0, 1.0, 1.0, 3.0, 1.0], one), rtol=1e-6)


@pytest.mark.farm
def test_linked_worlds_are_rendered_from_their_libraries(scene, tmp_path):
    """A linked world beside others in its library has its panorama."""
    mixed_world(scene)
    scene.world.name = "Sky"
    bpy.data.libraries.write(str(tmp_path / "skies.blend"), {scene.world, bpy.data.worlds.new("Other")})
    bpy.data.worlds.remove(scene.world)
    with bpy.data.libraries.load(str(tmp_path / "skies.blend"), link=True) as (_names, wanted):
        wanted.worlds = ["Sky"]
    scene.world = wanted.worlds[0]
    mixing = next(one for one in scene.world.node_tree.nodes if one.type == "BACKGROUND")
    mixing.name = "Linked"  # nodes of no other test
    assert world_panoramas.file_of(scene.world, 1.0, waits=True).is_file()


def test_the_digest_of_a_world_does_not_depend_on_the_order_of_its_links(scene):
    mixed_world(scene)
    before, tree = world_digest.digest_of(scene.world), scene.world.node_tree
    first = tree.links[0]
    ends = first.from_socket, first.to_socket
    tree.links.remove(first)
    assert world_digest.digest_of(scene.world) != before
    tree.links.new(*ends)
    assert tree.links[0].from_socket != ends[0]
    assert world_digest.digest_of(scene.world) == before


@pytest.fixture
def other_blender(monkeypatch):
    """Let other code run in place of the background process."""

    def run(code):
        background_process.end()
        monkeypatch.setattr(cli_command, "words", lambda: [sys.executable, "-c", code])

    yield run
    background_process.end()


SLEEP = "import time; time.sleep(60)"
FAIL = "raise SystemExit('no Cycles')"


def test_a_view_has_one_job_while_nodes_change(scene, monkeypatch, other_blender):
    """While nodes change with each step of a slider, a view starts one job at a time."""
    rotation, _part = mixed_world(scene)
    sent = []
    monkeypatch.setattr(background_process._Process, "send", lambda _self, folder: sent.append(folder))
    other_blender(SLEEP)
    for angle in (0.11, 0.12, 0.13):
        rotation.default_value = (angle, 0.0, 0.0)
        assert world_panoramas.file_of(scene.world, 1.0, waits=False) is None
    assert len(sent) == 1 and not picture_jobs.has_failed()
    (sent[0] / background_process.ENDED).write_text("too bright")
    assert picture_jobs.look() is None
    assert picture_jobs.has_failed()
    assert world_panoramas.file_of(scene.world, 1.0, waits=False) is None
    assert len(sent) == 2


def test_a_view_shows_other_nodes_once_cycles_has_rendered_them(scene, other_blender):
    """Until Cycles has rendered other nodes, and after an error, the world has its viewport color. Panels show the
    error, and their button starts again.
    """
    mixed_world(scene)[0].default_value = (0.1, 0.0, 0.0)
    other_blender(FAIL)
    for _look in range(200):
        np.testing.assert_allclose(lights.read_world(scene, waits=False).color, (0.1, 0.2, 0.3), rtol=1e-6)
        if picture_jobs.look() is None:
            break
        time.sleep(0.05)
    ((sentence, is_error),) = picture_jobs.sentences()
    assert is_error and "no Cycles" in sentence
    with pytest.raises(HairError, match=r"World.*no Cycles"):
        lights.read_world(scene)
    bpy.ops.vellus.retry_baking()
    assert not picture_jobs.sentences() and not bpy.ops.vellus.retry_baking.poll()
    other_blender(SLEEP)
    lights.read_world(scene, waits=False)
    assert [is_error for _sentence, is_error in picture_jobs.sentences()] == [False]
    picture_jobs.try_again()
    assert len(picture_jobs.running()) == 1


def test_coarse_and_old_pictures_of_a_view_are_removed(scene, tmp_path, monkeypatch, other_blender):
    """A fine picture replaces the coarse one of a view, and the oldest pictures beyond the maximum are removed."""
    mixed_world(scene)[0].default_value = (0.41, 0.0, 0.0)
    sent = []
    monkeypatch.setattr(background_process._Process, "send", lambda _self, folder: sent.append(folder))
    monkeypatch.setattr(kept_files, "folder", lambda _name: tmp_path)
    monkeypatch.setattr(kept_files, "_MOST_KEPT", 1)
    other_blender(SLEEP)
    for age in (100, 200):
        (tmp_path / f"{age}.exr").touch()
        os.utime(tmp_path / f"{age}.exr", (age, age))
    shown = [world_panoramas.file_of(scene.world, 1.0, waits=False)]
    for _picture in ("coarse", "fine"):
        (sent[-1] / "0.exr").touch()
        (sent[-1] / background_process.ENDED).touch()
        picture_jobs.look()
        shown.append(world_panoramas.file_of(scene.world, 1.0, waits=False))
    fine = tmp_path / f"{world_digest.digest_of(scene.world)}.exr"
    assert shown == [None, fine.with_suffix(".coarse.exr"), fine]
    assert sorted(tmp_path.iterdir()) == sorted([tmp_path / "200.exr", fine])


def test_a_render_may_wait_for_the_job_of_a_view(scene, monkeypatch, other_blender):
    """Two threads that wait for one job find its file in place, without an error."""
    mixed_world(scene)[0].default_value = (0.31, 0.0, 0.0)
    sent, complaint = [], background_process.Job.complaint
    monkeypatch.setattr(background_process._Process, "send", lambda _self, folder: sent.append(folder))
    monkeypatch.setattr(background_process.Job, "complaint", lambda job: (time.sleep(0.05), complaint(job))[1])
    other_blender(SLEEP)
    assert world_panoramas.file_of(scene.world, 1.0, waits=False) is None
    (job,) = picture_jobs.running()
    (sent[0] / "0.exr").write_bytes(b"")
    (sent[0] / background_process.ENDED).write_text("")
    with ThreadPoolExecutor(2) as threads:
        assert list(threads.map(job.is_ended, (True, True))) == [True, True]
    assert not job.reasons and job.paths[0].is_file()


def test_a_view_has_the_last_panorama_while_the_next_is_rendered(scene, other_blender):
    """A view shows the last panorama until the next is rendered, and panels name the world that is being rendered."""
    rotation, _part = mixed_world(scene)
    rotation.default_value = (0.21, 0.0, 0.0)
    former = kept_files.folder("worlds") / f"{world_digest.digest_of(scene.world)}.exr"
    light_images.write_colors(former, np.ones((2, 4, 3)))
    assert lights.read_world(scene, waits=False).image.path == str(former)
    assert not picture_jobs.sentences()
    other_blender(SLEEP)
    rotation.default_value = (0.22, 0.0, 0.0)
    assert lights.read_world(scene, waits=False).image.path == str(former)
    ((sentence, is_error),) = picture_jobs.sentences()
    assert '"World"' in sentence and not is_error
    former.unlink()
    assert lights.read_world(scene, waits=False).image is None


@pytest.mark.parametrize("damaged_count", [1, 2])
def test_a_damaged_panorama_of_a_world_is_rendered_again(scene, tmp_path, monkeypatch, damaged_count):
    """A render waits for another panorama, or fails if that one is damaged too."""
    mixed_world(scene)
    path, made = tmp_path / "sky.exr", []

    def file_of(*_given):
        if not path.exists():
            light_images.write_colors(path, np.ones((2, 4, 3)))
            made.append(path.read_bytes())
            path.write_bytes(made[-1][:-9] if len(made) <= damaged_count else made[-1])
        return path

    monkeypatch.setattr(world_panoramas, "file_of", file_of)
    if damaged_count == 1:
        assert lights.read_world(scene).image.size == (4, 2)
    else:
        with pytest.raises(HairError, match="damaged"):
            lights.read_world(scene)
    assert len(made) == 2


def test_the_picture_is_seen_behind_the_scene(scene, rng, tmp_path):
    environment_node(scene, picture(rng))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.rotation_euler = (1.2, 0.0, 0.7)
    scene.collection.objects.link(camera)
    scene.camera = camera
    settings = PictureSettings(48, 32, 2)
    bpy.context.view_layer.update()
    drawn = offscreen.draw_picture(settings)
    scene.render.engine, scene.render.resolution_percentage = "CYCLES", 100
    scene.render.resolution_x, scene.render.resolution_y = 48, 32
    scene.cycles.samples, scene.cycles.use_denoising = 32, False
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(tmp_path / "behind.exr")
    bpy.ops.render.render(write_still=True)
    pixels = np.empty(48 * 32 * 4, np.float32)
    bpy.data.images.load(scene.render.filepath).pixels.foreach_get(pixels)
    np.testing.assert_allclose(drawn[..., :3], pixels.reshape(32, 48, 4)[..., :3], rtol=0.05, atol=0.02)


def seen(places, strands=None, opacity=1.0):
    """Return (N, 6) the part of each side that places (N, 3) see among strands (S, P, 3) of radius (S, P)."""
    surface = surface_textures.upload_surface(places.astype(np.float32), np.zeros(3, np.int32))
    hair = [(strand_textures.upload_strands(*strands), np.eye(4))] if strands else []
    _hair, (found,) = ambient_visibility.measure(hair, [surface], [opacity] * len(hair), [surface])
    texels = [np.array(found[name].read()).reshape(-1, 4) for name in ("visibility_x_y", "visibility_z")]
    return np.concatenate([texels[0], texels[1][:, :2]], axis=1)[: len(places)]


def test_nothing_hides_the_world_from_places_without_hair(scene, rng):
    np.testing.assert_allclose(seen(rng.normal(size=(5, 3))), 1.0, atol=2e-3)


def test_transmittance_of_a_cloud_equals_ray_tracing(scene, rng):
    """The transmittance of a cloud equals ray tracing, by which rays cross as many strands as the cloud's density
    gives.
    """
    middles = rng.normal(size=(6000, 3))
    middles *= (rng.random(6000) ** (1 / 3) / np.linalg.norm(middles, axis=1))[:, None]
    along = rng.normal(size=(6000, 3))
    along *= 0.06 / np.linalg.norm(along, axis=1)[:, None]
    points = (middles[:, None] + np.linspace(-1.0, 1.0, 5)[:, None] * along[:, None]).astype(np.float32)
    radii = np.full((6000, 5), 0.0014, np.float32)
    places = 0.3 * rng.normal(size=(20, 3)) / np.sqrt(3.0)
    found = seen(places, (points, radii)).mean()
    # The shadow of an isotropic strand is pi / 4 of length × width; the cloud fills a ball of radius 1.
    density = 6000 * 0.25 * np.pi * 0.12 * 0.0028 / (4.0 / 3.0 * np.pi)
    directions = rng.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    along = places @ directions.T
    ways = -along + np.sqrt(along**2 + 1.0 - np.square(places).sum(axis=1)[:, None])
    assert found == pytest.approx(np.exp(-density * ways).mean(), rel=0.05)


@pytest.mark.parametrize("has_hair", [False, True])
def test_an_even_world_gives_a_surface_its_colour(sphere, scene, has_hair):
    """An even world gives a surface its color, with and without hair in the scene."""
    color = np.array([0.2, 0.4, 0.6])
    scene.world = bpy.data.worlds.new("World")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (*color, 1.0)
    if has_hair:
        bpy.ops.vellus.add_hair(guide_count=3, strand_count=3, length=0.01, radius=1e-5)
    bpy.ops.object.camera_add(location=(0.0, 0.0, 8.0))
    scene.camera = bpy.context.object
    drawn = offscreen.draw_picture(PictureSettings(32, 32, 1, is_transparent=True))
    surface = drawn[drawn[..., 3] == 1.0][:, :3]
    assert len(surface) > 50
    np.testing.assert_allclose(np.median(surface, axis=0), 0.8 * color, rtol=0.02)
