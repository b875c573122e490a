# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on a surface that shows another object's geometry, as proxies do, follows it or reports why not."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.systems import diagnostics
from tests.support.dynamics.following import assert_follows, grow, update
from tests.support.reading import evaluated_points, points

LACKING = 'Modifiers of "Shown" create faces without rest positions: hair does not follow their deformation.'


def shown(build):
    """Return a mesh object `Shown` whose geometry nodes output the socket that `build(nodes, links)` returns."""
    bpy.ops.mesh.primitive_plane_add()
    surface = bpy.context.object
    surface.name = "Shown"
    group = bpy.data.node_groups.new("Shown", "GeometryNodeTree")
    group.is_modifier = True
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    output = group.nodes.new("NodeGroupOutput")
    group.links.new(build(group.nodes), output.inputs[0])
    surface.modifiers.new("Shown", "NODES").node_group = group
    update()
    return surface


@pytest.fixture
def source(scene):
    """Return a ball with a modifier that twists it, switched off."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    ball = bpy.context.object
    ball.name = "Source"
    twist = ball.modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 0.0
    return ball


def of_object(source):
    def build(nodes):
        node = nodes.new("GeometryNodeObjectInfo")
        node.inputs["Object"].default_value = source
        return node.outputs["Geometry"]

    return build


def test_hair_follows_the_geometry_of_another_object(source):
    surface = shown(of_object(source))
    grown = grow(surface)
    assert source.add_rest_position_attribute
    before = points(grown[1])
    source.modifiers["Twist"].angle = 1.5
    update()
    assert np.abs(evaluated_points(grown[1])[:, 0] - before[:, 0]).max() > 0.3
    assert_follows(*grown)
    np.testing.assert_array_equal(points(grown[1]), before)
    assert LACKING not in [warning.text for warning in diagnostics.warnings_of(surface, [g.data for g in grown])]


def test_faces_without_rest_positions_are_reported(scene):
    surface = shown(lambda nodes: nodes.new("GeometryNodeMeshIcoSphere").outputs["Mesh"])
    grown = grow(surface)
    assert LACKING in [warning.text for warning in diagnostics.warnings_of(surface, [g.data for g in grown])]
    assert LACKING not in [warning.text for warning in diagnostics.warnings_of(surface, [])]
