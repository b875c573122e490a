# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields of lines offer only objects that can be drawn lines."""

import bpy

from hair_addon.blender.settings import object_names


def test_fields_of_lines_offer_curves_without_hair_and_meshes_of_edges(hair):
    edges = bpy.data.meshes.new("Edges")
    edges.from_pydata([(0.0, 0.0, 1.0), (1.0, 0.0, 1.0)], [(0, 1)], [])
    made = {
        "Curve": bpy.data.curves.new("Curve", "CURVE"),
        "Edges": edges,
        "Lamp": bpy.data.lights.new("Lamp", "POINT"),
    }
    for name, data in {**made, "Strokes": bpy.data.hair_curves.new("Strokes")}.items():
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, data))
    bpy.context.view_layer.update()
    state = bpy.data.objects["Hair"].data.vellus
    assert sorted(object_names.lines(state.hair, bpy.context, "")) == ["Curve", "Edges", "Strokes"]
    assert object_names.lines(state.hair, bpy.context, "cUr") == ["Curve"]
    assert sorted(object_names.meshes(state.hair, bpy.context, "")) == ["Edges", "Sphere"]
