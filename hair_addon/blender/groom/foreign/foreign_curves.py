# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated curves not created by Vellus, as polylines or Catmull-Rom splines."""

from collections.abc import Iterable
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.types import Curves, Object

from ....core.errors import HairError
from ...data import scene
from ...data.strands import attributes, curves
from ...host.notices import name_of

_NAME = "Vellus Curves to Polylines"  # name of the temporary nodes and modifier

# Settings that make a tube, a ribbon or a face of a legacy curve object, and their neutral values.
_THIN = {"bevel_depth": 0.0, "extrude": 0.0, "bevel_object": None, "dimensions": "3D"}


@dataclass(frozen=True)
class SeenCurves:
    """Evaluated curves: points (N, 3) float32 in local coordinates, starts (C+1,) of each curve, is_smooth (C,) bool:
    whether a curve is a Catmull-Rom spline.
    """

    points: np.ndarray
    starts: np.ndarray
    is_smooth: np.ndarray


def is_foreign(curves_object: Object) -> bool:
    """Whether an object's curves can become guides: a Curves object not created by Vellus, or a curve object."""
    if curves_object is None:
        return False
    return curves_object.type == "CURVE" or (
        curves_object.type == "CURVES" and curves_object.data.vellus.kind == "NONE"
    )


def chosen(active: Object, selected: Iterable[Object]) -> list[Object]:
    """Return the active and selected objects for which `is_foreign` is true, the active one first."""
    return [one for one in dict.fromkeys((active, *selected)) if is_foreign(one)]


def require_foreign(curves_object: Object) -> None:
    """Raise `HairError` for guides and hair, which the operator would convert twice from the redo panel."""
    if not is_foreign(curves_object):
        raise HairError('"{name}" is already guides or hair.', name=name_of(curves_object))


def require_editable(curves_object: Object) -> None:
    """Raise `HairError` unless the object and its curves can be changed without changing other objects."""
    for datablock in (curves_object, curves_object.data):
        curves.require_editable(datablock)
    if sum(user.data == curves_object.data for user in bpy.data.objects) > 1:
        raise HairError(
            '"{name}" shares its curves with another object: make it single-user.', name=name_of(curves_object)
        )
    animation = curves_object.animation_data
    if animation is not None and (animation.action or animation.drivers or animation.nla_tracks):
        raise HairError(
            '"{name}" is animated: clear its animation, as guides move with their surface.', name=name_of(curves_object)
        )


def read(curves_object: Object, applies_modifiers: bool) -> SeenCurves:
    """Return the `SeenCurves` of an object. Raises `HairError`.

    applies_modifiers: evaluated with modifiers as in viewports; else as stored.
    """
    if not _is_evaluated(curves_object, applies_modifiers):
        return _read(curves_object.data)
    with _as_polylines(curves_object, applies_modifiers):
        geometry = _evaluated(curves_object)  # its curves are freed with it
        return _read(geometry.curves)


def take(curves_object: Object, applies_modifiers: bool) -> Curves:
    """Replace an object's own curves by those that `read` returned; returns its Curves.

    Applied modifiers are removed, other modifiers are switched off.
    """
    if _is_evaluated(curves_object, applies_modifiers):
        bevel = curves_object.data.bevel_depth if curves_object.type == "CURVE" else None
        with _as_polylines(curves_object, applies_modifiers):
            if bevel is not None:
                _convert(curves_object)
                _write_radii(curves_object.data, bevel)
            else:
                geometry = _evaluated(curves_object)
                _replace_data(curves_object, geometry.curves.copy())
    for modifier in list(curves_object.modifiers):
        if applies_modifiers and modifier.show_viewport:
            curves_object.modifiers.remove(modifier)
        else:
            modifier.show_viewport = modifier.show_render = False
    return curves_object.data


def _is_evaluated(curves_object, applies_modifiers):
    """Whether evaluated curves may differ from stored ones."""
    if curves_object.type == "CURVE" or attributes.curve_types(curves_object.data).max(initial=0) > attributes.POLY:
        return True
    return applies_modifiers and any(modifier.show_viewport for modifier in curves_object.modifiers)


