# SPDX-License-Identifier: GPL-3.0-or-later
"""Painting steps of the random walk: masks that hair follows, selections, images, flow lines."""

import bpy
import numpy as np
from hypothesis import strategies as st

from hair_addon.blender.settings import style_items
from tests.support.invariants import activate, changed, chosen, objects, operate, ours
from tests.support.walk.walk_steps import needs_room, pick, step


class PaintingSteps:
    """Mixed into an artist."""

    @step(number=pick)
    def paint_mask(self, number):
        active = bpy.context.object
        is_painting = active is not None and active.mode.endswith("PAINT")
        if not is_painting and objects("CURVES"):
            activate(chosen(objects("CURVES"), number))
        operate(bpy.ops.vellus.paint_style_mask)

    @step(number=pick, weight=st.sampled_from([0.0, 0.3, 1.0]))
    def stroke(self, number, weight):
        surface = bpy.context.object
        if surface is None or surface.type != "MESH" or surface.mode != "WEIGHT_PAINT":
            return
        group, count = surface.vertex_groups.active, len(surface.data.vertices)
        if group is not None and count:
            group.add(sorted({number % count, number // 3 % count, number // 7 % count}), weight, "REPLACE")
            surface.data.update()
            changed("stroke")

    @step(number=pick, domain=st.sampled_from(["CURVE", "POINT"]), kind=st.sampled_from(["FLOAT", "BOOLEAN"]))
    def mask_from_selection(self, number, domain, kind):
        guides = sorted(ours("GUIDES"), key=lambda c: c.name)
        if not guides or not objects("CURVES"):
            return
        curves = chosen(guides, number)
        if ".selection" in curves.attributes:
            curves.attributes.remove(curves.attributes[".selection"])
        selection = curves.attributes.new(".selection", kind, domain).data
        if len(selection):
            selection.foreach_set("value", (np.arange(len(selection)) + number) % 3 == 0)
        activate(chosen(objects("CURVES"), number))
        operate(bpy.ops.vellus.mask_from_selection)

    @step(number=pick, of=st.sampled_from(["guides", "hair", "style"]), brightness=st.sampled_from([0.0, 0.5, 1.0]))
    def paint_image(self, number, of, brightness):
        image = bpy.data.images.get("Painted") or bpy.data.images.new("Painted", 4, 4)
        image.pixels.foreach_set(np.full(64, brightness, np.float32))
        image.pack()  # else Blender restores it black after undo and redo of its first step
        image.update_tag()
        if ours():
            state = chosen(sorted(ours(), key=lambda c: c.name), number).vellus
            name = "Painted" if number % 3 else ""
            if of != "style":
                getattr(state, of).density_image = name
            elif len(state.styles):
                style_items.group_of(chosen(list(state.styles), number // 3)).mask_image = name
        changed("image")

    @step(number=pick, angle=st.floats(0.0, 6.0), scale=st.sampled_from([0.0, 0.5, 2.0]))
    @needs_room
    def draw_flow(self, number, angle, scale):
        flow = bpy.data.objects.get("Flow")
        if flow is None:
            data = bpy.data.curves.new("Flow", "CURVE")
            data.dimensions = "3D"
            data.splines.new("POLY").points.add(1)
            data.splines[0].points.foreach_set("co", [-1, 0, 1, 1, 1, 0, 1, 1])
            flow = bpy.data.objects.new("Flow", data)
            bpy.context.scene.collection.objects.link(flow)
        flow.rotation_euler.z, flow.scale = angle, (scale, scale, scale)
        if ours("GUIDES"):
            state = chosen(sorted(ours("GUIDES"), key=lambda c: c.name), number).vellus
            state.guides.flow_lines = "Flow" if number % 4 else "Lost"
            state.guides.lift = angle / 4.0
        changed("flow")
