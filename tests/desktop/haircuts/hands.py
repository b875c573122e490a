# SPDX-License-Identifier: GPL-3.0-or-later
"""The hands of an artist in Blender's window: buttons, fields, views, and strokes of the mouse, which are counted.

A button or an entry of a menu calls its operator as a click does, with the mouse in the 3D view; a field is set as if
its value were typed. Strokes and lines are events of the mouse. Places are in the scene [m]; a stroke passes over them
in the view that was chosen before.
"""

import time
from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Vector

from tests.desktop import window

ACTION_SECONDS = 2.0  # estimated time of an artist for one click, field, view or stroke
STRANDS = 40_000  # of a picture; the window shows fewer
_EVENTS_PER_METER = 80.0
_COMB = "brushes/essentials_brushes-curve_sculpt.blend/Brush/"


@dataclass
class Count:
    """The number of actions, and the processor time of Blender [s]."""

    clicks: int = 0
    fields: int = 0
    views: int = 0
    strokes: int = 0
    seconds: float = field(default_factory=time.process_time)

    def facts(self):
        """Return the numbers, with the estimate of an artist's time [s]."""
        actions = self.clicks + self.fields + self.views + self.strokes
        return {
            "clicks": self.clicks,
            "fields": self.fields,
            "views": self.views,
            "strokes": self.strokes,
            "artist's seconds": ACTION_SECONDS * actions,
            "processor's seconds": round(time.process_time() - self.seconds, 1),
        }


count = Count()


def begin():
    """Start to count."""
    count.__init__()


# What the panels show: values of fields are set by a path that begins with one of these.


def guides():
    return bpy.data.objects.get("Hair Guides")


def hair():
    return bpy.data.objects.get("Hair")


def _owners():
    if hair() is None:
        return {}
    own = {"hair": hair().data.vellus.hair, "look": hair().data.vellus.appearance}
    own |= {item.name: getattr(item, item.kind.lower()) for item in hair().data.vellus.styles}
    maps = {item.setting: item for item in hair().data.vellus.maps}
    return own | maps | {"guides": guides().data.vellus.guides, "guide panel": guides().data.vellus}


def select(name):
    """Click an object."""

    def act():
        count.clicks += 1
        window.activate(bpy.data.objects[name])
        yield from window.wait(0.1)

    return act


def press(name, **values):
    """Press a button of a panel, or choose an entry of a menu; each value is a field of the redo panel or dialog."""

    def act():
        count.clicks += 1
        count.fields += len(values)
        group, operator = name.split(".")
        with window.in_viewport():
            getattr(getattr(bpy.ops, group), operator)("EXEC_DEFAULT" if values else "INVOKE_DEFAULT", True, **values)
        yield from settled()

    return act


def fields(owner, **values):
    """Type values into fields of a panel: of "guides", "hair", "look", or of a style by its name."""

    def act():
        for name, value in values.items():
            count.fields += 1
            setattr(_owners()[owner], name, value)
        yield from settled()

    return act


def view(x, y, z, distance=0.62, middle=(0.0, -0.03, 0.72)):
    """Turn the view, so that it is seen from a direction."""

    def act():
        count.views += 1
        area, _region = window.viewport()
        seen = area.spaces.active.region_3d
        seen.view_location, seen.view_distance, seen.view_perspective = middle, distance, "PERSP"
        seen.view_rotation = Vector((x, y, z)).to_track_quat("Z", "Y")
        yield from window.wait(0.3)

    return act


def rename(title):
    """Double-click the name of the hair system in the list of the Hair Systems panel, and type another name."""

    def act():
        count.fields += 1
        hair().vellus_system.title = title
        yield from settled()

    return act


def style(preset):
    """Choose a style preset with as many strands as the picture has: presets fit locks to the spacing of strands."""

    def act():
        shown, hair().data.vellus.hair.strand_count = hair().data.vellus.hair.strand_count, STRANDS
        yield from settled()
        yield from press("vellus.apply_style_preset", preset=preset)()
        hair().data.vellus.hair.strand_count = shown
        yield from settled()

    return act


def lines(button, *strokes, **tool):
    """Press a button that begins to draw lines on the surface, draw them with the mouse, and press it again.

    tool: settings of Blender's Draw tool that are changed before.
    """

    def act():
        yield from press(button)()
        for name, value in tool.items():
            count.fields += 1
            setattr(bpy.context.tool_settings.curve_paint_settings, name, value)
        for places in strokes:
            yield from _stroke(places)
        yield from press(button)()

    return act


