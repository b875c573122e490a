# SPDX-License-Identifier: GPL-3.0-or-later
"""Alembic grooms for Unreal have the posed positions in Blender and in an independent reader, or are refused with
notes.
"""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon.blender.data import scene
from hair_addon.blender.data.simulation import guide_poses
from hair_addon.blender.groom.dynamics import frame_folders
from hair_addon.core.errors import HairError
from tests.support.dynamics.following import update
from tests.support.exchange import alembic_reader
from tests.support.exchange.exported import LAST, export, shape, widths, world
from tests.support.reading import attribute, points, write_points

NAMES = ("P", "nVertices", "curveBasisAndType", "width", ".selfBnds")  # of curves in any Alembic file


# Contents of the files.


def test_curves_are_in_centimeters_where_they_are_seen(twisted, tmp_path):
    hair, guides = twisted
    made = export(tmp_path / "groom.abc")
    assert (made.groups, made.guides, made.strands, made.notes) == (1, 60, 500, [])
    archive = alembic_reader.read(tmp_path / "groom.abc")
    for name, shown in (("Hair", hair), ("Hair_guides", guides)):
        found = shape(archive, name)
        np.testing.assert_allclose(found["P"].only, 100.0 * world(shown).reshape(-1, 3), atol=1e-3)
        np.testing.assert_allclose(found["groom_width"].only, 100.0 * widths(shown), rtol=1e-5)
        np.testing.assert_array_equal(found["groom_width"].only, found["width"].only)
        np.testing.assert_array_equal(found["groom_root_uv"].only, attribute(shown, "surface_uv_coordinate", 2))
        assert found["groom_guide"].only[0] == (shown == guides)


def test_properties_are_as_blender_writes_them(hair, tmp_path):
    """Properties have the same types and metadata as those written by Blender, which uses Alembic's library."""
    bpy.ops.wm.alembic_export(filepath=str(tmp_path / "blender.abc"), start=1, end=1, as_background_job=False)
    export(tmp_path / "groom.abc")
    theirs, ours = (alembic_reader.read(tmp_path / f"{name}.abc") for name in ("blender", "groom"))
    (name,) = (path for path in alembic_reader.objects(theirs) if path.endswith("Hair/Hair"))
    written, made = alembic_reader.objects(theirs)[name], alembic_reader.objects(ours)["/groom/Hair/HairShape"]
    assert written.metadata == made.metadata
    pairs = {".geom": (written.properties[".geom"], made.properties[".geom"])}
    pairs |= {
        name: (p, pairs[".geom"][1].children[name]) for name, p in pairs[".geom"][0].children.items() if name in NAMES
    }
    assert set(pairs) == {".geom", *NAMES}
    for name, (wanted, found) in pairs.items():
        assert (wanted.form, wanted.kind, wanted.extent) == (found.form, found.kind, found.extent), name
        assert wanted.metadata.items() <= found.metadata.items(), name
    assert ours.samplings[0][1:] == theirs.samplings[0][1:]


def test_blender_takes_the_curves_back(twisted, tmp_path):
    """Blender imports the curves with rotated axes and in the file's unit, as it assumes Y up and meters."""
    wanted = {len(o.data.curves): (100.0 * world(o), 100.0 * widths(o)) for o in twisted}
    export(tmp_path / "groom.abc")
    before = set(bpy.data.objects)
    bpy.ops.wm.alembic_import(filepath=str(tmp_path / "groom.abc"), as_background_job=False)
    update()
    came = [o for o in set(bpy.data.objects) - before if o.type == "CURVES"]
    assert sorted(o.name.split(".")[0] for o in came) == ["Hair", "Hair_guides"]
    for shown in came:
        points, diameters = wanted[len(shown.data.curves)]
        np.testing.assert_allclose(world(shown)[..., [0, 2, 1]] * (1.0, 1.0, -1.0), points, atol=2e-3)
        np.testing.assert_allclose(widths(shown), diameters, rtol=1e-5)


