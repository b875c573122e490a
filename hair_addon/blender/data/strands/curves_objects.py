# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of Curves in the scene: creation, and visibility in renders and in Blender's viewports."""

import bpy
import numpy as np
from mathutils import Matrix

from .. import rest_nodes, rest_sources, surface_collections, thin_hair
from . import follow_nodes

_UNMOVED = Matrix()

_RAYS = ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")


def new_object(name, surface_object, is_rendered=True):
    """Return an empty Curves object on a surface, in the surface's collection."""
    curves = bpy.data.hair_curves.new(name)
    curves.surface = surface_object
    return link_object(name, curves, surface_object, is_rendered)


def link_object(name, curves, surface_object, is_rendered=True):
    """Add an object for Curves, a child of their surface, to the collection of the surface and return it.

    is_rendered: whether Cycles and EEVEE show it.
    """
    curves_object = bpy.data.objects.new(name, curves)
    curves_object.parent = surface_object
    render(curves_object, is_rendered)
    if is_rendered:
        thin_hair.show_thin(bpy.context.scene)
    surface_collections.collection_of(surface_object).objects.link(curves_object)
    follow_nodes.add_modifier(curves_object)
    return curves_object


def render(curves_object, is_rendered):
    """Show or hide an object in Cycles and EEVEE by ray visibility: objects disabled in renders are not exported."""
    for ray in _RAYS:
        setattr(curves_object, f"visible_{ray}", is_rendered)


_RAYS_BEFORE = "vellus_rays"  # custom property: the ray visibility of an object before it was hidden


def hide_from_engines(curves_object, is_seen_by_rays):
    """Hide an object from the cameras of Cycles and EEVEE, and from all their rays unless `is_seen_by_rays`."""
    if _RAYS_BEFORE not in curves_object:
        curves_object[_RAYS_BEFORE] = [int(getattr(curves_object, f"visible_{ray}")) for ray in _RAYS]
    for ray, was_seen in zip(_RAYS, curves_object[_RAYS_BEFORE], strict=True):
        is_seen = bool(was_seen) and is_seen_by_rays and ray != "camera"
        if getattr(curves_object, f"visible_{ray}") != is_seen:
            setattr(curves_object, f"visible_{ray}", is_seen)


def show_again(curves_object):
    """Undo `hide_from_engines`."""
    if _RAYS_BEFORE in curves_object:
        for ray, was_seen in zip(_RAYS, curves_object[_RAYS_BEFORE], strict=True):
            setattr(curves_object, f"visible_{ray}", bool(was_seen))
        del curves_object[_RAYS_BEFORE]


def objects_of(curves):
    """Return the objects of a Curves datablock."""
    return [user for user in bpy.data.objects if user.data == curves]


def attach_to_surface(curves_object, surface_object):
    """Make an object a child of its surface without its own transform, so that they share local coordinates."""
    curves_object.parent, curves_object.parent_type = surface_object, "OBJECT"
    curves_object.matrix_parent_inverse.identity()
    curves_object.delta_location, curves_object.delta_scale = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    curves_object.delta_rotation_euler = (0.0, 0.0, 0.0)
    curves_object.delta_rotation_quaternion = (1.0, 0.0, 0.0, 0.0)
    curves_object.matrix_basis.identity()  # last, as Blender removes the delta transforms when it is set


def has_own_transform(curves_object):
    """Whether an object is not a child of its surface, or has its own transform."""
    if curves_object.parent != curves_object.data.surface or curves_object.parent_type != "OBJECT":
        return True
    return curves_object.matrix_parent_inverse != _UNMOVED or curves_object.matrix_basis != _UNMOVED


_APART = 1e-4  # fraction of a surface's size and distance from the origin, which exceeds rounding


def is_elsewhere(curves_object, surface_object):
    """Whether an object's transform visibly differs from that of its surface, at the corners of its bounding box.

    No geometry is read.
    """
    change = np.array(curves_object.matrix_world) - np.array(surface_object.matrix_world)
    corners = np.hstack([np.array(surface_object.bound_box, np.float64), np.ones((8, 1))])
    places = corners @ np.array(surface_object.matrix_world)[:3].T
    reach = np.linalg.norm(np.ptp(places, axis=0)) + abs(places).max() * 1e-2
    return bool(abs(corners @ change[:3].T).max() > _APART * reach)


def store_rest_positions(surface_object):
    """Let Blender store the rest positions of a surface's vertices, in which strands are rooted."""
    is_new = not surface_object.add_rest_position_attribute
    if is_new:
        surface_object.add_rest_position_attribute = True
    if rest_nodes.separate_copies(surface_object) or is_new:
        # Blender reports this as a change of the mesh: update before hair exists that would react to it.
        bpy.context.view_layer.update()
    if rest_sources.keep(surface_object):
        bpy.context.view_layer.update()


# Objects displayed as bounds are drawn in one of five shapes, and not at all if the number of the shape is invalid.
# For selected Curves with any other display type Blender draws the outline of each strand, and uploads all strands.
_BOX, _NO_SHAPE = 0, 4


def draw_natively(curves, is_shown):
    """Let Blender draw Curves in viewports, or hide them there. Renders are not affected."""
    users = {index: user for index, user in enumerate(bpy.data.objects) if user.data == curves}
    display, shape = ("TEXTURED", _BOX) if is_shown else ("BOUNDS", _NO_SHAPE)
    shapes = np.empty(len(bpy.data.objects), np.int32)
    bpy.data.objects.foreach_get("display_bounds_type", shapes)
    changed = [i for i, user in users.items() if (user.display_type, shapes[i]) != (display, shape)]
    if changed:
        shapes[changed] = shape
        # Only foreach_set accepts a number outside the enumeration.
        bpy.data.objects.foreach_set("display_bounds_type", shapes)
    for index in changed:
        users[index].display_type = display  # makes Blender evaluate the shape too
