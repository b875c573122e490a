# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps of styles vary strands wherever hair goes: undo, files, other surfaces, copies and the command line.

Each strand is as in hair whose style has the strand's value everywhere.
"""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from hair_addon import api
from hair_addon.blender.data.maps import strand_maps
from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import bindings, changed_weights, strand_thickness
from hair_addon.blender.settings import map_items
from hair_addon.blender.ui import map_rows
from tests.support.commands import load, run_here
from tests.support.exchange.imported import select
from tests.support.interface.layout import Layout
from tests.support.overridden import override_keyed, parts
from tests.support.reading import points

RADIUS = "styles.Curl.radius"
LOW, HIGH = 0.0125, 0.05  # radii where the map is 0 and 1 [m]


@pytest.fixture
def curls(hair):
    """Return hair with a style Curl whose radius has no map; the surface has the vertex group "half"."""
    half_group(bpy.data.objects["Sphere"])
    api.add_style(hair.data, "CURL", radius=HIGH, pitch=0.2)
    update()
    return hair


def half_group(surface, axis=0):
    """Give a mesh a vertex group with weight 1 where a coordinate is above 0.05 and 0 elsewhere."""
    group = surface.vertex_groups.get("half") or surface.vertex_groups.new(name="half")
    group.add(range(len(surface.data.vertices)), 0.0, "REPLACE")
    group.add([v.index for v in surface.data.vertices if v.co[axis] > 0.05], 1.0, "REPLACE")
    update()


def update():
    bpy.context.view_layer.update()


def vary(hair):
    """Vary the radius of curls by the vertex group."""
    api.set_map(hair.data, RADIUS, "group:half", low=LOW / HIGH, high=1.0)
    update()


def with_radius(hair, value):
    """Return (S, P, 3) with a radius of all curls, which is then set back."""
    group = hair.data.vellus.styles[0].curl
    before, group.radius = group.radius, value
    update()
    found = points(hair)
    group.radius = before
    update()
    return found


def references(hair):
    """Return (points with the radius LOW, points with the radius HIGH) of hair without a map."""
    return with_radius(hair, LOW), with_radius(hair, HIGH)


def require_halves(found, low, high, roots=None, tolerance=0.0, axis=0):
    """Assert that strands are those of one of two grooms, by the side of their roots; few are in between.

    roots: (S, 3) in coordinates in which the map's edge is at 0.05; None for the first points.
    """
    assert found.shape == low.shape == high.shape
    side = (found[:, 0] if roots is None else roots)[:, axis]
    is_low, is_high = side < -0.15, side > 0.25
    assert min(is_low.sum(), is_high.sum()) > 0.25 * len(found)
    assert np.abs(low - high).max(axis=(1, 2)).min() > 0.2 * (HIGH - LOW)
    np.testing.assert_allclose(found[is_low], low[is_low], rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(found[is_high], high[is_high], rtol=0.0, atol=tolerance)


def test_undo_and_redo(curls):
    """Undo removes the variation of strands with the map, redo restores both, with the same bits."""
    low, high = references(curls)
    bpy.ops.ed.undo_push(message="before")
    vary(curls)
    varied = points(curls)
    require_halves(varied, low, high)
    bpy.ops.ed.undo_push(message="mapped")
    bpy.ops.ed.undo()
    update()
    hair = bpy.data.objects["Hair"]
    np.testing.assert_array_equal(points(hair), high)
    assert not api.maps_of(hair.data)
    hair.data.vellus.is_stale = True
    update()
    np.testing.assert_array_equal(points(hair), high)
    bpy.ops.ed.redo()
    update()
    hair = bpy.data.objects["Hair"]
    np.testing.assert_array_equal(points(hair), varied)
    hair.data.vellus.styles[0].curl.radius = 0.5 * HIGH
    update()
    hair.data.vellus.styles[0].curl.radius = HIGH
    update()
    np.testing.assert_array_equal(points(hair), varied)


def test_linked_and_overridden_hair(curls, tmp_path):
    """An overridden character plays keys of a varied setting as its file does, and gives its map to other meshes."""
    vary(curls)
    hair = override_keyed(curls, tmp_path, 0, (HIGH, 2.0 * HIGH))
    bpy.context.scene.frame_set(1)
    sphere = parts()[0]
    copy = bpy.data.objects.new("Copy", sphere.data.copy())
    bpy.context.scene.collection.objects.link(copy)
    update()
    made = api.transfer_groom(hair.data, copy, method="UV").hair
    update()
    hair = next(o for o in bpy.data.objects if o.data == made)
    varied = points(hair)
    api.clear_map(made, RADIUS)
    update()
    require_halves(varied, *references(hair), tolerance=1e-6)


def test_regenerated_strands(curls):
    """Regenerating strands with other numbers in the redo panel varies the new strands too."""
    vary(curls)
    select(curls)
    options = {"strand_count": 400, "radius": 0.004, "influence_distance": 0.03}
    assert bpy.ops.vellus.interpolate_hair(**options) == {"FINISHED"}
    update()
    varied = points(curls)
    api.clear_map(curls.data, RADIUS)
    update()
    assert len(varied) == 400
    require_halves(varied, *references(curls))


def test_transfer_to_another_mesh(curls):
    """A turned and enlarged copy of the mesh gets the map with its vertex group, and the variation of strands."""
    vary(curls)
    sphere = bpy.data.objects["Sphere"]
    copy = bpy.data.objects.new("Copy", sphere.data.copy())
    bpy.context.scene.collection.objects.link(copy)
    copy.matrix_world = Matrix.Translation((3.0, 0.0, 0.5)) @ Matrix.Rotation(0.7, 4, (1.0, 2.0, 0.5))
    copy.scale *= 2.0
    update()
    made = api.transfer_groom(curls.data, copy, method="UV").hair
    hair = next(o for o in bpy.data.objects if o.data == made)
    update()
    varied = points(hair)
    assert "half" in copy.vertex_groups
    api.clear_map(made, RADIUS)
    update()
    group = made.vellus.styles[0].curl
    assert group.radius == pytest.approx(2.0 * HIGH, rel=0.02)
    high = points(hair)
    low = with_radius(hair, group.radius * LOW / HIGH)
    require_halves(varied, low, high, tolerance=1e-6)


def test_library(curls, tmp_path):
    """A groom saved as an asset and applied again has the varied strands."""
    vary(curls)
    picture = np.zeros((4, 4, 4), np.float32)
    file = api.save_groom(curls.data, tmp_path, name="Curls", catalog="", picture=picture)
    _guides, made = api.apply_groom(bpy.data.objects["Sphere"], file)
    update()
    hair = next(o for o in bpy.data.objects if o.data == made)
    varied = points(hair)
    api.clear_map(made, RADIUS)
    update()
    require_halves(varied, *references(hair), tolerance=1e-6)


@pytest.mark.parametrize("ending", ["npz", "blend"])
def test_command_line(sphere, tmp_path, ending):
    """The option --map varies the strands that are written."""
    half_group(sphere)
    path = tmp_path / "sphere.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))

    def grown(radius, *words):
        bpy.ops.wm.open_mainfile(filepath=str(path))
        out = tmp_path / f"out.{ending}"
        style = f"curl:radius={radius},pitch=0.2"
        common = ("--guides", 40, "--strands", 300, "--no-style-fit", "--style", style, "--out", out)
        ended = run_here("groom", path, *common, *words)
        assert (ended.status, ended.errors) == (0, "")
        if ending == "npz":
            return load(out)["strand_points"]
        bpy.ops.wm.open_mainfile(filepath=str(out))
        return points(bpy.data.objects["Hair"])

    low, high = grown(LOW), grown(HIGH)
    varied = grown(HIGH, "--map", f"{RADIUS}=group:half,low={LOW / HIGH}")
    require_halves(varied, low, high, tolerance=1e-6)


@pytest.mark.parametrize("scale", [(0.01, 0.01, 0.01), (100.0, 100.0, 100.0), (-1.0, 2.0, 0.5)], ids=str)
def test_parented_surface(curls, scale):
    """A surface parented to a scaled and turned object has strands by the map's values."""
    empty = bpy.data.objects.new("Rig", None)
    bpy.context.collection.objects.link(empty)
    empty.matrix_world = Matrix.Translation((1.0, 2.0, 3.0)) @ Matrix.Rotation(0.8, 4, (1.0, 0.3, 0.2))
    empty.scale = scale
    bpy.data.objects["Sphere"].parent = empty
    update()
    size = abs(np.prod(scale)) ** (1.0 / 3.0)
    group = curls.data.vellus.styles[0].curl
    group.radius, group.pitch = HIGH * size, 0.2 * size
    bindings.invalidate(curls.data)  # equal styles keep hair at the scale that it was bound at
    curls.data.vellus.is_stale = True
    update()
    low = with_radius(curls, LOW * size)  # a changed style binds the hair at the present scale
    high = points(curls)
    vary(curls)
    require_halves(points(curls), low, high, tolerance=1e-6)