def test_strands_are_given_the_guides_that_weigh_most(hair, tmp_path):
    hair.data.vellus.hair.guide_map = True
    update()
    export(tmp_path / "groom.abc")
    archive = alembic_reader.read(tmp_path / "groom.abc")
    found, of_guides = shape(archive, "Hair"), shape(archive, "Hair_guides")["groom_id"].only
    ids, shares = found["groom_closest_guides"].only, found["groom_guide_weights"].only
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=1e-6)
    assert (np.diff(shares, axis=1) <= 0.0).all()
    slots = sum(name.startswith("guide_index_") for name in hair.data.attributes.keys())
    indices = np.stack([attribute(hair, f"guide_index_{slot}") for slot in range(slots)], axis=1)
    weights = np.stack([attribute(hair, f"guide_weight_{slot}") for slot in range(slots)], axis=1)
    for strand in range(len(ids)):
        of_strand = dict(zip(indices[strand], weights[strand], strict=True))
        named = [int(np.flatnonzero(of_guides == i)[0]) for i in ids[strand][shares[strand] > 0.0]]
        largest = sorted((w for i, w in of_strand.items() if i >= 0), reverse=True)[: len(named)]
        np.testing.assert_allclose([of_strand[i] for i in named], largest, rtol=1e-6)


def test_guide_weights_are_exported_whether_hair_stores_them_or_not(hair, tmp_path):
    """Exported guide weights are the same whether hair stores them, also after combing and in a file that was just
    opened.
    """
    guides = bpy.data.objects["Guides"]
    combed = points(guides).copy()
    combed[::2, 1:] += np.linspace(0.0, 0.2, combed.shape[1] - 1)[:, None] * np.float32([1.0, 0.5, 0.0])
    before = exported_map(tmp_path / "before.abc")
    write_points(guides, combed)
    update()
    assert "guide_index_0" not in hair.data.attributes
    computed = exported_map(tmp_path / "computed.abc")
    assert "guide_index_0" not in hair.data.attributes
    assert not np.array_equal(computed[1], before[1])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "groom.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "groom.blend"))
    opened = exported_map(tmp_path / "opened.abc")
    bpy.data.hair_curves["Hair"].vellus.hair.guide_map = True
    update()
    assert "guide_index_0" in bpy.data.hair_curves["Hair"].attributes
    stored = exported_map(tmp_path / "stored.abc")
    for found in (computed, opened):
        for array, expected in zip(found, stored, strict=True):
            np.testing.assert_array_equal(array, expected)


def exported_map(path):
    """Return the guides of strands and their weights from a new Alembic file."""
    export(path)
    found = shape(alembic_reader.read(path), "Hair")
    return found["groom_closest_guides"].only, found["groom_guide_weights"].only


def test_hair_whose_settings_have_just_changed_is_exported_as_they_are(hair, tmp_path):
    hair.data.vellus.hair.strand_count = 321
    made = export(tmp_path / "groom.abc")
    assert made.strands == 321
    assert len(shape(alembic_reader.read(tmp_path / "groom.abc"), "Hair")["P"].only) == 321 * 41


def test_hair_that_lost_its_guides_is_exported_alone(hair, tmp_path):
    bpy.data.hair_curves.remove(bpy.data.hair_curves["Guides"])
    made = export(tmp_path / "groom.abc")
    assert (made.guides, made.strands) == (0, 500) and "has no guides" in str(made.notes[0])
    found = shape(alembic_reader.read(tmp_path / "groom.abc"), "Hair")
    assert "groom_closest_guides" not in found and found["groom_id"].only[0] == 0


@pytest.mark.parametrize("ending", ["abc", "usdc", "hair"])
def test_empty_guides_are_left_out_and_empty_hair_is_one_sentence(hair, tmp_path, ending):
    guides = bpy.data.hair_curves["Guides"]
    hair.data.vellus.is_live = False
    guides.remove_curves()
    path = tmp_path / f"groom.{ending}"
    made = export(path, animation="NONE")
    assert (made.guides, made.strands) == (0, 500)
    path.unlink()
    hair.data.remove_curves()
    with pytest.raises(HairError, match='"Hair" has no strands'):
        export(path, animation="NONE")
    assert not path.exists()


@pytest.mark.parametrize("way", ["excluded", "deleted"])
def test_guides_without_an_object_are_where_they_were(twisted, tmp_path, way):
    """Guides in an excluded collection, or whose object was deleted, are exported in place."""
    _, guides = twisted
    wanted_points, wanted_widths = 100.0 * world(guides).reshape(-1, 3), 100.0 * widths(guides)
    if way == "deleted":
        bpy.data.objects.remove(guides)
    else:
        kept = bpy.data.collections.new("Kept")
        bpy.context.scene.collection.children.link(kept)
        kept.objects.link(guides)
        bpy.context.scene.collection.objects.unlink(guides)
        bpy.context.view_layer.layer_collection.children["Kept"].exclude = True
    assert export(tmp_path / "groom.abc").guides == 60
    found = shape(alembic_reader.read(tmp_path / "groom.abc"), "Hair_guides")
    np.testing.assert_allclose(found["P"].only, wanted_points, atol=1e-3)
    np.testing.assert_allclose(found["groom_width"].only, wanted_widths, rtol=1e-5)


