# SPDX-License-Identifier: GPL-3.0-or-later
"""New hair with default settings covers its surface, follows its size, and is the same by every interface."""

import math

import bpy
import numpy as np
import pytest
from mathutils import Vector

from hair_addon import api
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.kernels import kernel_cache, kernel_setup
from hair_addon.core.params import from_surface
from tests.support import remembered
from tests.support.commands import run_here
from tests.support.devices import DEVICE
from tests.support.pairs import share_of_rows
from tests.support.reading import points

FEW = {"guide_count": 40, "strand_count": 300}


def add_cube(scene):
    bpy.ops.mesh.primitive_cube_add()
    return bpy.context.object


def add_monkey(scene):
    bpy.ops.mesh.primitive_monkey_add()
    return bpy.context.object


def look_from(direction):
    """Add a camera that sees a surface of two meters and its hair from a side."""
    scene, away = bpy.context.scene, Vector(direction).normalized()
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(scene.camera)
    scene.camera.location = 6.5 * away
    scene.camera.rotation_euler = away.to_track_quat("Z", "Y").to_euler()
    bpy.context.view_layer.update()


def alpha():
    return api.draw(width=48, height=48, samples_per_side=1, is_transparent=True)[..., 3]


def coverage(surface, hair):
    """Return the mean alpha of hair over its surface's silhouette, and the part of the silhouette that is half
    covered.
    """
    strands = next(o for o in bpy.data.objects if o.data == hair)
    surface.is_holdout, strands.hide_render = False, True
    silhouette = alpha() == 1.0
    surface.is_holdout, strands.hide_render = True, False
    covered = alpha()[silhouette]
    assert silhouette.sum() > 150
    return covered.mean(), (covered > 0.5).mean()


def sizes(guides, hair):
    """Return {name: value} of the settings that follow from the surface."""
    owners = (guides.vellus.guides, GuideSettings), (hair.vellus.hair, HairSettings)
    return {name: getattr(group, name) for group, settings in owners for name in from_surface(settings)}


def scaled(found, factor):
    """Return `sizes` for a surface that is larger by a factor: lengths are scaled, gravity is not."""
    return {name: value if name == "gravity" else factor * value for name, value in found.items()}


def hair_on(surface, **changes):
    """Return (guides, hair) of new hair; changes: of the operator's settings."""
    bpy.context.view_layer.objects.active = surface
    before = set(bpy.data.hair_curves)
    assert bpy.ops.vellus.add_hair("EXEC_DEFAULT", True, **changes) == {"FINISHED"}  # as a window does, with undo
    made = set(bpy.data.hair_curves) - before
    return sorted(made, key=lambda curves: curves.vellus.kind)


@pytest.mark.parametrize(
    ("add", "side"), share_of_rows([(add_cube, (0.3, -0.5, 1.0)), (add_monkey, (0.2, -1.0, 0.2))], 2)
)
def test_hair_covers_its_surface(scene, add, side):
    surface = add(scene)
    _guides, hair = hair_on(surface)
    look_from(side)
    mean, half_covered = coverage(surface, hair)
    assert mean >= 0.7 and half_covered >= 0.7


@pytest.fixture
def kernel_modules(monkeypatch):
    """Return (loaded, launched): names of modules that were loaded before the work, and of modules that it used."""
    remembered.forget(monkeypatch)
    loaded, launched = set(), set()
    load_together, load = kernel_setup.load, kernel_cache.load

    def note_loaded(modules, *arguments, **named):
        modules = list(modules)
        loaded.update(module.name for module in modules)
        load_together(modules, *arguments, **named)

    def note_launched(device, *modules):
        launched.update(module.name for module in modules)
        load(device, *modules)

    monkeypatch.setattr(kernel_setup, "load", note_loaded)
    monkeypatch.setattr(kernel_cache, "load", note_launched)
    return loaded, launched


