# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes that deform strands with their surface, after an artist has changed them."""

import bpy
import pytest

from hair_addon import api
from hair_addon.blender.live import invalidation
from tests.support.dynamics.following import assert_follows, grow, update
from tests.support.reading import points


def group():
    return bpy.data.node_groups["Vellus Follow Surface"]


def item(identifier):
    return next(i for i in group().interface.items_tree if getattr(i, "identifier", None) == identifier)


def rename_inputs(_hair):
    for identifier in ("Socket_1", "Socket_2", "Socket_3"):
        item(identifier).name = "Something"


def rename_group(_hair):
    group().name = "Mine"


def remove_input(_hair):
    group().interface.remove(item("Socket_1"))


def retype_input(_hair):
    item("Socket_2").socket_type = "NodeSocketString"


def add_inputs(_hair):
    group().interface.new_panel("Surface")
    group().interface.new_socket("Vertices", in_out="INPUT", socket_type="NodeSocketString")


def empty_group(_hair):
    group().nodes.clear()


def empty_modifier(hair):
    hair.modifiers[0].node_group = None


def rename_modifier(hair):
    hair.modifiers[0].name = "Mine"


def remove_modifier(hair):
    hair.modifiers.clear()


def other_group(_hair):
    group().name = "Ours"
    bpy.data.node_groups.new("Vellus Follow Surface", "GeometryNodeTree")


def shader_group(_hair):
    bpy.data.node_groups.remove(group())
    other = bpy.data.node_groups.new("Vellus Follow Surface", "ShaderNodeTree")
    other["vellus_version"] = 1


WAYS = [rename_inputs, rename_group, remove_input, retype_input, add_inputs, empty_group, empty_modifier]
WAYS += [rename_modifier, remove_modifier, other_group, shader_group]
STILL_CARRY = {rename_inputs, rename_group, add_inputs, rename_modifier, other_group}


def deform():
    sphere = bpy.data.objects["Sphere"]
    if not sphere.modifiers:
        twist = sphere.modifiers.new("Twist", "SIMPLE_DEFORM")
        twist.deform_method, twist.angle = "TWIST", 1.0
    update()


@pytest.mark.parametrize("way", WAYS)
def test_hair_is_made_and_carried_beside_nodes_that_were_changed(hair, way, capfd):
    before = points(hair)
    way(hair)
    hair.data.vellus.hair.keep_length = 0.0
    hair.data.vellus.hair.strand_count = 300
    update()
    assert hair.data.vellus.status == "" and len(points(hair)) == 300 != len(before)
    deform()
    if way in STILL_CARRY:
        assert_follows(hair)
    new = grow(bpy.data.objects["Sphere"], guide_count=10, strand_count=30)
    invalidation.clear()
    assert_follows(*new)
    reported = capfd.readouterr()
    assert "Traceback" not in reported.err + reported.out


def test_a_surface_that_is_not_a_mesh_is_reported(lit, capfd):
    camera, guides = bpy.data.objects["Camera"], bpy.data.objects["Guides"]
    guides.data.surface = lit.data.surface = camera
    lit.data.vellus.hair.keep_length = 0.5
    lit.data.vellus.hair.region_attribute = "regions"
    update()
    assert "mesh" in lit.data.vellus.status
    api.draw(width=16, height=12, samples_per_side=1)
    assert len(api.points(lit)) == 500
    reported = capfd.readouterr()
    assert "Traceback" not in reported.err + reported.out
