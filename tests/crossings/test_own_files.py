# SPDX-License-Identifier: GPL-3.0-or-later
"""Vellus reads back what it writes: guides and hair with widths, identities, weights, unit and axis."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data.strands import exported_curves
from hair_addon.blender.groom import guide_maps
from hair_addon.blender.io import groom_files, strand_arrays
from hair_addon.core.files.groom_curves import closest_guides
from tests.support.dynamics.following import update
from tests.support.pairs import pairs
from tests.support.reading import attribute

GUIDE_COUNT, STRAND_COUNT = 12, 40
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])

FILES = {
    "exported.usdc": lambda path, _guides, hair: api.export_groom(path, [hair]),
    "exported.usda": lambda path, _guides, hair: api.export_groom(path, [hair]),
    "exported.abc": lambda path, _guides, hair: api.export_groom(path, [hair]),
    "groom.npz": lambda path, guides, hair: groom_files.write(path, guides, hair, np.eye(3)),
    "groom, Y up.npz": lambda path, guides, hair: groom_files.write(path, guides, hair, Y_UP),
    "groom.usdc": lambda path, guides, hair: groom_files.write(path, guides, hair, np.eye(3)),
    "groom.abc": lambda path, guides, hair: groom_files.write(path, guides, hair, np.eye(3)),
    "groom.blend": lambda path, guides, hair: groom_files.write(path, guides, hair, np.eye(3)),
}


def shown(guides, hair):
    """Return (guide points, guide widths, strand points, strand widths) in the world [m]."""
    found = []
    for curves in (guides, hair):
        points = strand_arrays.world_points(curves)
        radii = exported_curves.read_radii(curves, points.shape[1])(slice(0, len(points)))
        found += [points, 2.0 * radii * strand_arrays.world_scale(curves)]
    return found


def assert_same(found, expected):
    """Assert equality to a tenth of a micrometer, and of widths to the last bits."""
    for values, wanted, tolerance in zip(found, expected, (1e-6, 1e-9, 1e-6, 1e-9), strict=True):
        np.testing.assert_allclose(values, wanted, rtol=0.0, atol=tolerance)


@pytest.mark.parametrize(("name", "unit"), pairs(FILES, [1.0, 0.01], 2))
def test_a_groom_comes_back_as_it_was(sphere, scene, tmp_path, name, unit):
    """A groom of a moved, turned and scaled surface comes back, in scenes of meters and centimeters."""
    scene.unit_settings.scale_length = unit
    sphere.location, sphere.rotation_euler = np.array([1.0, 2.0, 3.0]) / unit, (0.3, 0.2, 0.5)
    sphere.scale = np.full(3, 0.1 / unit)
    update()
    settings = api.GroomSettings(
        api.GuideSettings(guide_count=GUIDE_COUNT, length=0.05),
        api.HairSettings(strand_count=STRAND_COUNT, radius=0.0004),
    )
    guides, hair = api.add_hair(sphere, settings)
    update()
    expected, path = shown(guides, hair), tmp_path / name
    indices, weights = guide_maps.of(hair, bpy.context.evaluated_depsgraph_get())
    FILES[name](path, guides, hair)
    for one in [o for o in bpy.data.objects if o.type == "CURVES"]:
        bpy.data.objects.remove(one)
    bpy.data.batch_remove([*bpy.data.hair_curves])

    found = api.import_curves(path, sphere, "GUIDES")
    assert found.notes == [] and found.guides is None
    assert [o for o in bpy.data.objects if o.type == "CURVES"] == [found.curves]
    made = api.use_as_guides(found.curves, sphere)
    points = strand_arrays.world_points(made)
    assert made.vellus.kind == "GUIDES" and points.shape == (GUIDE_COUNT, 41, 3)
    np.testing.assert_allclose(points, expected[0], rtol=0.0, atol=1e-6)
    bpy.data.objects.remove(found.curves)

    found = api.import_curves(path, sphere)
    assert found.notes == []
    used = api.use_as_hair(found.curves, sphere, guides=found.guides)
    assert (used.hair.vellus.kind, used.guides.vellus.kind) == ("HAIR", "GUIDES")
    assert_same(shown(used.guides, used.hair), expected)
    assert used.rooted.reversed_count == used.rooted.far_count == 0 and used.hair.vellus.guide_curves == used.guides
    if name.startswith("exported"):
        ids, shares = closest_guides(indices, weights, 0)
        came = closest_guides(*guide_maps.of(used.hair, bpy.context.evaluated_depsgraph_get()), 0)
        np.testing.assert_array_equal(came[0], ids)
        np.testing.assert_allclose(came[1], shares, atol=1e-6)
        np.testing.assert_array_equal(attribute(found.curves, "id", 1), GUIDE_COUNT + np.arange(STRAND_COUNT))


@pytest.mark.parametrize("name", ["exported.usdc", "exported.abc", "groom.blend"])
def test_groups_come_together_or_one_by_its_name(sphere, tmp_path, name):
    """Groups are read together or one by its name, and strands follow the guides of their own group."""
    settings = api.GroomSettings(
        api.GuideSettings(guide_count=GUIDE_COUNT), api.HairSettings(strand_count=STRAND_COUNT)
    )
    every = [api.add_hair(sphere, replace(settings, guides=replace(settings.guides, seed=seed))) for seed in (0, 1)]
    update()
    points = [np.concatenate([strand_arrays.world_points(one) for one in pair]) for pair in zip(*every, strict=True)]
    if name.endswith(".blend"):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / name), copy=True)
    else:
        api.export_groom(tmp_path / name)
    for one in [o for o in bpy.data.objects if o.type == "CURVES"]:
        bpy.data.objects.remove(one)
    bpy.data.batch_remove([*bpy.data.hair_curves])

    found = api.import_curves(tmp_path / name, sphere)
    assert [str(note).split(" (")[0] for note in found.notes] == (
        [f"{tmp_path / name} has 2 groups"] if "exp" in name else []
    )
    used = api.use_as_hair(found.curves, sphere, guides=found.guides)
    for curves, expected in zip((used.guides, used.hair), points, strict=True):
        np.testing.assert_allclose(strand_arrays.world_points(curves), expected, rtol=0.0, atol=1e-6)
    if name.startswith("exported"):
        indices, weights = guide_maps.of(used.hair, bpy.context.evaluated_depsgraph_get())
        is_second = np.arange(2 * STRAND_COUNT)[:, None] >= STRAND_COUNT
        assert ((indices >= GUIDE_COUNT) == is_second)[weights > 0.0].all() and (weights > 0.0).any(axis=1).all()

    one = api.import_curves(tmp_path / name, sphere, name="Hair.001" if name.endswith(".blend") else "Hair_001")
    second = api.use_as_hair(one.curves, sphere, guides=one.guides).hair
    expected = points[1][STRAND_COUNT:]
    np.testing.assert_allclose(strand_arrays.world_points(second), expected, rtol=0.0, atol=1e-6)