@pytest.mark.parametrize(("group", "is_draped"), [("", False), ("top", True)])
def test_first_hair_waits_for_the_kernels_that_it_launches(sphere, kernel_modules, group, is_draped):
    """First hair waits only for the kernels that it launches, and others are compiled later in the background."""
    guides, _hair = hair_on(sphere, strand_count=300, density_group=group)
    assert guides.vellus.guides.drape == is_draped
    loaded, launched = kernel_modules
    if DEVICE == "cpu":
        assert loaded == launched
    else:
        assert launched <= loaded


@pytest.mark.parametrize("scale", [0.02, 2.0])
def test_hair_follows_the_size_in_the_world(sphere, scale):
    """Hair follows the size in the world, of a scaled object and of a scaled mesh."""
    expected = sizes(*hair_on(sphere, **FEW))
    sphere.scale = (scale,) * 3
    bpy.context.view_layer.update()
    larger = hair_on(sphere, **FEW)
    assert sizes(*larger) == pytest.approx(scaled(expected, scale), rel=0.006)
    assert (len(larger[0].curves), len(larger[1].curves)) == (40, 300)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=scale)
    assert sizes(*hair_on(bpy.context.object, **FEW)) == pytest.approx(sizes(*larger), rel=0.006)


def test_hair_follows_modifiers(sphere):
    """Hair is rooted on the mesh after its modifiers, as an artist sees it."""
    expected = sizes(*hair_on(sphere, **FEW))
    displace = sphere.modifiers.new("Displace", "DISPLACE")
    displace.strength, displace.mid_level = 1.0, 0.0
    bpy.context.view_layer.update()
    found = sizes(*hair_on(sphere, **FEW))
    assert found == pytest.approx(scaled(expected, 2.0), rel=0.02)


def test_hair_follows_the_masked_part(sphere):
    whole, half = (sizes(*hair_on(sphere, **FEW, density_group=group)) for group in ("", "top"))
    assert half["length"] > 2.0 * whole["length"]  # of a dome: long hair, which hangs
    assert half["gravity"] > whole["gravity"]
    assert half["influence_distance"] == pytest.approx(whole["influence_distance"] * math.sqrt(0.5), rel=0.05)


def test_all_ways_grow_the_same_hair_where_no_size_is_given(sphere, tmp_path):
    sphere.scale = (1.3, 0.4, 0.7)
    bpy.context.view_layer.update()
    blend, out = tmp_path / "surface.blend", tmp_path / "groom.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    made = {}

    def keep(way):
        hair = bpy.data.hair_curves["Hair"]
        guides = hair.vellus.guide_curves
        radii = np.empty(len(hair.points), np.float32)
        hair.attributes["radius"].data.foreach_get("value", radii)
        found = (points(next(o for o in bpy.data.objects if o.data == its)) for its in (guides, hair))
        made[way] = [*found, radii, np.array(list(sizes(guides, hair).values()))]
        bpy.ops.wm.open_mainfile(filepath=str(blend))
        bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
        return bpy.data.objects["Sphere"]

    bpy.ops.vellus.add_hair(**FEW, density_group="top")  # on a dome: draped
    surface = keep("add hair")
    bpy.ops.vellus.distribute_guides(guide_count=40, density_group="top")
    bpy.ops.vellus.interpolate_hair(strand_count=300)
    surface = keep("one after the other")
    guides = api.distribute_guides(surface, guide_count=40, density_group="top", drape=True)
    api.interpolate_hair(guides, strand_count=300)
    surface = keep("script")
    of_guides = api.GuideSettings(guide_count=40, density_group="top", drape=True)
    settings = api.GroomSettings(of_guides, api.HairSettings(strand_count=300))
    api.add_hair(surface, settings)
    surface = keep("script, in one step")
    api.save_settings(tmp_path / "groom.json", settings)
    api.add_hair(surface, api.load_settings(tmp_path / "groom.json"))
    surface = keep("file of settings")
    _guides, hair = api.add_hair(surface, api.GroomSettings(hair=api.HairSettings(strand_count=5, radius=0.5)))
    api.apply_settings(hair, settings)
    bpy.context.view_layer.update()
    keep("settings given later")
    command = ("groom", blend, "--guides", 40, "--strands", 300, "--density-group", "top", "--drape", "--out", out)
    assert run_here(*command).status == 0
    bpy.ops.wm.open_mainfile(filepath=str(out))
    keep("command line")
    first = made.pop("add hair")
    for way, found in made.items():
        for expected, came in zip(first, found, strict=True):
            assert np.array_equal(expected, came), way


