# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves from root to tip of numbers of styles, in Blender's curve widget."""

import argparse

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.strands import curves
from hair_addon.blender.settings import map_items, ramp_nodes
from hair_addon.command_line import map_options
from hair_addon.core.errors import HairError
from hair_addon.core.files import settings_file
from hair_addon.core.maps.map_settings import MapSettings
from tests.support import appended

RADIUS = "styles.Curl.radius"
FALLING = "0:1 0.5:1 1:0.2"


def points(curves_data):
    """Return (S, P, 3) float32, the points that hair Curves store after an update."""
    bpy.context.view_layer.update()
    return curves.read_points(curves_data).reshape(len(curves_data.curves), -1, 3)


@pytest.mark.parametrize("setting", ["amount", "radius", "pitch", "flatness"])
def test_a_new_curve_changes_nothing_and_an_edited_curve_the_tips(curls, setting):
    """A new curve keeps all bits, an edited one changes only points where it differs from 1, and removing it restores
    the points.
    """
    curls.vellus.styles[0].curl.flatness = 0.7
    plain, name = points(curls), f"styles.Curl.{setting}"
    count = len(bpy.data.node_groups)
    assert bpy.ops.vellus.add_course(setting=name) == {"FINISHED"}
    np.testing.assert_array_equal(points(curls), plain)
    tree = map_items.item_of(curls.vellus, name).course_tree
    mapping = ramp_nodes.node_of(tree).mapping
    for point in mapping.curves[0].points:
        point.handle_type = "VECTOR"
    mapping.curves[0].points.new(0.6, 1.0).handle_type = "VECTOR"
    mapping.curves[0].points[-1].location = (1.0, 0.3)
    mapping.update()
    tree.update_tag()
    found = points(curls)
    inner = int(0.55 * plain.shape[1])
    np.testing.assert_array_equal(found[:, :inner], plain[:, :inner])
    assert np.linalg.norm(found - plain, axis=-1)[:, -1].mean() > 0.001
    assert bpy.ops.vellus.remove_course(setting=name) == {"FINISHED"}
    np.testing.assert_array_equal(points(curls), plain)
    assert len(bpy.data.node_groups) == count