def test_centimeters(curls):
    """In a scene of centimeters with a surface a hundred times larger, strands are the same in meters."""
    low, high = references(curls)
    vary(curls)
    varied = points(curls)
    require_halves(varied, low, high)
    bpy.context.scene.unit_settings.scale_length = 0.01
    bpy.data.objects["Sphere"].scale = (100.0, 100.0, 100.0)
    group = curls.data.vellus.styles[0].curl
    group.radius, group.pitch = 100.0 * HIGH, 100.0 * 0.2
    curls.data.vellus.is_stale = True
    update()
    require_halves(points(curls), low, high, tolerance=1e-4)


def test_guides_on_another_surface(curls):
    """Hair whose guides are on another surface reads maps and masks from the guides' surface, after any change."""
    other = bpy.data.objects.new("Other", bpy.data.objects["Sphere"].data.copy())
    bpy.context.collection.objects.link(other)
    half_group(other, axis=1)
    low, high = references(curls)
    curls.data.surface = other
    curls.data.vellus.styles[0].curl.mask = "half"
    update()
    bindings.invalidate(curls.data)
    curls.data.vellus.is_stale = True
    update()
    masked = points(curls)
    require_halves(masked, with_radius(curls, 0.0), high, tolerance=1e-6)
    for change in (0.2, 0.3, 0.2):
        curls.data.vellus.styles[0].curl.pitch = change
        update()
    np.testing.assert_array_equal(points(curls), masked)
    curls.data.vellus.is_live = False
    curls.data.vellus.hair.influence_distance *= 0.9
    rebound = changed_weights.rebound(curls.data, bpy.context.evaluated_depsgraph_get())
    assert rebound is not None  # as the mask is the same
    curls.data.vellus.hair.influence_distance /= 0.9
    curls.data.vellus.is_live = True
    curls.data.vellus.styles[0].curl.mask = ""
    vary(curls)
    require_halves(points(curls), low, high)
    half_group(bpy.data.objects["Sphere"], axis=1)
    require_halves(points(curls), low, high, axis=1)


