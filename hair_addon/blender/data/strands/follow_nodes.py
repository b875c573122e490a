# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry nodes that deform strands with their surface: surface_deform.py as a modifier.

Hair follows an armature in every frame that Cycles renders or an exporter writes, in linked files, and without the
add-on. Nodes locate a root by its stored vertices, without a UV map. On a surface with another number of vertices, such
as a finer subdivision for renders, strands begin at the nearest point of the surface at rest.

Blender checks a group after each change of it, so building this group takes a quarter of a second. New hair appends it
in 17 ms from follow_nodes.blend, which tools/write_nodes.py writes; where that file cannot be read, it is built.
"""

from pathlib import Path

import bpy

from ....core import geometry
from ...host.notices import name_of
from . import stored_roots

_NAME = "Vellus Follow Surface"
# Version of the nodes below. New hair does not use groups of other versions.
_VERSION = 2
# The built group, beside this module.
_FILE = Path(__file__).with_suffix(".blend")
# Inputs of the group: identifiers, which stay when an artist renames inputs, and types.
_INPUTS = {
    "Surface": ("Socket_1", "NodeSocketObject"),
    "Vertices": ("Socket_2", "NodeSocketInt"),
    "Combed": ("Socket_3", "NodeSocketBool"),
    "Cage Corners": ("Socket_4", "NodeSocketInt"),
    "Hidden": ("Socket_5", "NodeSocketBool"),
}


def add_modifier(curves_object):
    """Add the modifier that deforms an object's strands with their surface (`set_surface`), before other modifiers."""
    modifier = curves_object.modifiers.new("Follow Surface", "NODES")
    modifier.node_group = _group()
    curves_object.modifiers.move(len(curves_object.modifiers) - 1, 0)


def set_surface(curves_object, surface_object, vertex_count, is_combed, cage_corners):
    """Set the surface that an object's strands follow, if it still has the modifier.

    vertex_count: of the evaluated surface that root vertices refer to; is_combed: whether brushes move the deformed
    strands, which needs a UV map; cage_corners: of a `Surface`.
    """
    inputs = {"Surface": surface_object, "Vertices": vertex_count, "Combed": is_combed, "Cage Corners": cage_corners}
    _set(curves_object, inputs)


def set_smoothness(curves_object, cage_corners):
    """Set only the cage corners of the surface that an object's strands follow."""
    _set(curves_object, {"Cage Corners": cage_corners})


def _set(curves_object, inputs):
    for modifier in curves_object.modifiers:
        if modifier.type == "NODES" and _is_ours(modifier.node_group):
            for name in inputs.keys() & set(_intact_inputs(modifier.node_group)):
                socket = getattr(modifier.properties.inputs, _INPUTS[name][0])
                if socket.value != inputs[name]:
                    socket.value = inputs[name]


def is_hidden(curves_object):
    """Whether evaluation for viewports leaves out an object's strands; evaluation for renders never does."""
    return any(_hidden_input(modifier).value for modifier in _hiding_modifiers(curves_object))


def hide(curves_object, is_hidden):
    """Let evaluation for viewports leave out an object's strands, or include them; returns whether it can."""
    modifiers = _hiding_modifiers(curves_object)
    for modifier in modifiers:
        if _hidden_input(modifier).value != is_hidden:
            _hidden_input(modifier).value = is_hidden
            curves_object.update_tag(refresh={"DATA"})  # Blender does not tag the change itself
    return bool(modifiers)


def _hidden_input(modifier):
    return getattr(modifier.properties.inputs, _INPUTS["Hidden"][0])


def _hiding_modifiers(curves_object):
    """Our modifiers whose nodes can hide strands: groups that an artist edited may lack the input."""
    found = (m for m in curves_object.modifiers if m.type == "NODES" and _is_ours(m.node_group))
    return [modifier for modifier in found if "Hidden" in _intact_inputs(modifier.node_group)]


