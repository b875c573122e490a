# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's hair node groups work on our guides and hair."""

import bpy
import numpy as np
import pytest

from tests.support.reading import attribute, evaluated_points, points

NODE_ASSETS = bpy.utils.system_resource("DATAFILES", path="assets/nodes") + "/procedural_hair_node_assets.blend"

with bpy.data.libraries.load(NODE_ASSETS, link=False, assets_only=True) as (_shipped, _):
    NAMES = sorted(_shipped.node_groups)

GUIDE_COUNT, STRAND_COUNT, LENGTH = 20, 60, 0.5
CHORD = 5e-3  # an icosphere of four subdivisions lies this far within the sphere


class Strands:
    """Curves as numbers: starts (S+1,), points (all points, 3), and attributes by name."""

    def __init__(self, curves, *names):
        self.starts = np.zeros(len(curves.curves) + 1, np.int32)
        curves.curve_offset_data.foreach_get("value", self.starts)
        self.points = self._read(curves, "position", 3)
        self.values = {name: self._read(curves, name) for name in names}
        self.names = set(curves.attributes.keys())

    @staticmethod
    def _read(curves, name, width=1):
        data = curves.attributes[name].data
        kind = {"INT": np.int32, "BOOLEAN": bool}.get(curves.attributes[name].data_type, np.float32)
        width = 3 if curves.attributes[name].data_type == "FLOAT_VECTOR" else width
        values = np.empty((len(data), width), kind)
        data.foreach_get("vector" if width > 1 else "value", values.ravel())
        return values if width > 1 else values[:, 0]

    def __len__(self):
        return len(self.starts) - 1

    def __iter__(self):
        return (self.points[a:b] for a, b in zip(self.starts, self.starts[1:], strict=False))

    @property
    def roots(self):
        return self.points[self.starts[:-1]]

    @property
    def tips(self):
        return self.points[self.starts[1:] - 1]

    @property
    def lengths(self):
        return np.array([np.linalg.norm(np.diff(strand, axis=0), axis=1).sum() for strand in self])

    @property
    def steps(self):
        """Return (all points,) distances from the point before, zero at roots."""
        return np.concatenate([np.append(0.0, np.linalg.norm(np.diff(strand, axis=0), axis=1)) for strand in self])

    @property
    def bends(self):
        """Return (S,) mean second differences along strands relative to their lengths, zero for straight ones."""
        bends = [np.linalg.norm(np.diff(strand, n=2, axis=0), axis=1).mean() for strand in self]
        return np.array(bends) / self.lengths


@pytest.fixture
def groom(sphere):
    """Return (guides, hair) objects with few strands each."""
    bpy.ops.vellus.add_hair(guide_count=GUIDE_COUNT, strand_count=STRAND_COUNT, length=LENGTH, radius=0.004)
    return bpy.data.objects["Hair Guides"], bpy.data.objects["Hair"]


def appended(name):
    """Return the node group of Blender's hair assets."""
    with bpy.data.libraries.load(NODE_ASSETS, link=False, assets_only=True) as (_there, here):
        here.node_groups = [name]
    return here.node_groups[0]


def evaluated(curves_object, group, *names, **inputs):
    """Return `Strands` before and after a node group with inputs by name, and check that no warning is shown."""
    modifier = curves_object.modifiers.new("Hair Node", "NODES")
    modifier.node_group = group
    sockets = [s for s in group.interface.items_tree if getattr(s, "in_out", "") == "INPUT"]
    identifiers = {s.name: s.identifier for s in sockets if s.socket_type != "NodeSocketGeometry"}
    for name, value in inputs.items():
        getattr(modifier.properties.inputs, identifiers[name]).value = value
    before = Strands(curves_object.data)
    curves_object.update_tag()
    bpy.context.view_layer.update()
    after = Strands(curves_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).data, *names)
    warnings = [w.message for w in modifier.node_warnings if w.type in {"WARNING", "ERROR"}]
    curves_object.modifiers.remove(modifier)
    assert warnings == []
    assert len(after) and np.isfinite(after.points).all()
    return before, after


def keeps_roots(before, after):
    assert len(after) == len(before)
    np.testing.assert_allclose(after.roots, before.roots, atol=1e-5)


def keeps_lengths(before, after):
    """Assert that lengths stay, except where new points cut corners."""
    keeps_roots(before, after)
    np.testing.assert_allclose(after.lengths, before.lengths, rtol=0.01)


def keeps_all(before, after):
    np.testing.assert_array_equal(after.starts, before.starts)
    np.testing.assert_allclose(after.points, before.points, atol=1e-5)


def moves(before, after):
    keeps_roots(before, after)
    assert np.median(np.linalg.norm(after.tips - before.tips, axis=1)) > 0.02 * LENGTH


def trims(before, after):
    keeps_roots(before, after)
    np.testing.assert_allclose(after.lengths, 0.2, rtol=1e-3)


def smooths(before, after):
    keeps_lengths(before, after)
    assert after.bends.mean() < before.bends.mean()


