# SPDX-License-Identifier: GPL-3.0-or-later
"""A map of *Thickness* multiplies the radii of each strand."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.maps import sources
from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import bindings
from hair_addon.blender.groom.transfer import groom_settings
from hair_addon.blender.live import live_hair
from hair_addon.blender.render import hair_cache
from hair_addon.blender.settings import map_items
from hair_addon.command_line import map_options
from hair_addon.core.maps.map_settings import MapSettings
from tests.support import appended
from tests.support.pictures import drawn_strands
from tests.support.pictures.gpu_strands import drawn, window  # noqa: F401

SETTING = "strands.thickness"


def radii(hair):
    """Return (S, P) float32, the radii that hair Curves store."""
    return curves.read_radii(hair).reshape(len(hair.curves), -1)


def vary(hair, **changes):
    map_items.keep(hair.vellus, MapSettings(setting=SETTING, **changes))
    bpy.context.view_layer.update()
    return radii(hair)


def test_a_map_multiplies_the_radii_of_each_strand(hair):
    """A map of 1 keeps the radii bit for bit, a map of 0.5 halves them, and removing the map restores them."""
    before = radii(hair.data)
    np.testing.assert_array_equal(vary(hair.data, kind="STRAND", low=1.0, high=1.0), before)
    np.testing.assert_array_equal(vary(hair.data, kind="STRAND", low=0.5, high=0.5), np.float32(0.5) * before)
    half = vary(hair.data, kind="GROUP", source="top", low=0.5, high=1.0) / before
    assert half.min() == 0.5
    assert half.max() == 1.0
    np.testing.assert_allclose(half, np.broadcast_to(half[:, :1], half.shape), rtol=1e-6)
    hair.data.vellus.hair.tip_taper = 0.5
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(radii(hair.data)[:, -1], np.float32(0.5) * radii(hair.data)[:, 0])
    hair.data.vellus.hair.tip_taper = 0.2
    assert api.clear_map(hair.data, SETTING)
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(radii(hair.data), before)


def test_bound_hair_and_exports_have_the_radii_of_the_map(hair, window, tmp_path):  # noqa: F811
    """In a window, strands are drawn with the radii that are written later and exported."""
    before = radii(hair.data)
    drawn(hair)
    hair.data.vellus.is_stale = True
    bpy.context.view_layer.update()
    live_hair.write_all()
    for low in (0.5, 0.25):
        vary(hair.data, kind="GROUP", source="top", low=low)
        factors = bindings.of(hair.data).radii / before
        assert (factors.min(), factors.max()) == (low, 1.0)
        drawn(hair)
        shown = drawn_strands.radii(hair_cache.strands_on_gpu(hair.data))
        np.testing.assert_allclose(shown, bindings.of(hair.data).radii, rtol=2e-3, atol=1e-9)
    live_hair.write_all()
    np.testing.assert_array_equal(radii(hair.data), bindings.of(hair.data).radii)
    path = tmp_path / "hair.npz"
    api.export_groom(path, [hair.data])
    with np.load(path) as arrays:
        np.testing.assert_allclose(arrays["strand_widths"], 2.0 * radii(hair.data), rtol=1e-6)


def test_a_missing_source_is_a_status_and_the_value_is_used(hair):
    """Hair whose map of thickness has a missing source uses the value of the setting, and a status names the source."""
    before = radii(hair.data)
    vary(hair.data, kind="GROUP", source="top")
    np.testing.assert_array_equal(vary(hair.data, kind="GROUP", source="lost"), before)
    assert "lost" in hair.data.vellus.status
    vary(hair.data, kind="GROUP", source="top")
    assert hair.data.vellus.status == ""


def test_thickness_is_set_by_scripts_options_and_settings(hair):
    """Scripts and options give the same map; settings that are read and applied keep it; other names are refused."""
    wanted = api.set_map(hair.data, SETTING, "group:top", low=0.5)
    assert map_options.parsed_map("strands.thickness=group:top,low=0.5") == wanted
    bpy.context.view_layer.update()
    mapped, settings = radii(hair.data), groom_settings.settings_of(hair.data)
    api.clear_map(hair.data, SETTING)
    bpy.context.view_layer.update()
    assert not np.array_equal(radii(hair.data), mapped)
    groom_settings.apply_settings(hair.data, settings)
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(radii(hair.data), mapped)


def test_undo_files_and_appending_keep_maps(hair, tmp_path):
    """Undo removes a map and redo restores it; saved, appended and linked hair has its maps and radii."""
    before = radii(hair.data)
    bpy.ops.ed.undo_push(message="before")
    mapped = vary(hair.data, kind="GROUP", source="top", low=0.5)
    bpy.ops.ed.undo_push(message="mapped")
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(radii(bpy.data.hair_curves["Hair"]), before)
    assert not bpy.data.hair_curves["Hair"].vellus.maps
    bpy.ops.ed.redo()
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(radii(bpy.data.hair_curves["Hair"]), mapped)
    path = str(tmp_path / "maps.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    for found in appended.in_new_files(path):
        assert [one.setting for one in map_items.maps_of(found.vellus)] == [SETTING]
        np.testing.assert_array_equal(radii(found), mapped)


def test_applied_transforms_keep_the_factors(hair):
    """A turned and scaled surface whose transform is applied keeps each strand's factor."""
    before = radii(hair.data)
    factors = vary(hair.data, kind="GROUP", source="top", low=0.5) / before
    sphere = bpy.data.objects["Sphere"]
    sphere.rotation_euler, sphere.scale = (0.3, 0.2, 1.0), (2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    bpy.ops.object.select_all(action="DESELECT")
    sphere.select_set(True)
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.object.transform_apply(location=False, rotation=True, scale=True)
    bpy.context.view_layer.update()
    np.testing.assert_allclose(radii(hair.data) / radii(hair.data).max(), factors * before / before.max(), rtol=1e-5)


@pytest.mark.parametrize("kind", ["files", "packed"])
def test_tiles_of_an_image_are_read(hair, tmp_path, kind):
    """Strands whose roots are in the second UDIM tile have the values of this tile."""
    image = bpy.data.images.new("tiles", 8, 8, tiled=True, is_data=True)
    sphere = bpy.data.objects["Sphere"]
    uvs = sphere.data.uv_layers.active.uv
    values = np.empty(2 * len(uvs), np.float32)
    uvs.foreach_get("vector", values)
    values[::2] *= 2.0
    uvs.foreach_set("vector", values)
    sphere.data.update_tag()
    for number, color in ((1001, 0.25), (1002, 0.75)):
        one = bpy.data.images.new(f"tile {number}", 8, 8, is_data=True)
        one.pixels.foreach_set(np.tile(np.float32([color, color, color, 1.0]), 64))
        one.file_format = "PNG"
        one.save(filepath=str(tmp_path / f"tile.{number}.png"))
    bpy.data.images.remove(image)
    image = bpy.data.images.load(str(tmp_path / "tile.1001.png"))
    image.source = "TILED"
    image.filepath = str(tmp_path / "tile.<UDIM>.png")
    image.colorspace_settings.name = "Non-Color"
    if 1002 not in [tile.number for tile in image.tiles]:
        image.tiles.new(1002)
    if kind == "packed":
        image.pack()
        for number in (1001, 1002):
            (tmp_path / f"tile.{number}.png").unlink()
    bpy.context.view_layer.update()
    vary(hair.data, source=image.name)
    assert hair.data.vellus.status == ""
    strands = sources.stored_strands(hair.data)
    found = sources.masks(strands, MapSettings(setting=SETTING, source=image.name), image)
    is_near = np.isclose(found, np.rint(found * 255.0) / 255.0, atol=1e-3)
    assert is_near.mean() > 0.9
    assert {round(float(value), 2) for value in np.unique(np.round(found[is_near], 2))} >= {0.25, 0.75}
