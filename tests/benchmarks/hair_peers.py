# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair between the same guides by Vellus and by Blender's own nodes, for comparing times.

Each way is a `Way`: `remake` grows other strands (another seed), `edit` moves every guide a little; both end with
Blender's own update, after which renderers and other modifiers can read the hair. Peers' guides carry what their nodes
need and nothing else, and each way has guides of its own, so that one's edit is no work for another.
"""

from dataclasses import dataclass, replace

import bpy

from hair_addon.blender.data.strands import curves
from hair_addon.blender.groom import pipeline, writing
from hair_addon.blender.live import invalidation, live_hair
from hair_addon.core.grooming import groom
from tests.support.meshes import HEAD

GUIDE_COUNT = 4000
NODE_ASSETS = "/procedural_hair_node_assets.blend"

# Of the asset's inputs, as geometry nodes call them.
_DENSITY, _SEED = "Input_15", "Input_16"


def head_with_guides():
    """Return (mesh object, guide Curves object) of the sample head in an empty file; the add-on is registered."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath=str(HEAD))
    head = bpy.context.selected_objects[0]
    bpy.context.view_layer.objects.active = head
    bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
    bpy.ops.vellus.distribute_guides(guide_count=GUIDE_COUNT)
    guides = bpy.data.objects["Guides"]
    bpy.context.view_layer.update()
    return head, guides


@dataclass
class Way:
    """A method of making hair: its object, and the object of the guides that `edit` moves."""

    guides: bpy.types.Object
    hair: bpy.types.Object
    step: int = 0

    def edit(self):
        """Move every guide a little, as a slider or a large brush does, and bring the hair up to date."""
        move(self.guides, slice(None))

    def edit_one(self):
        """Move a single guide."""
        move(self.guides, slice(0, 1))

    @property
    def strand_count(self):
        """Return the number of strands of the evaluated hair."""
        return len(self._evaluated().curves)

    @property
    def is_poly(self):
        """Whether the evaluated hair consists of poly lines; Catmull-Rom curves have no type attribute."""
        kind = self._evaluated().attributes.get("curve_type")
        return kind is not None and {item.value for item in kind.data} == {1}

    def _evaluated(self):
        return self.hair.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def move(guides, chosen):
    """Move some guides by a tenth of a millimeter, and let Blender update."""
    points = curves.read_points(guides.data).reshape(GUIDE_COUNT, -1, 3)
    points[chosen, 1:, 2] += 1e-4
    guides.data.attributes["position"].data.foreach_set("vector", points.ravel())
    guides.data.update_tag()
    bpy.context.view_layer.update()


class Ours(Way):
    """The registered add-on with its operators, sliders and handlers, without a window."""

    @classmethod
    def grown(cls, guides, strand_count):
        """Return hair that is generated between guides for the first time."""
        way = cls(guides, None)
        way.settings = groom.HairSettings(strand_count=strand_count)
        way.grow()
        return way

    def grow(self):
        """Generate hair where there is none."""
        self.hair = None
        self._interpolate(None)

    def remake(self):
        """Search, compute weights, interpolate, write the Curves, and wait for Blender's update."""
        self.step += 1
        self.settings = replace(self.settings, seed=self.step)
        self._interpolate(self.hair.data)

    def edit(self):
        """Move the guides, so that the handler writes the hair and Blender evaluates it."""
        super().edit()
        bpy.context.view_layer.update()

    def edit_one(self):
        super().edit_one()
        bpy.context.view_layer.update()

    def write(self):
        """Write existing points without computing strands, and let Blender evaluate them."""
        writing.write_hair(self.hair.data)
        bpy.context.view_layer.update()

    def drop(self):
        """Delete the hair and keep the guides."""
        bpy.data.hair_curves.remove(self.hair.data)
        live_hair.cancel_writing()
        invalidation.data_replaced()
        bpy.context.view_layer.update()

    def _interpolate(self, target):
        depsgraph = bpy.context.evaluated_depsgraph_get()
        made = pipeline.interpolate_hair(self.guides.data, self.settings, depsgraph, target)
        bpy.context.view_layer.update()
        if self.hair is None:
            self.hair = next(o for o in bpy.data.objects if o.data == made)