def curve(name, *strokes, depth="SURFACE", is_mirrored=False):
    """Add a curve, and draw with Blender's Draw tool on the surface, or in the plane of the view through the 3D cursor.

    is_mirrored: duplicate the strokes, and mirror the copies along X.
    """

    def act():
        count.clicks += 3  # Add > Curve, the tool, and Object Mode again
        with window.in_viewport():
            bpy.ops.object.select_all(action="DESELECT")
            bpy.ops.curve.primitive_bezier_curve_add()
            bpy.context.object.name = name
            bpy.ops.object.mode_set(mode="EDIT")
            bpy.ops.curve.select_all(action="SELECT")
            bpy.ops.curve.delete(type="VERT")
            bpy.ops.wm.tool_set_by_id(name="builtin.draw", space_type="VIEW_3D")
        paint = bpy.context.tool_settings.curve_paint_settings
        paint.curve_type, paint.depth_mode, paint.use_project_only_selected = "POLY", depth, False
        yield from window.wait(0.2)
        for places in strokes:
            yield from _stroke(places)
        if is_mirrored:
            yield from press("curve.select_all", action="SELECT")()
            yield from press("curve.duplicate")()
            axis = (True, False, False)
            yield from press("transform.mirror", constraint_axis=axis, center_override=(0.0, 0.0, 0.0))()
        with window.in_viewport():
            bpy.ops.object.mode_set(mode="OBJECT")
        yield from window.wait(0.1)

    return act


def cursor(x, y, z):
    """Place the 3D cursor by a click with Shift and the right mouse button."""

    def act():
        count.clicks += 1
        place = dict(zip("xy", window.places(np.array([[x, y, z]]))[0].astype(int).tolist(), strict=True))
        event = window.window().event_simulate
        event(type="MOUSEMOVE", value="NOTHING", **place)
        yield
        for value in ("PRESS", "RELEASE"):
            event(type="RIGHTMOUSE", value=value, shift=True, **place)
            yield
        yield from window.wait(0.2)

    return act


def vary(setting, **values):
    """Press the small button beside a setting, and type into the fields of its map."""

    def act():
        yield from press("vellus.edit_map", setting=setting)()
        count.fields -= 1  # the button knows its setting
        yield from fields(setting, **values)()

    return act


def comb(brush, size, *strokes, strength=1.0):
    """Press Comb Guides, pick a brush of a size [m], draw strokes, and stop combing."""

    def act():
        if bpy.context.mode != "SCULPT_CURVES":
            yield from press("vellus.comb_guides")()
        count.clicks += 1
        count.fields += 2
        with window.in_viewport():
            bpy.ops.brush.asset_activate(asset_library_type="ESSENTIALS", relative_asset_identifier=f"{_COMB}{brush}")
        paint = bpy.context.tool_settings.curves_sculpt
        paint.unified_paint_settings.size = paint.brush.size = max(2, int(2.0 * _pixels(size)))
        paint.unified_paint_settings.strength = paint.brush.strength = strength
        for places in strokes:
            yield from _stroke(places)
        yield from settled()

    return act


def weights(weight, size, *strokes):
    """Paint weights in Weight Paint mode, with a brush of a size [m]."""

    def act():
        count.fields += 2
        paint = bpy.context.tool_settings.weight_paint
        paint.unified_paint_settings.weight = paint.brush.weight = weight
        paint.unified_paint_settings.size = paint.brush.size = max(2, int(2.0 * _pixels(size)))
        for places in strokes:
            yield from _stroke(places, 0.5 * _EVENTS_PER_METER)  # Blender fills the gaps of a stroke
        yield from settled()

    return act


def mirrored(is_mirrored=True):
    """Switch X of the mirror in the header of Weight Paint mode."""

    def act():
        count.clicks += 1
        bpy.context.object.use_mesh_mirror_x = is_mirrored
        yield

    return act


def remeshed(voxel):
    """Close the holes of the head, because Voxel Remesh makes two walls of a mesh with holes, and remesh it.

    voxel: size of its faces [m].
    """

    def act():
        head = bpy.data.objects["Head"].data
        head.remesh_voxel_size, head.use_remesh_preserve_attributes = voxel, True
        count.fields += 2
        yield from select("Head")()
        yield from press("object.mode_set", mode="EDIT")()
        yield from press("mesh.select_all", action="SELECT")()
        yield from press("mesh.fill_holes", sides=0)()
        yield from press("object.mode_set", mode="OBJECT")()
        yield from press("object.voxel_remesh")()
        yield from window.wait(1.0)

    return act


def settled():
    """Yield to Blender until hair and guides have followed."""
    yield from window.wait(0.3)


def _pixels(size):
    """Return pixels of a length [m] in the middle of the view."""
    area, _region = window.viewport()
    seen = area.spaces.active.region_3d
    across = seen.view_rotation @ Vector((1.0, 0.0, 0.0))
    middle = np.array(seen.view_location)
    ends = window.places(np.array([middle, middle + size * np.array(across)]))
    return float(np.linalg.norm(ends[1] - ends[0]))


def _stroke(places, events_per_meter=_EVENTS_PER_METER):
    """Press the left mouse button at the first of places [m], pass the others, and release it at the last."""
    count.strokes += 1
    places = np.asarray(places, float)
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    steps = max(6, int(events_per_meter * along[-1]))
    fine = np.stack([np.interp(np.linspace(0.0, along[-1], steps + 1), along, axis) for axis in places.T], axis=1)
    pixels = window.places(fine).astype(int)
    event = window.window().event_simulate
    for number, (x, y) in enumerate(pixels.tolist()):
        event(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
        yield
        if number == 0:
            event(type="LEFTMOUSE", value="PRESS", x=x, y=y)
            yield
    event(type="LEFTMOUSE", value="RELEASE", x=x, y=y)
    yield from window.wait(0.1)