@pytest.mark.parametrize("given", [{"length": 0.7}, {"radius": 0.004}, {"influence_distance": 0.2}, {"thickness": 8.0}])
def test_what_is_given_stays_and_the_rest_follows(sphere, given):
    free, found = sizes(*hair_on(sphere, **FEW)), sizes(*hair_on(sphere, **FEW, **given))
    given = {"radius": 0.004} if "thickness" in given else given
    assert found == pytest.approx(free | given)


def test_a_redo_with_what_is_shown_changes_nothing_else(sphere):
    """A redo with the shown settings changes nothing, as Blender calls an operator again with all that its panel
    shows.
    """
    guides, hair = hair_on(sphere, **FEW)
    shown = bpy.context.window_manager.operator_properties_last("vellus.add_hair")
    values = {name: getattr(shown, name) for name in (*sizes(guides, hair), "thickness")}
    assert values == pytest.approx(sizes(guides, hair) | {"thickness": hair.vellus.hair.thickness})
    again = hair_on(sphere, **FEW | {"guide_count": 41}, **values)
    assert sizes(*again) == sizes(guides, hair)
    assert len(again[0].curves) == 41


def test_another_surface_gets_sizes_of_its_own(sphere):
    """Another surface gets its own sizes, although an operator remembers its last settings."""
    free = sizes(*hair_on(sphere, **FEW))
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=0.1)
    found = sizes(*hair_on(bpy.context.object, **FEW))
    assert found == pytest.approx(scaled(free, 0.1), rel=0.006)


def test_hair_that_is_there_keeps_its_sizes(hair):
    sphere, guides = bpy.data.objects["Sphere"], bpy.data.objects["Guides"].data
    before = sizes(guides, hair.data)
    sphere.scale = (3.0, 3.0, 3.0)
    bpy.context.view_layer.update()
    hair.data.vellus.hair.strand_count = 200
    bpy.context.view_layer.update()
    assert len(hair.data.curves) == 200 and sizes(guides, hair.data) == before


def test_thickness_is_the_diameter_in_millimeters(hair):
    group = hair.data.vellus.hair
    group.radius = 0.004
    assert group.thickness == pytest.approx(8.0)
    group.thickness = 0.08
    assert group.radius == pytest.approx(4e-5) and hair.data.vellus.is_stale
    bpy.context.view_layer.update()
    radii = np.empty(len(hair.data.points), np.float32)
    hair.data.attributes["radius"].data.foreach_get("value", radii)
    assert radii.max() == pytest.approx(4e-5)
    bpy.context.scene.unit_settings.scale_length = 0.01
    assert group.thickness == pytest.approx(0.0008)
    group.thickness = -1.0
    assert 0.0 < group.radius < 1e-6
    assert api.settings_of(hair).hair.radius > 0.0


def test_keys_on_thickness_move_the_strands(hair):
    group = hair.data.vellus.hair
    for frame, thickness in ((1, 2.0), (11, 6.0)):
        group.thickness = thickness
        assert group.keyframe_insert("thickness", frame=frame)
    for frame, thickness in ((6, 4.0), (11, 6.0), (1, 2.0)):
        bpy.context.scene.frame_set(frame)
        radii = np.empty(len(hair.data.points), np.float32)
        hair.data.attributes["radius"].data.foreach_get("value", radii)
        assert 2e3 * radii.max() == pytest.approx(thickness, rel=1e-4)


def test_undo_takes_a_thickness_back(hair):
    before = hair.data.vellus.hair.radius
    bpy.ops.ed.undo_push(message="before")
    hair.data.vellus.hair.thickness = 55.0
    bpy.ops.ed.undo_push(message="thick")
    bpy.ops.ed.undo()
    assert bpy.data.objects["Hair"].data.vellus.hair.radius == before
