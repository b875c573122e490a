# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures: Blender without a window, the registered add-on, and scenes for hair."""

import math
from functools import partial
from itertools import takewhile
from types import SimpleNamespace

import bpy
import gpu
import numpy as np
import pytest

import hair_addon
import tests.support.examples  # noqa: F401 (for what it sets)
from hair_addon.blender.data.strands import curves
from hair_addon.blender.gpu import ambient_visibility, scene_lights
from hair_addon.blender.host import running
from hair_addon.blender.live import invalidation, live_hair
from hair_addon.core.grooming.groom import GuideSettings
from hair_addon.core.imaging import ambient_cube
from tests.support import remembered
from tests.support.child_processes import sitecustomize as coarse
from tests.support.exchange.imported import curves_object, lines_on
from tests.support.guide_tools import wave
from tests.support.reading import vertex_positions


@pytest.fixture(scope="session", autouse=True)
def blender():
    """Register the add-on in Blender, with a GPU context: once per process."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.filepaths.use_file_compression = False  # files are saved and loaded sooner
    if not hasattr(bpy.types.Curves, "vellus"):
        hair_addon.register()
    gpu.init()
    yield
    if hasattr(bpy.types.Curves, "vellus"):
        hair_addon.unregister()


@pytest.fixture(autouse=True)
def functions_remember(monkeypatch):
    """Compute tables and roots once per process: the add-on clears its own caches with every file."""
    remembered.remember(monkeypatch)


# The initial scenes of most tests; each builds on the previous ones.
STAGES = ("sphere", "guides", "hair")


def add_sphere():
    """Make a sphere of one meter with a UV map and a vertex group `top` on its upper half."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=1.0)
    sphere = bpy.context.object
    sphere.name = "Sphere"
    group = sphere.vertex_groups.new(name="top")
    group.add([int(i) for i in np.flatnonzero(vertex_positions(sphere)[:, 2] > 0.0)], 1.0, "REPLACE")


def add_guides(relax_iterations):
    """Distribute 60 guides over the active sphere."""
    bpy.ops.vellus.distribute_guides(guide_count=60, length=0.5, relax_iterations=relax_iterations)


