# SPDX-License-Identifier: GPL-3.0-or-later
"""An attribute of the surface sets density as a vertex group of the same values does, on any domain, and hair follows
it.
"""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import scene
from tests.support.reading import points


def group_weights(sphere):
    return scene.read_vertex_group(sphere, bpy.context.evaluated_depsgraph_get(), "top")


def add(sphere, data_type, domain, values):
    """Add an attribute "density" of numbers or of gray colors."""
    attribute = sphere.data.attributes.new("density", data_type, domain)
    if data_type.endswith("COLOR"):
        values = np.repeat(values[:, None], 4, axis=1)
    field = "color" if data_type.endswith("COLOR") else "value"
    attribute.data.foreach_set(field, np.ascontiguousarray(values, np.float32).ravel())
    bpy.context.view_layer.update()


def roots_with(mask):
    bpy.ops.vellus.add_hair(guide_count=12, strand_count=200, density_group=mask)
    hair = bpy.context.object
    found = points(hair)[:, 0].copy()
    assert hair.data.vellus.status == ""
    return hair, found


@pytest.mark.parametrize("data_type", ["FLOAT", "FLOAT_COLOR"])
def test_an_attribute_of_vertices_is_a_vertex_group(sphere, data_type):
    """An attribute of vertices gives the same roots, bit for bit, as a vertex group with the same weights."""
    add(sphere, data_type, "POINT", group_weights(sphere))
    _hair, by_group = roots_with("top")
    bpy.context.view_layer.objects.active = sphere
    _hair, by_attribute = roots_with("density")
    np.testing.assert_array_equal(by_attribute, by_group)


@pytest.mark.parametrize("domain", ["EDGE", "FACE", "CORNER"])
def test_values_of_other_domains_are_means_around_vertices(sphere, domain):
    """A value of one on all elements of a domain is one at each vertex.

    Ones on half of the sphere leave zeros on the other half, except for a ring.
    """
    mesh = sphere.data
    heights = np.array([vertex.co.z for vertex in mesh.vertices])
    ends = {
        "EDGE": [tuple(edge.vertices) for edge in mesh.edges],
        "FACE": [tuple(polygon.vertices) for polygon in mesh.polygons],
        "CORNER": [(loop.vertex_index,) for loop in mesh.loops],
    }[domain]
    is_high = np.array([min(heights[list(vertices)]) > 0.2 for vertices in ends])
    add(sphere, "FLOAT", domain, np.ones(len(ends)))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    np.testing.assert_array_equal(scene.read_cage_weights(sphere, depsgraph, "density"), np.ones(len(heights)))
    mesh.attributes["density"].data.foreach_set("value", is_high.astype(np.float32))
    mesh.update_tag()
    bpy.context.view_layer.update()
    hair, roots = roots_with("density")
    assert roots[:, 2].min() > -0.2
    mesh.attributes["density"].data.foreach_set("value", 1.0 - is_high.astype(np.float32))
    mesh.update_tag()
    bpy.context.view_layer.update()
    assert np.median(points(hair)[:, 0, 2]) < 0.0


def test_missing_and_unusable_attributes_are_refused_and_bad_values_count_as_zero(sphere):
    """Missing names and vector attributes are refused with a sentence; non-finite and negative values count as zero."""
    for name in ("nope", "position"):
        with pytest.raises(RuntimeError, match=name):
            bpy.ops.vellus.add_hair(guide_count=12, strand_count=200, density_group=name)
    values = group_weights(sphere)
    values[::3], values[1::3] = np.nan, -1.0
    add(sphere, "FLOAT", "POINT", values)
    found = scene.read_cage_weights(sphere, bpy.context.evaluated_depsgraph_get(), "density")
    np.testing.assert_array_equal(found[2::3], values[2::3])
    assert found[::3].max() == found[1::3].max() == 0.0