def blends(before, after):
    """Assert that strands become more like their neighbors."""
    keeps_roots(before, after)
    nearest = np.linalg.norm(before.roots[:, None] - before.roots[None], axis=-1)
    np.fill_diagonal(nearest, np.inf)
    beside = nearest.argmin(axis=1)
    one, other = (strands.tips - strands.roots for strands in (before, after))
    assert np.linalg.norm(other - other[beside], axis=1).mean() < np.linalg.norm(one - one[beside], axis=1).mean()


def shrinkwraps(before, after):
    keeps_roots(before, after)
    heights, before_that = (np.linalg.norm(strands.points, axis=1) - 1.0 for strands in (after, before))
    assert heights.min() > -2.0 * CHORD
    assert heights.max() < 0.6 * before_that.max() and heights.mean() < 0.6 * before_that.mean()


def sets_profile(before, after):
    keeps_all(before, after)
    radii = after.values["radius"].reshape(len(after), -1)
    np.testing.assert_allclose(radii.max(axis=1), 0.02, rtol=1e-3)
    assert (radii[:, -1] < radii[:, 0]).all()


def displaces(before, after):
    keeps_roots(before, after)
    np.testing.assert_allclose(after.tips - before.tips, np.tile([(0.0, 0.0, 0.1)], (len(before), 1)), atol=1e-4)


def subdivides(before, after):
    """Assert that rolls, curls and braids have finer curves with the same roots and another course."""
    assert len(after) == len(before) and len(after.points) > len(before.points)
    np.testing.assert_allclose(after.roots, before.roots, atol=1e-4)
    assert after.bends.mean() > 0.0 and np.linalg.norm(after.points, axis=1).max() < 1.0 + 1.5 * LENGTH


def duplicates(before, after):
    assert len(after) == 4 * len(before)
    nearest = np.linalg.norm(after.roots[:, None] - before.roots[None], axis=-1)
    assert nearest.min(axis=1).max() <= 0.05 + 1e-5  # within the radius, and as many around each
    assert (np.bincount(nearest.argmin(axis=1), minlength=len(before)) >= 1).all()


def interpolates(before, after):
    """Assert that strands have the number by density and area, are rooted on the sphere, and are no longer than
    their guides.
    """
    assert len(after) == pytest.approx(10.0 * 4.0 * np.pi, rel=0.25)
    np.testing.assert_allclose(np.linalg.norm(after.roots, axis=1), 1.0, atol=CHORD)
    assert after.lengths.max() < 1.01 * before.lengths.max() and after.lengths.min() > 0.2 * before.lengths.min()


def generates(before, after):
    """Assert that new strands are beside the former ones."""
    is_old = np.array([min(np.linalg.norm(before.roots - root, axis=1)) < 1e-6 for root in after.roots])
    assert is_old.sum() == len(before)
    assert (~is_old).sum() == pytest.approx(10.0 * 4.0 * np.pi, rel=0.25)
    np.testing.assert_allclose(after.lengths[~is_old], LENGTH, rtol=1e-3)


def attaches(before, after):
    keeps_all(before, after)
    np.testing.assert_allclose(np.linalg.norm(after.roots, axis=1), 1.0, atol=CHORD)


def maps_guides(before, after):
    keeps_all(before, after)
    guide = after.values["guide_curve_index"]
    assert guide.min() >= 0 and guide.max() < len(after)


# Modifier → (inputs that differ from the defaults, check of its effect).
LAWS = {
    "Attach Hair Curves to Surface": ({"Surface Object": "Sphere"}, attaches),
    "Blend Hair Curves": ({"Blend Radius": 0.5}, blends),
    "Braid Hair Curves": ({"Radius": 0.05}, subdivides),
    "Clump Hair Curves": ({}, keeps_roots),
    "Create Guide Index Map": ({"Guide Distance": 0.5}, maps_guides),
    "Curl Hair Curves": ({"Radius": 0.05}, subdivides),
    "Displace Hair Curves": ({"Displace Vector": (0.0, 0.0, 0.1)}, displaces),
    "Duplicate Hair Curves": ({"Amount": 3, "Radius": 0.05}, duplicates),
    "Frizz Hair Curves": ({}, moves),
    "Generate Hair Curves": ({"Surface": "Sphere", "Hair Length": LENGTH}, generates),
    "Hair Curves Noise": ({"Distance": 0.05}, moves),
    "Interpolate Hair Curves": ({}, interpolates),
    "Redistribute Curve Points": ({}, keeps_lengths),
    "Restore Curve Segment Length": ({}, keeps_all),
    "Roll Hair Curves": ({}, subdivides),
    "Rotate Hair Curves": ({"Angle": 0.5}, moves),
    "Set Hair Curve Profile": ({"Radius": 0.02}, sets_profile),
    "Shrinkwrap Hair Curves": ({"Surface": "Sphere"}, shrinkwraps),
    "Smooth Hair Curves": ({}, smooths),
    # Blender 5.2 takes any curves to their roots instead of their chords, and then restores their lengths.
    "Straighten Hair Curves": ({"Amount": 0.5}, keeps_lengths),
    "Trim Hair Curves": ({"Length": 0.2}, trims),
}

