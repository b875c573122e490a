# SPDX-License-Identifier: GPL-3.0-or-later
"""Import Groom reads files by our own readers, with unit, axis and all objects, onto the active mesh."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.strands import attributes, exported_curves
from hair_addon.blender.groom.foreign import kept_hair
from hair_addon.blender.io import curve_files, curve_objects
from hair_addon.blender.ui import menus, panels
from hair_addon.core.errors import HairError
from tests.support.commands import run_here
from tests.support.dynamics.following import update
from tests.support.exchange.alembic_files import of_maya
from tests.support.exchange.imported import curves_object, lines_on, world
from tests.support.interface.layout import draw
from tests.support.reading import points


@pytest.fixture
def lines(sphere, rng):
    """Return 12 lines of 5 points on a sphere that is elsewhere, in the world."""
    sphere.location, sphere.scale = (0.4, -0.3, 1.5), (0.1, 0.1, 0.1)
    update()
    return np.float32(list(lines_on(sphere, rng, 12, 5, 5)))


def run(path, **given):
    """Import, and return the new (guides, hair) objects, None for no hair."""
    before = set(bpy.data.objects)
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    assert bpy.ops.vellus.import_groom(filepath=str(path), **given) == {"FINISHED"}
    update()
    made = {one.data.vellus.kind: one for one in set(bpy.data.objects) - before}
    return made["GUIDES"], made.get("HAIR")


def in_world(shown):
    matrix = np.array(shown.matrix_world)
    return points(shown) @ matrix[:3, :3].T + matrix[:3, 3]


def test_curves_of_another_program_are_hair_where_they_belong(scene, sphere, lines, tmp_path):
    """Curves of another program become hair at the right place, by unit and axis given or detected; errors leave
    nothing behind.
    """
    path = tmp_path / "curves.abc"
    of_maya(path, lines)
    for reported in ({}, {"unit": "cm", "up": "Y"}):
        guides, hair = run(path, guide_count=4, **reported)
        np.testing.assert_allclose(in_world(hair), lines, atol=1e-6)
        assert hair.data.surface == sphere and len(guides.data.curves) == 4
        radii = np.array([one.value for one in hair.data.attributes["radius"].data])
        np.testing.assert_allclose(0.1 * radii, 0.5e-4, rtol=1e-5)
        assert bpy.context.object == hair
    _guides, hair = run(path, object_name="curve3")
    np.testing.assert_allclose(in_world(hair), lines[3:4], atol=1e-6)
    before = sorted(bpy.data.objects.keys()), sorted(bpy.data.hair_curves.keys())
    bpy.context.view_layer.objects.active = sphere
    for wrong, words in (({"unit": "m"}, "in centimeters with Y up"), ({"object_name": "fringe"}, "no curves")):
        with pytest.raises(RuntimeError, match=words):
            bpy.ops.vellus.import_groom(filepath=str(path), **wrong)
    monkey = bpy.data.meshes.new("No faces")
    lone = bpy.data.objects.new("No faces", monkey)
    scene.collection.objects.link(lone)
    bpy.context.view_layer.objects.active = lone
    with pytest.raises(RuntimeError, match="no faces"):
        bpy.ops.vellus.import_groom(filepath=str(path))
    bpy.data.objects.remove(lone)
    assert (sorted(bpy.data.objects.keys()), sorted(bpy.data.hair_curves.keys())) == before


@pytest.mark.parametrize("ending", [".usdc", ".abc", ".npz"])
def test_our_own_grooms_come_back(hair, tmp_path, ending):
    """Grooms of ours are read back to the last micrometer: guides as guides, and hair as hair with its guides."""
    path = tmp_path / f"groom{ending}"
    guides = bpy.data.objects["Guides"]
    bpy.data.objects["Sphere"].location = (1.0, 2.0, 3.0)
    update()
    if ending == ".npz":
        np.savez(path, guide_points=api.points(guides), strand_points=api.points(hair), up="Z")
    else:
        api.export_groom(path, [hair])
    expected = in_world(guides), in_world(hair)
    its_guides, read = run(path)
    np.testing.assert_allclose(in_world(read), expected[1], atol=2e-6)
    np.testing.assert_allclose(in_world(its_guides), expected[0], atol=2e-6)
    its_guides, read = run(path, kind="GUIDES")
    np.testing.assert_allclose(in_world(its_guides), expected[0], atol=2e-6)
    assert read.data.vellus.guide_curves == its_guides.data and len(read.data.curves) > 100


def test_attributes_of_a_groom_are_attributes_of_curves(hair, tmp_path):
    """IDs, groups, weights, radii, UV coordinates of roots and colors of an .abc file are those that were exported."""
    path = tmp_path / "groom.abc"
    api.export_groom(path, [hair], has_color=True)
    sets = {one.is_guide: one for one in curve_files.read(path).sets}
    _guides, read = run(path)

    def values(name, kind, domain):
        return attributes.read(read.data, name, kind, domain)

    np.testing.assert_array_equal(values("id", "INT", "CURVE"), sets[False].ids)
    np.testing.assert_array_equal(values("groom_group_id", "INT", "CURVE"), sets[False].group_id)
    np.testing.assert_array_equal(values("groom_root_uv", "FLOAT2", "CURVE"), sets[False].root_uvs)
    np.testing.assert_array_equal(values("groom_color", "FLOAT_COLOR", "POINT")[:, :3], sets[False].colors)
    np.testing.assert_allclose(values("radius", "FLOAT", "POINT"), 0.01 * sets[False].radii, rtol=1e-6)
    indices, weights = exported_curves.read_guide_map(read.data, len(sets[True]))
    is_used = weights > 0.0
    np.testing.assert_array_equal(sets[True].ids[indices][is_used], sets[False].guide_ids[is_used])
    np.testing.assert_array_equal(weights[is_used], sets[False].guide_weights[is_used])
    assert len(np.unique(sets[False].colors, axis=0)) >= 1 and is_used.any()


@pytest.mark.parametrize("is_saved", [True, False])
def test_hair_that_moves_plays_where_the_scene_was_saved(scene, sphere, lines, tmp_path, is_saved, capfd):
    made = curves_object(lines)
    expected = []
    for frame in (1, 2):
        made.location = (0.1 * (frame - 1), 0.0, 0.0)
        made.keyframe_insert("location", frame=frame)
    for frame in (1, 2):
        scene.frame_set(frame)
        expected.append(world(made))
    bpy.ops.wm.usd_export(filepath=str(tmp_path / "moving.usdc"), export_animation=True, selected_objects_only=False)
    bpy.data.objects.remove(made)
    scene.frame_set(1)
    if is_saved:
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    _guides, hair = run(tmp_path / "moving.usdc", object_name="Imported")
    bpy.context.scene.frame_set(2)
    np.testing.assert_allclose(world(hair), expected[1 if is_saved else 0], atol=1e-5)
    assert ("are read only at frame 1" in capfd.readouterr().out) != is_saved


def test_it_is_in_the_menu_and_in_the_panel(hair, monkeypatch):
    assert draw(bpy.types.VELLUS_PT_output).drawn["vellus.import_groom"] == 1
    assert ("TOPBAR_MT_file_import", menus._in_import_menu) in menus._ENTRIES
    assert panels.CLASSES and bpy.ops.vellus.import_groom.poll()
    bpy.context.view_layer.objects.active = None
    assert not bpy.ops.vellus.import_groom.poll()


@pytest.fixture
def two_systems(hair, tmp_path):
    """Return ({strand count: points of the hair} of two hair systems on a sphere, and the file of both)."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    bpy.ops.vellus.add_hair(guide_count=15, strand_count=70, length=0.2)
    update()
    path = tmp_path / "two.abc"
    api.export_groom(path, [hair, bpy.context.object])
    return {len(one.data.curves): world(one) for one in (hair, bpy.context.object)}, path


