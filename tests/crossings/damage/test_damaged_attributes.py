# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes of ours that were removed, retyped or overwritten count as missing or outdated."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.live import invalidation
from tests.support.dynamics.following import drawn_points, surface_points, update
from tests.support.reading import points

ROOTS = {
    "root_barycentric": ("FLOAT_VECTOR", "CURVE"),
    "root_triangle": ("INT", "CURVE"),
    "root_vertex_0": ("INT", "CURVE"),
    "root_vertex_2": ("INT", "CURVE"),
}
OURS = ROOTS | {
    "radius": ("FLOAT", "POINT"),
    "id": ("INT", "CURVE"),
    "strand_random": ("FLOAT", "CURVE"),
    "guide_curve_index": ("INT", "CURVE"),
    "guide_index_0": ("INT", "CURVE"),
    "guide_weight_1": ("FLOAT", "CURVE"),
    "surface_uv_coordinate": ("FLOAT2", "CURVE"),
    "surface_normal": ("FLOAT_VECTOR", "CURVE"),
}
# Type and domain of the replaced attribute; None removes the attribute.
OTHERS = {
    "removed": None,
    "vectors": ("FLOAT_VECTOR", "POINT"),
    "integers": ("INT", "CURVE"),
    "integers on points": ("INT", "POINT"),
    "text": ("STRING", "CURVE"),
}
INTEGERS = {"negative": -1, "far out of range": 2**31 - 1, "just out of range": 642}
FLOATS = {"not a number": np.nan, "infinite": np.inf, "negative": -1.0, "huge": 1e30}


def retype(datablock, name, kind):
    """Replace an attribute by one with another (type, domain) and its name, or remove it for None."""
    if name in datablock.attributes:
        datablock.attributes.remove(datablock.attributes[name])
    if kind is not None:
        datablock.attributes.new(name, *kind)
    datablock.update_tag()


def fill(datablock, name, value):
    """Set all elements of an attribute to one value."""
    attribute = datablock.attributes[name]
    is_vector = attribute.data_type in {"FLOAT2", "FLOAT_VECTOR"}
    width = {"FLOAT2": 2, "FLOAT_VECTOR": 3}.get(attribute.data_type, 1)
    values = np.full(len(attribute.data) * width, value, np.int32 if attribute.data_type == "INT" else np.float32)
    attribute.data.foreach_set("vector" if is_vector else "value", values)
    datablock.update_tag()


def bend():
    """Let a modifier move the sphere's hair."""
    twist = bpy.data.objects["Sphere"].modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 1.0
    update()


def use_all(folder):
    """Draw hair at rest and deformed, evaluate it again, edit its surface, and save it."""
    sphere, hair, guides = (bpy.data.objects[name] for name in ("Sphere", "Hair", "Guides"))
    update()
    assert all(np.isfinite(drawn_points(shown)).all() for shown in (hair, guides))
    bend()
    assert all(np.isfinite(drawn_points(shown)).all() for shown in (hair, guides))
    assert np.isfinite(api.points(hair)).all() and np.isfinite(api.points(guides)).all()
    sphere.modifiers.clear()
    sphere.data.vertices[0].co.z += 0.2
    sphere.data.update()
    update()
    hair.data.vellus.hair.keep_length = 0.5
    update()
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "saved.blend"))
    for shown in (hair, guides):
        assert np.isfinite(points(shown)).all()
        status = shown.data.vellus.status
        assert status == "" or status.startswith('Faces of "Sphere" were deleted: ')


@pytest.mark.parametrize("other", OTHERS)
def test_attributes_of_other_types_are_missing(lit, other, tmp_path, capfd):
    for shown in (lit, bpy.data.objects["Guides"]):
        for name, kind in OURS.items():
            if kind != OTHERS[other]:
                retype(shown.data, name, OTHERS[other])
    invalidation.clear()
    use_all(tmp_path)
    reported = capfd.readouterr()
    assert "Traceback" not in reported.err + reported.out


@pytest.mark.parametrize(("integer", "number"), [*zip([*INTEGERS, "negative"], FLOATS, strict=True)])
def test_attributes_of_impossible_values_are_stale(lit, integer, number, tmp_path, capfd):
    for shown in (lit, bpy.data.objects["Guides"]):
        for name, (data_type, _domain) in OURS.items():
            if name in shown.data.attributes:
                fill(shown.data, name, INTEGERS[integer] if data_type == "INT" else FLOATS[number])
    invalidation.clear()
    use_all(tmp_path)
    reported = capfd.readouterr()
    assert "Traceback" not in reported.err + reported.out


def test_damaged_roots_are_found_again_where_strands_begin(lit):
    """Damaged roots are replaced by the nearest places of the surface, and strands follow it from these."""
    bend()
    expected = api.points(lit)
    for name, value in (("root_vertex_2", 2**31 - 1), ("root_barycentric", np.nan)):
        fill(lit.data, name, value)
        np.testing.assert_allclose(api.points(lit), expected, atol=1e-4)
    for name in ROOTS:
        retype(lit.data, name, ("STRING", "CURVE"))
        np.testing.assert_allclose(api.points(lit), expected, atol=1e-4)


def test_damaged_roots_are_not_kept(lit):
    """Damaged roots are not kept when a changed setting places strands again."""
    fill(lit.data, "root_barycentric", 1e9)
    lit.data.vellus.hair.tip_taper = 0.5
    curves_door_roots = points(lit)[:, 0]
    update()
    np.testing.assert_allclose(points(lit)[:, 0], surface_points(lit), atol=1e-5)
    np.testing.assert_allclose(points(lit)[:, 0], curves_door_roots, atol=1e-5)


@pytest.mark.parametrize("kind", [("FLOAT", "POINT"), ("FLOAT_VECTOR", "CORNER"), ("FLOAT_VECTOR", "POINT")])
def test_foreign_rest_positions_are_ignored(lit, kind):
    """Foreign rest positions of the right type and without numbers are ignored, and Blender replaces them when
    asked.
    """
    sphere = bpy.data.objects["Sphere"]
    sphere.add_rest_position_attribute = False
    sphere.data.attributes.new("rest_position", *kind)
    fill(sphere.data, "rest_position", np.nan)
    lit.data.vellus.hair.keep_length = 0.5
    update()
    assert lit.data.vellus.status == "" and np.isfinite(api.points(lit)).all()