def modifier_of(curves_object):
    """Return the modifier that deforms an object's strands with their surface; None if an artist has removed it."""
    found = (m for m in curves_object.modifiers if m.type == "NODES" and _is_ours(m.node_group))
    return next(found, None)


def modifiers_of_artist(curves_object):
    """Names of an object's modifiers that renders show, except the one that deforms strands with their surface."""
    shown = [modifier for modifier in curves_object.modifiers if modifier.show_render]
    return [name_of(m) for m in shown if m.type != "NODES" or (m.node_group is not None and not _is_ours(m.node_group))]


def _is_ours(group):
    return group is not None and group.bl_idname == "GeometryNodeTree" and "vellus_version" in group


def _intact_inputs(group):
    """Return the names of our inputs that are still in a group, even if renamed."""
    kinds = {
        item.identifier: item.socket_type
        for item in group.interface.items_tree
        if item.item_type == "SOCKET" and item.in_out == "INPUT"
    }
    return [name for name, (identifier, kind) in _INPUTS.items() if kinds.get(identifier) == kind]


def _carries(group):
    """Whether new hair can use a group: users may have removed inputs or outputs."""
    output = next((node for node in group.nodes if node.type == "GROUP_OUTPUT"), None)
    has_output = output is not None and any(socket.is_linked for socket in output.inputs)
    return has_output and len(_intact_inputs(group)) == len(_INPUTS)


def _group():
    """Return the node group of this version, created if the file has no usable one."""
    for group in bpy.data.node_groups:
        if _is_ours(group) and group["vellus_version"] == _VERSION and group.library is None and _carries(group):
            return group
    return _appended() or build()


def _appended():
    """Return a copy of the group in the file; None if there is none of this version."""
    known = set(bpy.data.libraries)
    try:
        with bpy.data.libraries.load(str(_FILE)) as (there, here):
            here.node_groups = [name for name in there.node_groups if name == _NAME]
    except OSError:
        return None
    bpy.data.batch_remove(set(bpy.data.libraries) - known)
    found = [group for group in here.node_groups if group["vellus_version"] == _VERSION]
    return found[0] if found else None


def write_file():
    """Build the group and write its file."""
    bpy.data.libraries.write(str(_FILE), {build()}, fake_user=True, compress=True)