def test_painting_where_guides_are_on_another_surface(curls):
    """Masks of densities and styles, and maps of looks and styles, are painted and read on the guides' surface."""
    sphere, other = bpy.data.objects["Sphere"], bpy.data.objects.new("Other", bpy.data.meshes.new("Other"))
    bpy.context.collection.objects.link(other)
    curls.data.surface = other
    update()
    layer = bpy.context.view_layer.objects
    for start, stop in (
        (bpy.ops.vellus.paint_density, bpy.ops.vellus.paint_density),
        (bpy.ops.vellus.paint_style_mask, bpy.ops.vellus.paint_style_mask),
    ):
        layer.active = curls
        start()
        assert (layer.active, sphere.mode) == (sphere, "WEIGHT_PAINT")
        stop()
        assert (layer.active, sphere.mode) == (curls, "OBJECT")
    names = curls.data.vellus.hair.density_group, curls.data.vellus.styles[0].curl.mask
    assert all(name in sphere.vertex_groups for name in names) and not other.vertex_groups
    curls.data.vellus.styles[0].curl.mask = ""
    api.set_map(curls.data, "look.melanin", "group:half")
    update()
    written = strand_maps.looks_of(curls.data)[0]
    bound = strand_maps.looks_of(curls.data, strand_thickness.strands_of(curls.data, bindings.of(curls.data)))[0]
    np.testing.assert_array_equal(written.root, bound.root)
    assert np.ptp(written.root[:, 0]) > 0.1


def test_linked_hair_shows_its_maps(curls, tmp_path):
    """Hair that is linked without an override has the strands, looks and radii of its maps; a map can be opened, but
    its rows are gray below the reason, and nothing can be changed.
    """
    vary(curls)
    api.set_map(curls.data, "look.melanin", "group:half", low=0.25)
    api.set_map(curls.data, "strands.thickness", "group:half", low=0.25)
    update()

    def values(hair):
        looks = strand_maps.read_looks(hair.data)
        return points(hair), looks.root, curves.read_radii(hair.data)

    wanted = values(curls)
    assert all(len(np.unique(of_all[..., 0] if of_all.ndim > 1 else of_all)) > 1 for of_all in wanted[1:])
    path = str(tmp_path / "curls.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_there, here):
        here.objects = ["Sphere", "Guides", "Hair"]
    for linked in here.objects:
        bpy.context.collection.objects.link(linked)
    update()
    hair = here.objects[2]
    bpy.context.scene.frame_set(5)
    sphere = here.objects[0]
    sphere.vertex_groups["half"].add(range(len(sphere.data.vertices)), 0.5, "REPLACE")  # which the shot does not keep
    sphere.data.update_tag()
    hair.data.update_tag()
    update()
    for found, known in zip(values(hair), wanted, strict=True):
        np.testing.assert_array_equal(found, known)
    bpy.context.view_layer.objects.active = hair
    assert bpy.ops.vellus.edit_map(setting=RADIUS) == {"FINISHED"}
    layout, item = Layout(), map_items.item_of(hair.data.vellus, RADIUS)
    map_rows.draw(layout, item, hair.data)
    assert "is linked from another file" in " ".join(layout.texts)
    assert "Strands keep the map's values of that file" in layout.texts
    for setting, change in (("styles.Curl.pitch", bpy.ops.vellus.edit_map), (RADIUS, bpy.ops.vellus.remove_map)):
        with pytest.raises(RuntimeError, match="linked from another file"):
            change(setting=setting)
    assert [one.setting for one in api.maps_of(hair.data)] == [RADIUS, "look.melanin", "strands.thickness"]
