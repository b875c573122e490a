# SPDX-License-Identifier: GPL-3.0-or-later
"""The density of strands is painted on their surface."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import scene, vertex_groups
from tests.support.dynamics.following import update
from tests.support.reading import points


def make_active(name):
    bpy.context.view_layer.objects.active = bpy.data.objects[name]


def weights(name):
    sphere = bpy.data.objects["Sphere"]
    return scene.weights_in_group(sphere.data, sphere.vertex_groups[name].index)


def test_painting_begins_with_full_density_and_ends_at_the_hair(hair):
    make_active("Hair")
    assert bpy.ops.vellus.paint_density() == {"FINISHED"}
    sphere = bpy.data.objects["Sphere"]
    assert (sphere.mode, sphere.vertex_groups.active.name) == ("WEIGHT_PAINT", "Density")
    assert hair.data.vellus.hair.density_group == "Density" and (weights("Density") == 1.0).all()
    bpy.ops.vellus.paint_density()
    assert sphere.mode == "OBJECT" and bpy.context.object == hair


def test_painted_weights_are_the_density_of_strands(hair):
    """Where the weight is a quarter, hair has a quarter of the density that it has at full weight."""
    make_active("Hair")
    bpy.ops.vellus.paint_density()
    sphere = bpy.data.objects["Sphere"]
    upper = np.array([vertex.co.z > 0.0 for vertex in sphere.data.vertices])
    vertex_groups.paint(sphere.vertex_groups["Density"], np.where(upper, 0.25, 1.0).astype(np.float32), False)
    bpy.ops.vellus.paint_density()
    hair.data.vellus.hair.strand_count = 4000
    update()
    make_active("Guides")
    bpy.ops.vellus.interpolate_hair(strand_count=4000)
    roots = points(hair)[:, 0, 2]
    assert (roots > 0.2).sum() / (roots < -0.2).sum() == pytest.approx(0.25, abs=0.05)


def test_painting_begins_with_the_mask_of_the_guides(hair):
    sphere, guides = bpy.data.objects["Sphere"], bpy.data.objects["Guides"].data
    group = sphere.vertex_groups.new(name="Scalp")
    vertex_groups.paint(group, np.linspace(0.0, 1.0, len(sphere.data.vertices), dtype=np.float32))
    guides.vellus.guides.density_group = "Scalp"
    make_active("Hair")
    bpy.ops.vellus.paint_density()
    np.testing.assert_allclose(weights("Density"), weights("Scalp"), atol=1e-6)
    bpy.ops.vellus.paint_density()
    hair.data.vellus.hair.density_group = "Missing"
    make_active("Hair")
    with pytest.raises(RuntimeError, match="not a vertex group"):
        bpy.ops.vellus.paint_density()


def test_a_color_attribute_is_painted_as_colors(hair):
    sphere = bpy.data.objects["Sphere"]
    sphere.data.color_attributes.new("Fur", "FLOAT_COLOR", "POINT")
    sphere.data.color_attributes.active_color = sphere.data.color_attributes.new("Other", "FLOAT_COLOR", "POINT")
    hair.data.vellus.hair.density_group = "Fur"
    make_active("Hair")
    bpy.ops.vellus.paint_density()
    assert (sphere.mode, sphere.data.color_attributes.active_color.name) == ("VERTEX_PAINT", "Fur")
    bpy.ops.vellus.paint_density()
    assert sphere.mode == "OBJECT" and "Density" not in sphere.vertex_groups


def test_an_image_is_painted_on_a_surface_with_a_uv_map(hair):
    sphere = bpy.data.objects["Sphere"]
    hair.data.vellus.hair.density_image = bpy.data.images.new("Density", 8, 8).name
    make_active("Hair")
    bpy.ops.vellus.paint_density()
    assert sphere.mode == "TEXTURE_PAINT"
    bpy.ops.vellus.paint_density()
    while sphere.data.uv_layers:
        sphere.data.uv_layers.remove(sphere.data.uv_layers[0])
    with pytest.raises(RuntimeError, match="no UV map"):
        bpy.ops.vellus.paint_density()
    assert sphere.mode == "OBJECT"