def add_hair():
    """Interpolate 500 strands between the guides."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    bpy.ops.vellus.interpolate_hair(strand_count=500, radius=0.004, influence_distance=0.03)


@pytest.fixture(scope="session")
def scene_files(blender, tmp_path_factory):
    """Return {stage or "empty": a file}, which loads in 8 ms; creating the scene takes up to 40 ms.

    All contain the nodes that deform hair, which take 17 ms to append. Their pictures are drawn with dual scattering,
    which is faster; tests of the light grid select it.
    """
    folder, files = tmp_path_factory.mktemp("scenes"), {}

    def save(stage):
        for group in bpy.data.node_groups:
            group.use_fake_user = True  # to be written
        files[stage] = folder / f"{stage}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(files[stage]), copy=True)

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.context.scene.vellus.multiple_scattering = "DUAL"
    bpy.context.scene.render.filter_size = 0.0  # pixels contain only their own samples, also at edges
    bpy.ops.mesh.primitive_plane_add()
    bpy.ops.vellus.distribute_guides(guide_count=3)
    for made in (*bpy.data.objects, *bpy.data.meshes, *bpy.data.hair_curves):
        bpy.data.batch_remove([made])
    save("empty")
    for stage, add in zip(STAGES, (add_sphere, partial(add_guides, 0), add_hair), strict=True):
        bpy.ops.wm.read_homefile(filepath=str(list(files.values())[-1]))
        bpy.context.view_layer.objects.active = bpy.data.objects.get("Sphere")
        add()
        save(stage)
    return files


# Side of the maps of world light in texels, the least number of strands drawn into them, as coarse maps resolve fewer,
# and the number of maps: the first six face the sides of a cube.
FINE_WORLD = (ambient_visibility._SIZE, ambient_visibility._LEAST_STRANDS, len(ambient_cube.DIRECTIONS))
COARSE_WORLD = (coarse.WORLD_SIZE, coarse.WORLD_STRANDS, coarse.WORLD_MAPS)
_DIRECTIONS, _WEIGHTS = ambient_cube.DIRECTIONS, ambient_cube.WEIGHTS


def set_world_maps(patch, size, least_strands, map_count):
    """Set the size and the number of these maps; patch: a `pytest.MonkeyPatch`."""
    patch.setattr(ambient_visibility, "_SIZE", size)
    patch.setattr(ambient_visibility, "_LEAST_STRANDS", least_strands)
    patch.setattr(ambient_cube, "DIRECTIONS", _DIRECTIONS[:map_count])
    patch.setattr(ambient_cube, "WEIGHTS", _WEIGHTS[:map_count] / _WEIGHTS[:map_count].sum())


@pytest.fixture
def scene(scene_files, request, monkeypatch):
    """Return an empty scene with undo; preferences, which take longer to load, are those of the process.

    The nodes that deform hair are in memory, as after deleting hair; use `read_homefile` for a scene without them. The
    data of the test's other fixtures of this file is loaded already, as in an opened file. The maps of light are as
    small as the pictures of tests, and those of world light fewer, as others would take most of the time.
    """
    shrink_shadows(monkeypatch)
    wanted = [*takewhile(request.fixturenames.__contains__, STAGES)]
    if "made_anew" in request.fixturenames:
        wanted = []
    elif "guides" in wanted and request.getfixturevalue("relax_iterations"):
        wanted = ["sphere"]
    bpy.ops.wm.read_homefile(filepath=str(scene_files[wanted[-1] if wanted else "empty"]))
    for group in bpy.data.node_groups:
        group.use_fake_user = False
    bpy.context.preferences.edit.use_global_undo = True
    return bpy.context.scene


@pytest.fixture
def made_anew():
    """Create the scene instead of loading it, for tests of caches of newly created data."""


@pytest.fixture
def sphere(scene):
    """Return a sphere of one meter with a UV map and a vertex group `top` on its upper half; active."""
    if "Sphere" not in bpy.data.objects:
        add_sphere()
    sphere = bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    bpy.ops.ed.undo_push(message="sphere")
    return sphere


@pytest.fixture
def relax_iterations():
    """Number of relaxation steps of `guides`: zero, as they would take half of the time of most tests."""
    return 0


# For tests that need evenly spaced guides.
even_guides = pytest.mark.parametrize("relax_iterations", [GuideSettings().relax_iterations])


@pytest.fixture
def guides(sphere, relax_iterations):
    """60 guides on the sphere; their object is active."""
    if "Guides" not in bpy.data.objects:
        add_guides(relax_iterations)
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    return bpy.data.objects["Guides"]


@pytest.fixture
def hair(guides):
    """500 strands between the guides; their object is active."""
    if "Hair" not in bpy.data.objects:
        add_hair()
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    return bpy.data.objects["Hair"]


@pytest.fixture
def arm(scene):
    """Return a cylinder of 4 m along X, bent by its second bone from straight in frame 1 to a right angle in frame
    11.
    """
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=40, y_subdivisions=24, size=2.0)
    arm = bpy.context.object
    for vertex in arm.data.vertices:
        x, turn = 2.0 * vertex.co.x, np.pi * vertex.co.y
        vertex.co = (x, 0.5 * np.cos(turn), 0.5 * np.sin(turn))
    bpy.ops.object.armature_add(enter_editmode=True)
    rig = bpy.context.object
    bones = rig.data.edit_bones
    bones[0].head, bones[0].tail, bones[0].name = (-2, 0, 0), (0, 0, 0), "upper"
    lower = bones.new("lower")
    lower.head, lower.tail, lower.parent = (0, 0, 0), (2, 0, 0), bones[0]
    bpy.ops.object.mode_set(mode="OBJECT")
    for name, sign in (("upper", -1.0), ("lower", 1.0)):
        group = arm.vertex_groups.new(name=name)
        for vertex in arm.data.vertices:
            group.add([vertex.index], float(np.clip(0.5 + sign * vertex.co.x, 0.0, 1.0)), "REPLACE")
    arm.modifiers.new("Armature", "ARMATURE").object = rig
    bone = rig.pose.bones["lower"]
    bone.rotation_mode = "XYZ"
    for frame, angle in ((1, 0.0), (11, np.pi / 2)):
        bone.rotation_euler.x = angle
        bone.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(1)
    bpy.context.view_layer.update()
    return arm


def shrink_shadows(patch):
    """Set small maps of both kinds, also for pictures that several tests share; patch: a `pytest.MonkeyPatch`."""
    set_world_maps(patch, *COARSE_WORLD)
    patch.setattr(scene_lights, "_MAP_SIZE", coarse.LAMP_SIZE)


@pytest.fixture
def fine_shadows(scene, monkeypatch):
    """Shadow maps of normal size, for laws of shadows."""
    set_world_maps(monkeypatch, *FINE_WORLD)
    monkeypatch.setattr(scene_lights, "_MAP_SIZE", 512)


@pytest.fixture
def fine_world(scene, monkeypatch):
    """Maps of world light of normal size, for laws of ambient visibility."""
    set_world_maps(monkeypatch, *FINE_WORLD)


@pytest.fixture
def lit(hair):
    """Return the sphere with hair, a camera in front of it and a sun behind the camera."""
    blender_scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -8.0, 0.0), (math.pi / 2, 0.0, 0.0)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3.0, (math.pi / 3, 0.0, 0.0)
    for new in (camera, sun):
        blender_scene.collection.objects.link(new)
    blender_scene.camera = camera
    return hair


@pytest.fixture
def blender_scene(scene):
    """Return the empty scene, for tests that import a module named `scene`."""
    return scene


@pytest.fixture
def thin(lit):
    """Hair whose strands are a fifth of a pixel wide."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    bpy.data.objects["Hair"].data.vellus.hair.strand_count = 4000
    bpy.data.objects["Hair"].data.vellus.hair.radius = 0.003
    bpy.context.view_layer.update()
    return lit