class Asset(Way):
    """Blender's "Interpolate Hair Curves" with Catmull-Rom curves, or with poly lines by another node."""

    @classmethod
    def grown(cls, guides, head, strand_count, is_poly):
        made = _bare_copy(guides, head, "Asset")
        way = cls(made, made)
        modifier = made.modifiers.new("Interpolate Hair Curves", "NODES")
        modifier.node_group = _asset()
        way.inputs = modifier.properties.inputs
        getattr(way.inputs, _DENSITY).value = strand_count / area(head)
        if is_poly:
            made.modifiers.new("Poly Lines", "NODES").node_group = _poly_lines()
        bpy.context.view_layer.update()
        assert [w.message for w in modifier.node_warnings] == []
        return way

    def remake(self):
        getattr(self.inputs, _SEED).value += 1
        self.hair.update_tag()
        bpy.context.view_layer.update()

    @property
    def modifier_time(self):
        """Return the time of the modifier in the last update [s]."""
        return self.hair.evaluated_get(bpy.context.evaluated_depsgraph_get()).modifiers[0].execution_time


class LeanGraph(Way):
    """The smallest graph of Blender's nodes that grows strands between guides as poly lines."""

    @classmethod
    def grown(cls, guides, head, strand_count):
        made = _bare_copy(guides, head, "Lean graph")
        way = cls(made, made)
        group, way.points = _lean_graph(head, strand_count / area(head))
        made.modifiers.new("Lean graph", "NODES").node_group = group
        bpy.context.view_layer.update()
        return way

    def remake(self):
        self.points.inputs["Seed"].default_value += 1
        bpy.context.view_layer.update()


def area(surface_object):
    """Return the area [m²] of a mesh object whose transform is applied."""
    return sum(polygon.area for polygon in surface_object.data.polygons)


def _bare_copy(guides, head, name):
    """Return guides like those of Blender's tools: with positions and UV coordinates, on their surface."""
    data = guides.data.copy()
    data.vellus.kind = "NONE"
    for attribute in [a.name for a in data.attributes]:
        if attribute not in {"position", "surface_uv_coordinate", "curve_type"}:
            data.attributes.remove(data.attributes[attribute])
    made = bpy.data.objects.new(name, data)
    made.parent = head
    bpy.context.scene.collection.objects.link(made)
    return made


def _asset():
    name = "Interpolate Hair Curves"
    if name not in bpy.data.node_groups:
        folder = bpy.utils.system_resource("DATAFILES", path="assets/nodes")
        with bpy.data.libraries.load(folder + NODE_ASSETS, link=False) as (_there, here):
            here.node_groups = [name]
    return bpy.data.node_groups[name]


def _lean_graph(head, density):
    """Return (node group, node that distributes points)."""
    group = _group("Lean Graph")
    names = {
        "into": "NodeGroupInput",
        "surface": "GeometryNodeObjectInfo",
        "points": "GeometryNodeDistributePointsOnFaces",
        "strands": "GeometryNodeInterpolateCurves",
        "poly": "GeometryNodeCurveSplineType",
        "out": "NodeGroupOutput",
    }
    nodes = {name: group.nodes.new(kind) for name, kind in names.items()}
    nodes["surface"].inputs["Object"].default_value = head
    nodes["points"].inputs["Density"].default_value = density
    nodes["poly"].spline_type = "POLY"
    for source, output, target, into in (
        ("surface", "Geometry", "points", "Mesh"),
        ("into", 0, "strands", "Guide Curves"),
        ("points", "Points", "strands", "Points"),
        ("strands", "Curves", "poly", "Curve"),
        ("poly", "Curve", "out", 0),
    ):
        group.links.new(nodes[source].outputs[output], nodes[target].inputs[into])
    return group, nodes["points"]


def _poly_lines():
    """Return a node group that converts curves to poly lines."""
    group = _group("Poly Lines")
    into, poly, out = (
        group.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeCurveSplineType", "NodeGroupOutput")
    )
    poly.spline_type = "POLY"
    group.links.new(into.outputs[0], poly.inputs["Curve"])
    group.links.new(poly.outputs["Curve"], out.inputs[0])
    return group


def _group(name):
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    group.is_modifier = True
    for in_out in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    return group