def test_surfaces_and_hair_without_height_are_one_sentence(hair, tmp_path):
    sphere = bpy.data.objects["Sphere"]
    sphere.scale.z = 0.0
    update()
    with pytest.raises(HairError, match='"Sphere" has a scale of zero'):
        export(tmp_path / "groom.abc")
    sphere.scale.z, hair.scale.z = 1.0, 0.0
    update()
    assert export(tmp_path / "groom.abc").strands == 500
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Twin", hair.data))
    hair.name = "Flat"
    update()
    with pytest.raises(HairError, match='"Flat" has a scale of zero'):
        export(tmp_path / "groom.abc")


def test_guides_without_object_and_surface_are_one_sentence(hair, tmp_path):
    """Guides without an object and a surface are refused with one sentence, as their location is unknown."""
    guides = bpy.data.objects["Guides"]
    guides.data.surface = None
    bpy.data.objects.remove(guides)
    with pytest.raises(HairError, match='"Guides" has no object in this view layer'):
        export(tmp_path / "groom.abc")


def test_each_hair_is_a_group_with_its_guides(hair, tmp_path):
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    bpy.ops.vellus.add_hair(guide_count=20, strand_count=70, length=0.2)
    second = bpy.context.object
    second.data.name = "Flaum 1"
    made = export(tmp_path / "groom.abc")
    assert (made.groups, made.guides, made.strands) == (2, 80, 570)
    assert [str(note) for note in made.notes] == ['"Flaum 1" is called Flaum_1 in the file.']
    archive = alembic_reader.read(tmp_path / "groom.abc")
    groups = {name: shape(archive, name) for name in ("Hair", "Hair_guides", "Flaum_1", "Flaum_1_guides")}
    assert {name: int(found["groom_group_id"].only[0]) for name, found in groups.items()} == {
        "Hair": 0,
        "Hair_guides": 0,
        "Flaum_1": 1,
        "Flaum_1_guides": 1,
    }
    assert {name: found["groom_group_name"].only[0] for name, found in groups.items()} == {
        name: name.removesuffix("_guides") for name in groups
    }
    ids = np.concatenate([found["groom_id"].only for found in groups.values()])
    assert len(np.unique(ids)) == len(ids) == 650
    for name in ("Hair", "Flaum_1"):
        named = groups[name]["groom_closest_guides"].only
        assert np.isin(named, groups[f"{name}_guides"]["groom_id"].only).all()


def test_hair_of_several_objects_is_a_group_for_each(twisted, tmp_path):
    hair, _guides = twisted
    again = bpy.data.objects.new("Again", hair.data)
    bpy.context.scene.collection.objects.link(again)
    placed = Matrix.Translation((5.0, 1.0, 0.0)) @ Matrix.Rotation(0.7, 4, "Y") @ Matrix.Scale(2.0, 4)
    again.matrix_world = placed @ hair.matrix_world
    update()
    made = export(tmp_path / "groom.abc")
    assert (made.groups, made.guides, made.strands) == (2, 120, 1000)
    archive, matrix = alembic_reader.read(tmp_path / "groom.abc"), np.array(placed)
    first, second = (shape(archive, name) for name in ("Hair", "Hair_instance"))
    wanted = 100.0 * (world(hair).reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3])
    np.testing.assert_allclose(second["P"].only, wanted, atol=1e-3)
    np.testing.assert_allclose(second["groom_width"].only, 2.0 * first["groom_width"].only, rtol=1e-5)
    ids = [shape(archive, f"{name}_guides")["groom_id"].only for name in ("Hair", "Hair_instance")]
    for found, its in zip((first, second), ids, strict=True):
        assert np.isin(found["groom_closest_guides"].only, its).all()
    every = np.concatenate([*ids, first["groom_id"].only, second["groom_id"].only])
    assert len(np.unique(every)) == len(every) == 1120
    assert (first["groom_group_id"].only[0], second["groom_group_id"].only[0]) == (0, 1)