@pytest.fixture
def head(sphere):
    """Return the sphere, turned, moved and scaled."""
    sphere.location, sphere.rotation_euler, sphere.scale = (1.0, 2.0, 3.0), (0.3, 0.2, 0.5), (2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    return sphere


@pytest.fixture
def imported(head, rng):
    """60 curves of 2 to 12 points around the head, with an attribute, an object transform and no surface."""
    made = curves_object(list(lines_on(head, rng)))
    made.location = (0.3, -0.2, 0.1)  # cleared afterwards
    made.data.attributes["position"].data.foreach_set(
        "vector", (curves.read_points(made.data) - np.float32(made.location)).ravel()
    )
    named = made.data.attributes.new("clump", "INT", "CURVE")
    named.data.foreach_set("value", np.arange(60, dtype=np.int32))
    made.data.materials.append(bpy.data.materials.new("Artist's"))
    bpy.context.view_layer.update()
    return made


@pytest.fixture
def waved(hair):
    """Hair whose guides were combed to waves, and a mesh that cuts every guide."""
    wave(bpy.data.objects["Guides"])
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=1.2)
    bpy.context.object.name = "Cutter"
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    bpy.ops.ed.undo_push(message="combed")
    return bpy.data.objects["Hair"]


@pytest.fixture
def in_window(monkeypatch):
    """Act as in a window, where the picture is ahead of the Curves until `live_hair.write_all`."""
    monkeypatch.setattr(running, "has_window", lambda: True)
    yield
    live_hair.cancel_writing()
    invalidation.data_replaced()


@pytest.fixture
def window(scene):
    """Return the context of a window, whose timers are counted."""
    timers = []
    manager = SimpleNamespace(
        event_timer_add=lambda seconds, window: timers.append(seconds) or "timer",
        event_timer_remove=lambda timer: timers.pop(),
        modal_handler_add=lambda operator: None,
    )
    status = []
    yield SimpleNamespace(
        window_manager=manager,
        window=None,
        workspace=SimpleNamespace(status_text_set=status.append),
        screen=SimpleNamespace(areas=[]),
        timers=timers,
        status=status,
    )
    assert not timers and running.job() is None