def test_copies_undo_files_and_settings_have_their_curve(curls, tmp_path):
    """A copy has its own curve, undo restores an edited curve, and settings and linked or appended hair keep it."""
    plain = points(curls)
    api.set_course(curls, RADIUS, FALLING)
    bent = points(curls)
    assert not np.array_equal(bent, plain)
    wanted = MapSettings(setting=RADIUS, course=FALLING)
    assert api.maps_of(curls) == (wanted,)
    bpy.ops.ed.undo_push(message="bent")
    curls = bpy.data.objects["Hair"].data
    copy = bpy.data.objects["Hair"].copy()
    copy.data = curls.copy()
    bpy.context.collection.objects.link(copy)
    bpy.context.view_layer.update()
    trees = [map_items.item_of(each.vellus, RADIUS).course_tree for each in (curls, copy.data)]
    assert trees[0] != trees[1]
    api.set_course(curls, RADIUS, "0:0 1:1")
    assert not np.array_equal(points(curls), bent)
    np.testing.assert_array_equal(points(copy.data), bent)
    bpy.ops.ed.undo_push(message="other")
    bpy.ops.ed.undo()
    curls = bpy.data.objects["Hair"].data
    np.testing.assert_array_equal(points(curls), bent)
    settings = api.settings_of(curls)
    settings_file.write(tmp_path / "curls.json", settings)
    assert settings_file.read(tmp_path / "curls.json") == settings
    path = str(tmp_path / "curls.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    api.set_course(curls, RADIUS)
    np.testing.assert_array_equal(points(curls), plain)
    assert not api.maps_of(curls)
    api.apply_settings(curls, settings_file.read(tmp_path / "curls.json"))
    np.testing.assert_array_equal(points(curls), bent)
    for found in appended.in_new_files(path):
        np.testing.assert_array_equal(points(found), bent)
        assert map_items.maps_of(found.vellus) == (wanted,)


def test_a_map_and_a_curve_multiply(curls):
    """A map of a number keeps the number's curve, follows its style, and the amounts of both are multiplied."""
    api.set_course(curls, RADIUS, FALLING)
    half = api.set_map(curls, RADIUS, "strand", low=0.5, high=0.5)
    assert half.course == FALLING
    both = points(curls)
    assert bpy.ops.vellus.remove_map(setting=RADIUS) == {"FINISHED"}
    assert api.maps_of(curls) == (MapSettings(setting=RADIUS, course=FALLING),)
    assert not api.clear_map(curls, RADIUS)  # there is only the curve
    curls.vellus.styles[0].curl.radius = 0.025
    np.testing.assert_array_equal(points(curls), both)
    curls.vellus.styles[0].name = "Ringlets"
    bpy.ops.vellus.duplicate_style()
    assert [one.course for one in api.maps_of(curls)] == [FALLING, FALLING]
    bpy.ops.vellus.remove_style()
    assert [one.setting for one in api.maps_of(curls)] == ["styles.Ringlets.radius"]
    np.testing.assert_array_equal(points(curls), both)


def test_curves_of_many_points_are_copied(curls):
    """A curve of a hundred points, which Blender's widget allows, is copied with its style and by settings."""
    many = " ".join(f"{place / 128:g}:{place % 2}" for place in range(129))
    api.set_course(curls, RADIUS, many)
    assert bpy.ops.vellus.duplicate_style() == {"FINISHED"}
    assert [one.course for one in api.maps_of(curls)] == [many, many]
    api.apply_settings(curls, api.settings_of(curls))
    assert [one.course for one in api.maps_of(curls)] == [many, many]


def test_an_opened_popover_and_a_removed_curve_of_an_amount_change_nothing(curls):
    """The amount, which maps cannot vary, may have an item without a curve: copies and settings keep it."""
    plain, name = points(curls), "styles.Curl.amount"
    bpy.ops.vellus.edit_map("EXEC_DEFAULT", setting=name)
    assert api.settings_of(curls).maps == (MapSettings(setting=name),)
    bpy.ops.vellus.add_course(setting=name)
    bpy.ops.vellus.remove_course(setting=name)
    assert bpy.ops.vellus.duplicate_style() == {"FINISHED"}
    bpy.ops.vellus.remove_style()
    api.apply_settings(curls, api.settings_of(curls))
    np.testing.assert_array_equal(points(curls), plain)
    assert curls.vellus.status == ""
    with pytest.raises(HairError, match="No map can vary"):
        api.set_map(curls, name, "strand")


def test_settings_without_a_curve_say_so(curls):
    """Wrong settings are errors, and a curve that a style cannot have is a status."""
    for setting in (
        "styles.Curl.coherence",
        "look.color",
        "strands.thickness",
        "styles.Curl.size",
        "styles.Waves.radius",
    ):
        with pytest.raises(HairError, match=r"cannot have a curve from root to tip|has no style"):
            api.set_course(curls, setting, FALLING)
    with pytest.raises(HairError, match="color ramp"):
        api.set_course(curls, RADIUS, "0:0/0/0 1:1/1/1")
    api.add_style(curls, "BRAID", size=0.3)
    map_items.add(curls.vellus, "styles.Braid.flatness")
    map_items.set_course(map_items.item_of(curls.vellus, "styles.Braid.flatness"), FALLING)
    bpy.context.view_layer.update()
    assert "cannot have a curve from root to tip" in curls.vellus.status
    map_items.remove(curls.vellus, "styles.Braid.flatness")
    map_items.add(curls.vellus, "styles.Curl.amount").kind = "STRAND"
    bpy.context.view_layer.update()
    assert "use the mask of the style" in curls.vellus.status


def test_the_command_lines_curves():
    """Curves of options are added to the maps of settings, and wrong ones are errors."""
    parser = argparse.ArgumentParser(exit_on_error=False)
    map_options.add_maps(parser)
    given = parser.parse_args(["--course", f"{RADIUS}={FALLING}", "--map", f"{RADIUS}=strand,low=0.5"])
    found = map_options.mapped(given, settings_file.GroomSettings()).maps
    assert found == (MapSettings(setting=RADIUS, kind="STRAND", low=0.5, course=FALLING),)
    of_file = settings_file.GroomSettings(maps=(MapSettings(setting=RADIUS, kind="CLUMP", course=FALLING),))
    assert map_options.mapped(parser.parse_args(["--map", f"{RADIUS}=strand,low=0.5"]), of_file).maps == found
    for wrong in ("styles.Curl.radius", "styles.Curl.radius=1", "look.color=0:1 1:1", "styles.Curl.radius="):
        with pytest.raises(argparse.ArgumentError):
            parser.parse_args(["--course", wrong])