def test_colors_are_those_of_the_look_from_root_to_tip(hair, tmp_path):
    look = hair.data.vellus.appearance
    look.tip_absorption, look.random_color, look.random_roughness = 0.2, 0.5, 0.4
    update()
    export(tmp_path / "groom.abc")
    found = shape(alembic_reader.read(tmp_path / "groom.abc"), "Hair")
    colors = found["groom_color"].only.reshape(500, -1, 3)
    assert (colors > 0.0).all() and (colors < 1.0).all()
    assert (colors[:, -1] > colors[:, 0]).all(), "tips are bleached"
    darker = np.argsort(attribute(hair, "strand_random"))
    assert (np.diff(colors[darker, 0], axis=0) <= 1e-7).all(), "more pigment, less light"
    roughness = found["groom_roughness"].only.reshape(500, -1)
    assert (roughness == roughness[:, :1]).all() and 0.1 < np.ptp(roughness) < 0.5
    export(tmp_path / "groom.abc", has_color=False)
    assert "groom_color" not in shape(alembic_reader.read(tmp_path / "groom.abc"), "Hair")


def test_baked_guides_move_in_the_file(baked, tmp_path):
    bpy.context.scene.frame_set(3)
    made = export(tmp_path / "groom.abc", animation="GUIDES")
    assert made.frames == LAST and bpy.context.scene.frame_current == 3
    archive = alembic_reader.read(tmp_path / "groom.abc")
    moving, rate = shape(archive, "Hair_guides")["P"], bpy.context.scene.render.fps
    np.testing.assert_allclose(moving.times, [frame / rate for frame in range(1, LAST + 1)])
    cache, found = frame_folders.frames_of(baked.data), []
    for frame, sample in zip(range(1, LAST + 1), moving.samples, strict=True):
        bpy.context.scene.frame_set(frame)
        pose = guide_poses.read(baked.data, scene.present_depsgraph(), 1.0)
        wanted = 100.0 * pose.to_world(cache.read_frame(frame).points)
        np.testing.assert_allclose(sample, wanted.reshape(-1, 3), atol=1e-3)
        found.append(wanted)
        if frame == 1:
            strands = shape(archive, "Hair")["P"]
            np.testing.assert_allclose(strands.only, 100.0 * world(bpy.data.objects["Hair"]).reshape(-1, 3), atol=1e-3)
    assert abs(found[-1] - found[0]).max() > 1.0


def test_blender_plays_the_file(baked, tmp_path):
    export(tmp_path / "groom.abc", animation="ALL")
    blender_scene, wanted = bpy.context.scene, {}
    for frame in range(1, LAST + 1):
        blender_scene.frame_set(frame)
        wanted[frame] = 100.0 * world(bpy.data.objects["Hair"])
    before = set(bpy.data.objects)
    bpy.ops.wm.alembic_import(filepath=str(tmp_path / "groom.abc"), set_frame_range=True, as_background_job=False)
    assert (blender_scene.frame_start, blender_scene.frame_end) == (1, LAST)
    (came,) = (o for o in set(bpy.data.objects) - before if o.type == "CURVES" and len(o.data.curves) == 500)
    for frame in (3, 1, 4, 2):
        blender_scene.frame_set(frame)
        np.testing.assert_allclose(world(came)[..., [0, 2, 1]] * (1.0, 1.0, -1.0), wanted[frame], atol=2e-3)


def test_guides_alone_are_a_cache_of_the_same_guides(baked, tmp_path):
    export(tmp_path / "groom.abc")
    export(tmp_path / "cache.abc", animation="GUIDES", has_hair=False)
    groom, cache = (alembic_reader.read(tmp_path / f"{name}.abc") for name in ("groom", "cache"))
    assert set(alembic_reader.objects(cache)) == {
        "/groom",
        "/groom/Hair_guides",
        "/groom/Hair_guides/Hair_guidesShape",
    }
    for name in ("groom_id", "nVertices", "groom_group_id"):
        np.testing.assert_array_equal(shape(groom, "Hair_guides")[name].only, shape(cache, "Hair_guides")[name].only)


# The operator.


def test_the_operator_writes_and_changes_nothing(hair, tmp_path):
    names = sorted(o.name for o in bpy.data.objects)
    for path in ("groom.abc", "groom.usda", "bare"):
        assert bpy.ops.vellus.export_groom(filepath=str(tmp_path / path), has_color=False) == {"FINISHED"}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bare.abc", "groom.abc", "groom.usda"]
    assert sorted(o.name for o in bpy.data.objects) == names
    with pytest.raises(RuntimeError, match=r"exported as \.abc"):
        bpy.ops.vellus.export_groom(filepath=str(tmp_path / "groom.obj"))