# Groups for other groups: {output: what it is}.
FIELDS = {
    "Attachment Info": {
        "Attachment Is Valid": lambda strands, made: np.ones(len(strands), bool),
        "Surface Normal": lambda strands, made: attribute(made, "surface_normal", 3),
    },
    "Curve Info": {
        "Curve Index": lambda strands, made: np.arange(len(strands)),
        "Curve ID": lambda strands, made: attribute(made, "id"),
        "Length": lambda strands, made: strands.lengths,
    },
    "Curve Root": {"Root Position": lambda strands, made: strands.roots},
    "Curve Segment": {"Segment Length": lambda strands, made: strands.steps},
    "Curve Tip": {
        "Tip Position": lambda strands, made: strands.tips,
        "Tip Index": lambda strands, made: strands.starts[1:] - 1,
    },
}


def test_every_group_that_blender_ships_is_tried():
    assert sorted([*LAWS, *FIELDS]) == NAMES


@pytest.mark.parametrize("name", LAWS)
def test_a_hair_node_does_what_it_says(groom, name):
    inputs, law = LAWS[name]
    inputs = {key: bpy.data.objects[value] if isinstance(value, str) else value for key, value in inputs.items()}
    group = appended(name)
    read = [n for n in ("radius",) if name == "Set Hair Curve Profile"]
    read += [n for n in ("guide_curve_index",) if name == "Create Guide Index Map"]
    for made in groom:
        law(*evaluated(made, group, *read, **inputs))


@pytest.mark.parametrize("name", FIELDS)
def test_a_group_of_fields_knows_our_curves(groom, name):
    """A group of fields reads our curves: a modifier stores each output as an attribute."""
    group = appended(name)
    wrapper = bpy.data.node_groups.new("Wrapper", "GeometryNodeTree")
    wrapper.is_modifier = True
    for in_out in ("INPUT", "OUTPUT"):
        wrapper.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    node = wrapper.nodes.new("GeometryNodeGroup")
    node.node_tree = group
    geometry = wrapper.nodes.new("NodeGroupInput").outputs[0]
    for taken in node.inputs:
        wrapper.links.new(geometry, taken)
    kinds = {"VALUE": "FLOAT", "VECTOR": "FLOAT_VECTOR", "INT": "INT", "BOOLEAN": "BOOLEAN"}
    for output, _value in FIELDS[name].items():
        store = wrapper.nodes.new("GeometryNodeStoreNamedAttribute")
        store.data_type = kinds[node.outputs[output].type]
        store.domain = "POINT" if name == "Curve Segment" else "CURVE"
        store.inputs["Name"].default_value = output
        wrapper.links.new(geometry, store.inputs["Geometry"])
        wrapper.links.new(node.outputs[output], store.inputs["Value"])
        geometry = store.outputs[0]
    wrapper.links.new(geometry, wrapper.nodes.new("NodeGroupOutput").inputs[0])
    for made in groom:
        before, after = evaluated(made, wrapper, *FIELDS[name])
        keeps_all(before, after)
        for output, expected in FIELDS[name].items():
            np.testing.assert_allclose(after.values[output], expected(before, made), atol=1e-4)


def test_hair_nodes_work_where_the_surface_is_now(groom):
    """Hair nodes work on the deformed surface, after the nodes that carry strands: trimmed hair keeps its roots
    there.
    """
    twist = bpy.data.objects["Sphere"].modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method, twist.angle = "TWIST", 2.0
    bpy.context.view_layer.update()
    for made in groom:
        carried = evaluated_points(made)
        assert np.abs(carried[:, 0] - points(made)[:, 0]).max() > 0.1
        _at_rest, after = evaluated(made, appended("Trim Hair Curves"), Length=0.2)
        np.testing.assert_allclose(after.roots, carried[:, 0], atol=1e-5)
        np.testing.assert_allclose(after.lengths, 0.2, rtol=1e-3)


def test_clumps_are_those_of_the_guides(groom):
    """Clumps are those of the guides: tips meet at the strand that `guide_curve_index` names."""
    guides, hair = groom
    before, after = evaluated(hair, appended("Clump Hair Curves"), Factor=1.0)
    leader = attribute(hair, "guide_curve_index")
    assert np.array_equal(leader[leader], leader)  # who leads follows nobody
    is_leader = leader == np.arange(len(before))
    np.testing.assert_allclose(after.tips[is_leader], before.tips[is_leader], atol=1e-5)
    np.testing.assert_allclose(after.tips, after.tips[leader], atol=1e-3)
    # No farther than where its own guide is: the sphere has room for twenty of them.
    assert np.linalg.norm(before.roots - before.roots[leader], axis=1).max() < 1.5
    apart = np.linalg.norm(before.roots[:, None] - points(guides)[None, :, 0], axis=-1)
    led = apart.argmin(axis=1)
    assert np.array_equal(led, led[leader])
    for guide in np.unique(led):
        own = np.flatnonzero(led == guide)
        assert leader[own[0]] == own[apart[own, guide].argmin()]
