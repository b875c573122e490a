# SPDX-License-Identifier: GPL-3.0-or-later
"""An artist's modifiers are included in files and meshes of hair as rendered, or left out with a message."""

import itertools

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.io import hair_cards, hair_meshes
from hair_addon.core.cards.card_settings import CardSettings, TubeSettings
from hair_addon.core.long_work import run_now
from tests.support.commands import run_here
from tests.support.dynamics.following import update
from tests.support.exchange import alembic_reader
from tests.support.exchange.exported import export, shape, world
from tests.support.reading import attribute


def add_modifier(hair, *kinds):
    """Add a modifier with the given nodes in a row."""
    group = bpy.data.node_groups.new("Artist", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    nodes = [group.nodes.new(kind) for kind in ("NodeGroupInput", *kinds, "NodeGroupOutput")]
    for node in nodes:
        for name, value in (("Offset", (0.1, 0.2, 3.0)), ("Radius", 0.01), ("Count", 7)):
            if name in node.inputs:
                node.inputs[name].default_value = value
    for first, second in itertools.pairwise(nodes):
        group.links.new(first.outputs[0], second.inputs[0])
    modifier = hair.modifiers.new("Artist", "NODES")
    modifier.node_group = group
    update()
    return modifier


def test_files_have_what_renders_show(twisted, tmp_path):
    hair, _guides = twisted
    add_modifier(hair, "GeometryNodeSetPosition", "GeometryNodeSetCurveRadius")
    assert export(tmp_path / "groom.abc").notes == []
    found = shape(alembic_reader.read(tmp_path / "groom.abc"), "Hair")
    np.testing.assert_allclose(found["P"].only, 100.0 * world(hair).reshape(-1, 3), atol=1e-3)
    evaluated = hair.evaluated_get(bpy.context.evaluated_depsgraph_get())
    scale = abs(np.linalg.det(np.array(hair.matrix_world)[:3, :3])) ** (1.0 / 3.0)
    np.testing.assert_allclose(found["width"].only, 200.0 * scale * attribute(evaluated, "radius"), rtol=1e-5)
    assert np.linalg.norm(world(hair) - api.points(hair), axis=-1).min() > 1.0


def test_meshes_have_what_renders_show(hair):
    add_modifier(hair, "GeometryNodeSetPosition")
    settings = TubeSettings(tube_count=0, point_count=41, thickness=1e-3)
    made = run_now(hair_meshes.making_tubes(hair.data, settings))
    assert made.notes == []
    cards = run_now(hair_cards.making_cards(hair.data, CardSettings(card_count=60, texture_size=128)))[0]
    update()
    strands = world(hair).reshape(-1, 3)
    for mesh_object, nearness in ((made.mesh_object, 1e-2), (cards.mesh_object, 0.15)):
        box = np.array(mesh_object.bound_box)
        np.testing.assert_allclose(box.min(axis=0), strands.min(axis=0), atol=nearness)
        np.testing.assert_allclose(box.max(axis=0), strands.max(axis=0), atol=nearness)


@pytest.mark.parametrize("way", ["other points", "no curves", "shown in renders only", "hidden"])
def test_modifiers_that_are_left_out_are_named(hair, tmp_path, way):
    wanted = 100.0 * api.points(hair).reshape(-1, 3)
    kinds = {"other points": "GeometryNodeResampleCurve", "no curves": "GeometryNodeCurveToMesh"}
    modifier = add_modifier(hair, kinds.get(way, "GeometryNodeSetPosition"))
    modifier.show_viewport = way != "shown in renders only"
    hair.hide_set(way == "hidden")
    update()
    (note,) = export(tmp_path / "groom.abc").notes
    assert 'Modifiers of "Hair" are left out' in str(note) and "Artist" in str(note)
    found = shape(alembic_reader.read(tmp_path / "groom.abc"), "Hair")
    np.testing.assert_allclose(found["P"].only, wanted, atol=1e-3)
    made = run_now(hair_meshes.making_tubes(hair.data, TubeSettings(tube_count=5)))
    assert [str(one) for one in made.notes] == [str(note)]


def test_the_command_line_says_so_too(hair, tmp_path):
    add_modifier(hair, "GeometryNodeResampleCurve")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    for verb, *words in (("tubes", "--tubes", "5"), ("cards", "--cards", "2", "--texture-size", "128")):
        ended = run_here(verb, tmp_path / "shot.blend", "--out", tmp_path / "out.obj", *words)
        assert ended.status == 0 and 'Modifiers of "Hair" are left out' in ended.errors