def test_groups_become_hair_systems_with_their_own_guides(two_systems):
    """Each group of a groom is a hair system: its strands, and guides whose weights are those of the group."""
    wanted, path = two_systems
    before = set(bpy.data.hair_curves)
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    assert bpy.ops.vellus.import_groom(filepath=str(path), by_group=True) == {"FINISHED"}
    update()
    made = [one for one in set(bpy.data.hair_curves) - before if one.vellus.kind == "HAIR"]
    assert {len(one.curves) for one in made} == set(wanted) == {500, 70}
    assert len({one.vellus.guide_curves for one in made}) == 2
    shown = {one.data: one for one in bpy.data.objects if one.data in made}
    for one in made:
        np.testing.assert_allclose(world(shown[one]), wanted[len(one.curves)], atol=1e-6)
        assert (len(one.vellus.guide_curves.curves) == 15) == (len(one.curves) == 70)
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    assert bpy.ops.vellus.import_groom(filepath=str(path)) == {"FINISHED"}
    assert max(len(one.curves) for one in bpy.data.hair_curves) == 570  # without the option


def test_groups_are_all_imported_or_none(two_systems, monkeypatch):
    """A failure in the second group leaves nothing of the first one."""
    _wanted, path = two_systems
    before, used = sorted(bpy.data.objects.keys()), []

    def failing(*given, **options):
        used.append(given)
        if len(used) == 2:
            raise HairError("No room.")
        return using(*given, **options)

    using = kept_hair.using_as_hair
    monkeypatch.setattr(kept_hair, "using_as_hair", failing)
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    with pytest.raises(RuntimeError, match="No room"):
        bpy.ops.vellus.import_groom(filepath=str(path), by_group=True)
    assert sorted(bpy.data.objects.keys()) == before and len(used) == 2


def test_scripts_get_all_groups_or_none(two_systems, monkeypatch):
    _wanted, path = two_systems
    before, made = sorted(bpy.data.objects.keys()), []

    def failing(*given, **options):
        made.append(new_object(*given, **options))
        if len(made) == 3:
            raise HairError("No room.")
        return made[-1]

    new_object = curve_objects.new_object
    monkeypatch.setattr(curve_objects, "new_object", failing)
    with pytest.raises(HairError, match="No room"):
        api.import_groups(path, bpy.data.objects["Sphere"])
    assert sorted(bpy.data.objects.keys()) == before


def test_scripts_and_the_command_line_read_groups_too(two_systems, tmp_path):
    wanted, path = two_systems
    found = api.import_groups(path, bpy.data.objects["Sphere"])
    assert [len(one.curves.data.curves) for one in found] == [*wanted]
    assert [len(one.guides.data.curves) for one in found][1] == 15
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.mesh.primitive_uv_sphere_add()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "head.blend"))
    words = ("groom", tmp_path / "head.blend", "--hair-from", path, "--by-group", "--out")
    (told,) = run_here(*words, tmp_path / "out.blend", "--json").results
    assert (told["systems"], told["strands"]) == (2, 570)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert {len(one.curves) for one in bpy.data.hair_curves if one.vellus.kind == "HAIR"} == {500, 70}
    ended = run_here(*words, tmp_path / "out.usdc")
    assert ended.status == 1 and "needs a .blend file as output" in ended.errors
    ended = run_here("groom", tmp_path / "head.blend", "--by-group", "--out", tmp_path / "o.blend")
    assert ended.status == 1 and "--by-group needs --guides-from or --hair-from" in ended.errors
    with pytest.raises(HairError, match="objects instead of groups"):
        api.import_groups(tmp_path / "out.blend", bpy.context.view_layer.objects.active)