def _read(datablock):
    starts = curves.curve_offsets(datablock)
    return SeenCurves(curves.read_points(datablock), starts, attributes.are_smooth(datablock))


def _evaluated(curves_object):
    """Return the evaluated `GeometrySet` of an object, with curves. Raises `HairError`."""
    geometry = curves_object.evaluated_get(scene.present_depsgraph()).evaluated_geometry()
    if geometry.curves is None and curves_object.type == "CURVE" and not curves_object.data.splines:
        raise HairError('"{name}" has no curves yet: draw some with the Add brush.', name=name_of(curves_object))
    if geometry.curves is None:
        sentence = '"{name}" has no curves after its modifiers: turn off the modifiers that convert them.'
        raise HairError(sentence, name=name_of(curves_object))
    return geometry


@contextmanager
def _as_polylines(curves_object, applies_modifiers):
    """Context: Blender evaluates an object to polylines and Catmull-Rom splines. Everything is restored at its end."""
    layer, data = bpy.context.view_layer, curves_object.data
    if not curves_object.visible_get(view_layer=layer):
        raise HairError('"{name}" is hidden: show it first.', name=name_of(curves_object))
    switched_off = [] if applies_modifiers else [m for m in curves_object.modifiers if m.show_viewport]
    was = {name: getattr(data, name) for name in _THIN} if curves_object.type == "CURVE" else {}
    nodes = modifier = None
    for shown in switched_off:
        shown.show_viewport = False
    for name in was:
        setattr(data, name, _THIN[name])
    if curves_object.type == "CURVE" or attributes.curve_types(data).max(initial=0) > attributes.POLY:
        nodes = _resampling_nodes()
        modifier = curves_object.modifiers.new(_NAME, "NODES")
        modifier.node_group = nodes
    try:
        layer.update()
        yield
    finally:
        if modifier is not None and modifier.name in curves_object.modifiers:
            curves_object.modifiers.remove(modifier)
        if nodes is not None:
            bpy.data.node_groups.remove(nodes)
        if curves_object.data == data:
            for name, value in was.items():
                setattr(data, name, value)
        for shown in switched_off:
            shown.show_viewport = True
        layer.update()


def _resampling_nodes():
    """Create nodes that convert curves to polylines with the resolution at which Blender draws them."""
    nodes = bpy.data.node_groups.new(_NAME, "GeometryNodeTree")
    nodes.is_modifier = True
    for direction in ("INPUT", "OUTPUT"):
        nodes.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    given, made = nodes.nodes.new("NodeGroupInput"), nodes.nodes.new("NodeGroupOutput")
    resample = nodes.nodes.new("GeometryNodeResampleCurve")
    resample.inputs["Mode"].default_value = "Evaluated"
    nodes.links.new(given.outputs[0], resample.inputs["Curve"])
    nodes.links.new(resample.outputs["Curve"], made.inputs[0])
    return nodes


def _convert(curves_object):
    """Convert a curve object to a Curves object, in place."""
    layer = bpy.context.view_layer
    with bpy.context.temp_override(
        active_object=curves_object,
        object=curves_object,
        selected_objects=[curves_object],
        selected_editable_objects=[curves_object],
    ):
        bpy.ops.object.convert(target="CURVES")
    layer.update()
    if curves_object.type != "CURVES":
        raise HairError('"{name}" cannot be converted to a Curves object.', name=name_of(curves_object))


def _write_radii(datablock, bevel):
    """Convert factors of a curve object's bevel to radii; remove them if there is no bevel."""
    radii = attributes.read(datablock, "radius", "FLOAT", "POINT")
    if radii is None:
        return
    if bevel > 0.0:
        attributes.write(datablock, "radius", "FLOAT", "POINT", radii * np.float32(bevel))
    else:
        datablock.attributes.remove(datablock.attributes["radius"])


def _replace_data(curves_object, replacement):
    """Replace an object's Curves, keep their name and remove the old datablock."""
    before, name = curves_object.data, curves_object.data.name
    before.user_remap(replacement)
    bpy.data.hair_curves.remove(before)
    replacement.name = name