def build():
    """Build the group, node by node."""
    group = bpy.data.node_groups.new(_NAME, "GeometryNodeTree")
    group["vellus_version"] = _VERSION
    group.is_modifier = True
    group.interface.new_socket("Curves", in_out="INPUT", socket_type="NodeSocketGeometry")
    for name, (_identifier, kind) in _INPUTS.items():
        group.interface.new_socket(name, in_out="INPUT", socket_type=kind)
    group.interface.items_tree["Hidden"].hide_in_modifier = True
    group.interface.new_socket("Curves", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    _Tree(group).build()
    return group


class _Tree:
    """Nodes as functions of sockets: each method adds nodes and returns their outputs."""

    def __init__(self, group):
        self._group = group

    def build(self):
        """Build the whole group, from its input to its output."""
        inputs = self._node("NodeGroupInput").outputs
        # In the surface's local coordinates, which its children share.
        info = self._node("GeometryNodeObjectInfo", {"Object": inputs["Surface"]}, transform_space="ORIGINAL")
        position = self._node("GeometryNodeInputPosition").outputs[0]
        # Rest positions of strands, for nodes that use them: Blender shares the array.
        at_rest = self._node(
            "GeometryNodeStoreNamedAttribute",
            {"Geometry": inputs["Curves"], "Name": "rest_position", "Value": position},
            data_type="FLOAT_VECTOR",
            domain="POINT",
        ).outputs[0]
        smooth_rest = self._smooth_rest(info.outputs["Geometry"], inputs["Cage Corners"], self._rest(position))
        surface, (after, *axes) = self._with_motion(*smooth_rest, position)
        before, after, x_axis, y_axis = self._at_roots(
            surface, info.outputs["Geometry"], inputs["Vertices"], [self._rest(position), after, *axes]
        )
        rotation = self._node(
            "FunctionNodeAxesToRotation",
            {0: x_axis, 1: self._vector("CROSS_PRODUCT", x_axis, y_axis)},
            primary_axis="X",
            secondary_axis="Z",
        ).outputs[0]
        turned = self._node("FunctionNodeRotateVector", {0: before, 1: rotation}).outputs[0]
        # Computed once per strand, not once per point.
        offset = self._on_domain(self._vector("SUBTRACT", after, turned), "FLOAT_VECTOR", "CURVE")
        rotation = self._on_domain(rotation, "QUATERNION", "CURVE")
        curves, (position,) = self._capture(at_rest, [position])
        turned = self._node("FunctionNodeRotateVector", {0: position, 1: rotation}).outputs[0]
        moved = self._node(
            "GeometryNodeSetPosition",
            {
                "Geometry": self._with_turns_for_brushes(curves, inputs["Combed"]),
                "Position": self._vector("ADD", turned, offset),
            },
        )
        # An undeformed surface costs only a comparison.
        is_deformed = self._is_deformed(info.outputs["Geometry"])
        carried = self._switch(is_deformed, at_rest, moved.outputs[0], "GEOMETRY")
        hidden = self._ends_of_box(inputs["Curves"])
        self._node("NodeGroupOutput", {0: self._switch(self._is_hidden(inputs), carried, hidden, "GEOMETRY")})
        self._spread_out()

    def _spread_out(self):
        """Place the nodes in a row; at once, as Blender would check the group after each assignment."""
        count = len(self._group.nodes)
        self._group.nodes.foreach_set("location", [part for column in range(count) for part in (180.0 * column, 0.0)])

    def _is_hidden(self, inputs):
        """Hidden in viewports only: renders always have strands."""
        in_viewport = self._node("GeometryNodeIsViewport").outputs[0]
        return self._node("FunctionNodeBooleanMath", {0: inputs["Hidden"], 1: in_viewport}, operation="AND").outputs[0]

    def _ends_of_box(self, curves):
        """Two curves without length or width that have the bounding box of others, for View Selected."""
        box = self._node("GeometryNodeBoundBox", {0: curves, "Use Radius": False}).outputs
        joined = self._node("GeometryNodeJoinGeometry")
        for corner in (box["Min"], box["Max"]):
            line = self._node("GeometryNodeCurvePrimitiveLine", {"Start": corner, "End": corner}).outputs[0]
            line = self._node("GeometryNodeSetCurveRadius", {0: line, "Radius": 0.0}).outputs[0]
            self._group.links.new(line, joined.inputs[0])
        return joined.outputs[0]

    def _is_deformed(self, surface):
        position = self._node("GeometryNodeInputPosition").outputs[0]
        inputs = {"Geometry": surface, "Attribute": self._vector("DISTANCE", position, self._rest(position))}
        farthest = self._node("GeometryNodeAttributeStatistic", inputs, data_type="FLOAT", domain="POINT")
        return self._node("FunctionNodeCompare", {"A": farthest.outputs["Max"], "B": 0.0}, data_type="FLOAT").outputs[0]

    def _with_turns_for_brushes(self, curves, is_combed):
        """Store the deformation for sculpt brushes, which only Blender's own node provides."""
        deformed = self._node("GeometryNodeDeformCurvesOnSurface", {0: curves}).outputs[0]
        return self._switch(is_combed, curves, deformed, "GEOMETRY")

    def _smooth_rest(self, surface, cage_corners, rest):
        """Return the surface and each vertex's position on the smooth surface at rest: smooth_surface.py."""
        by = geometry.smooth_surface
        face_count = self._node("GeometryNodeAttributeDomainSize", {0: surface}).outputs["Face Count"]
        refinement = self._math("DIVIDE", self._math("MULTIPLY", face_count, 4.0), cage_corners)
        is_fine = self._node(
            "FunctionNodeCompare", {"A": refinement, "B": by.LEAST_REFINEMENT}, operation="GREATER_EQUAL"
        ).outputs[0]
        variance = self._math("MULTIPLY", refinement, by.HAT_VARIANCE)
        count = self._math(
            "MINIMUM", self._math("CEIL", self._math("DIVIDE", variance, by.MOST_VARIANCE)), by.MOST_ROUNDS
        )
        part = self._math("MINIMUM", self._math("DIVIDE", variance, count), by.MOST_VARIANCE)
        weight = self._math("DIVIDE", part, self._math("SUBTRACT", 2.0, self._math("MULTIPLY", part, 4.0)))
        inputs = {"Value": rest, "Iterations": self._math("MULTIPLY", count, is_fine), "Weight": weight}
        means = self._node("GeometryNodeBlurAttribute", inputs, data_type="FLOAT_VECTOR").outputs[0]
        surface, (smooth_rest,) = self._capture(surface, [means])
        return surface, smooth_rest

    def _with_motion(self, surface, smooth_rest, position):
        """Return the surface and each vertex's position and rotated x and y axes."""
        face = self._node("GeometryNodeInputIndex").outputs[0]
        corners = []
        for offset in (0, 1, -1):
            corner = self._node("GeometryNodeCornersOfFace", {"Face Index": face, "Sort Index": offset}).outputs[0]
            corners.append(self._node("GeometryNodeVertexOfCorner", {0: corner}).outputs[0])
        inverse = self._node("FunctionNodeInvertMatrix", {0: self._basis(smooth_rest, corners)}).outputs
        is_now = self._basis(position, corners)
        gradient = self._node("FunctionNodeMatrixMultiply", {0: is_now, 1: inverse["Matrix"]}).outputs[0]
        columns = []
        for column in self._axes_of(gradient, 3):
            # A face without area has no gradient, and no weight.
            column = self._vector("SCALE", column, scale=inverse["Invertible"])
            columns.append(self._on_domain(column, "FLOAT_VECTOR", "FACE"))
        surface, columns = self._capture(surface, columns)
        factors = self._node("FunctionNodeMatrixSVD", {0: self._matrix(*columns)}).outputs
        back = self._node("FunctionNodeTransposeMatrix", {0: factors["V"]}).outputs[0]
        nearest = self._node("FunctionNodeMatrixMultiply", {0: factors["U"], 1: back}).outputs[0]
        return self._capture(surface, [position, *self._axes_of(nearest, 2)])

    def _at_roots(self, surface, evaluated, vertex_count, values):
        """Vectors of a surface's vertices at the strands' roots."""
        barycentric = self._named("root_barycentric", "FLOAT_VECTOR")
        weights = self._node("ShaderNodeSeparateXYZ", {0: barycentric}).outputs
        corners = [self._named(name, "INT") for name in stored_roots.VERTICES]
        found = self._node("GeometryNodeAttributeDomainSize", {0: evaluated}).outputs["Point Count"]
        is_other = self._node(
            "FunctionNodeCompare", {"A": found, "B": vertex_count}, data_type="INT", operation="NOT_EQUAL"
        ).outputs[0]
        position = self._node("GeometryNodeInputPosition").outputs[0]
        first = self._node("GeometryNodePointsOfCurve", {"Sort Index": 0}).outputs[0]
        root = self._on_domain(self._at_index(position, first), "FLOAT_VECTOR", "CURVE")
        at_rest = self._node("GeometryNodeSetPosition", {"Geometry": surface, "Position": self._rest(position)})
        floats = self._node("GeometryNodeInputNamedAttribute", {"Name": "root_distance"}, data_type="FLOAT")

        def at_root(value, is_start=False):
            parts = [
                self._vector("SCALE", self._sample(surface, value, corner), scale=weight)
                for corner, weight in zip(corners, weights, strict=True)
            ]
            known = self._vector("ADD", self._vector("ADD", *parts[:2]), parts[2])
            nearest = self._node(
                "GeometryNodeSampleNearestSurface",
                {"Mesh": at_rest.outputs[0], "Value": value, "Sample Position": root},
                data_type="FLOAT_VECTOR",
            ).outputs[0]
            if is_start:  # strands that were placed on a cage begin off the surface
                known = self._vector("SUBTRACT", known, self._named(stored_roots.SLIDE, "FLOAT_VECTOR"))
            if is_start:  # faces at another level of subdivision do not lie within the faces of a bent cage
                nearest = self._switch(floats.outputs["Exists"], root, nearest)
            return self._switch(is_other, known, nearest)

        before, *others = values
        return [at_root(before, is_start=True), *map(at_root, others)]

    def _rest(self, position):
        """Rest positions of vertices; current positions if Blender does not store them."""
        named = self._node("GeometryNodeInputNamedAttribute", {"Name": "rest_position"}, data_type="FLOAT_VECTOR")
        return self._switch(named.outputs["Exists"], position, named.outputs["Attribute"])

    def _basis(self, value, corners):
        first, following, last = (self._at_index(value, corner) for corner in corners)
        along = self._vector("SUBTRACT", following, first)
        across = self._vector("SUBTRACT", last, first)
        return self._matrix(along, across, self._vector("NORMALIZE", self._vector("CROSS_PRODUCT", along, across)))

    def _matrix(self, *columns):
        matrix = self._node("FunctionNodeCombineMatrix")
        for index, column in enumerate(columns, start=1):
            for row, part in enumerate(self._node("ShaderNodeSeparateXYZ", {0: column}).outputs, start=1):
                self._group.links.new(part, matrix.inputs[f"Column {index} Row {row}"])
        return matrix.outputs[0]

    def _axes_of(self, matrix, count):
        """Images of the first axes under a matrix."""
        axes = ((1, 0, 0), (0, 1, 0), (0, 0, 1))[:count]
        return [self._node("FunctionNodeTransformDirection", {0: axis, 1: matrix}).outputs[0] for axis in axes]

    def _capture(self, geometry, vectors):
        node = self._node("GeometryNodeCaptureAttribute", {"Geometry": geometry}, domain="POINT")
        names = [f"Value {index}" for index in range(len(vectors))]
        for name, vector in zip(names, vectors, strict=True):
            node.capture_items.new("VECTOR", name)
            self._group.links.new(vector, node.inputs[name])
        return node.outputs["Geometry"], [node.outputs[name] for name in names]

    def _named(self, name, data_type):
        return self._node("GeometryNodeInputNamedAttribute", {"Name": name}, data_type=data_type).outputs[0]

    def _at_index(self, value, index):
        inputs = {"Value": value, "Index": index}
        return self._node("GeometryNodeFieldAtIndex", inputs, data_type="FLOAT_VECTOR", domain="POINT").outputs[0]

    def _sample(self, surface, value, index):
        inputs = {"Geometry": surface, "Value": value, "Index": index}
        return self._node("GeometryNodeSampleIndex", inputs, data_type="FLOAT_VECTOR", domain="POINT").outputs[0]

    def _on_domain(self, value, data_type, domain):
        return self._node("GeometryNodeFieldOnDomain", {0: value}, data_type=data_type, domain=domain).outputs[0]

    def _switch(self, condition, otherwise, value, kind="VECTOR"):
        inputs = {"Switch": condition, "False": otherwise, "True": value}
        return self._node("GeometryNodeSwitch", inputs, input_type=kind).outputs[0]

    def _vector(self, operation, *vectors, scale=None):
        node = self._node("ShaderNodeVectorMath", dict(enumerate(vectors)), operation=operation)
        if scale is not None:
            self._group.links.new(scale, node.inputs["Scale"])
        return node.outputs["Value" if operation == "DISTANCE" else "Vector"]

    def _math(self, operation, *numbers):
        return self._node("ShaderNodeMath", dict(enumerate(numbers)), operation=operation).outputs[0]

    def _node(self, kind, inputs=None, **settings):
        node = self._group.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for name, value in (inputs or {}).items():
            if isinstance(value, bpy.types.NodeSocket):
                self._group.links.new(value, node.inputs[name])
            else:
                node.inputs[name].default_value = value
        return node
