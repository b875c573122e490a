# SPDX-License-Identifier: GPL-3.0-or-later
"""Style steps of the random walk: operators, settings, keyframes and frames."""

import bpy
from hypothesis import strategies as st

from hair_addon.blender.settings import style_items
from hair_addon.core.files.style_presets import PRESETS
from hair_addon.core.styling.kinds import OFFERS
from tests.support.invariants import activate, changed, chosen, objects, operate, ours
from tests.support.walk.walk_steps import odd_numbers, pick, step


def _hair_with_styles(number):
    styled = sorted((c for c in ours("HAIR") if len(c.vellus.styles)), key=lambda c: c.name)
    return chosen(styled, number) if styled else None


class StyleSteps:
    """Mixed into an artist."""

    @step(number=pick, offer=st.sampled_from([*OFFERS]), is_fitted=st.booleans())
    def add_style(self, number, offer, is_fitted):
        if objects("CURVES"):
            activate(chosen(objects("CURVES"), number))
            operate(bpy.ops.vellus.add_style, style=offer, is_fitted=is_fitted)

    @step(number=pick, preset=st.sampled_from([*PRESETS]), keeps_styles=st.booleans())
    def apply_style_preset(self, number, preset, keeps_styles):
        if objects("CURVES"):
            activate(chosen(objects("CURVES"), number))
            operate(bpy.ops.vellus.apply_style_preset, preset=preset, keeps_styles=keeps_styles)

    @step(number=pick, place=pick, operator=st.sampled_from(["UP", "DOWN", "remove", "duplicate", "points"]))
    def change_list(self, number, place, operator):
        if not objects("CURVES"):
            return
        activate(chosen(objects("CURVES"), number))
        state = bpy.context.object.data.vellus
        state.active_style = place % (len(state.styles) + 1)
        if operator in ("UP", "DOWN"):
            operate(bpy.ops.vellus.move_style, direction=operator)
        elif operator == "points":
            operate(bpy.ops.vellus.use_points)
        else:
            operate(getattr(bpy.ops.vellus, f"{operator}_style"))

    @step(number=pick, value=odd_numbers)
    def change_style(self, number, value):
        hair = _hair_with_styles(number)
        if hair is not None:
            group = style_items.group_of(chosen(list(hair.vellus.styles), number // 7))
            numeric = [e.identifier for e in group.bl_rna.properties if e.type == "FLOAT"]
            setattr(group, chosen(numeric, number // 3), value)
            group.is_on = number % 5 > 0
            changed("style")

    @step(number=pick, frame=st.integers(1, 3))
    def key_style(self, number, frame):
        hair = _hair_with_styles(number)
        if hair is not None and hair.library is None:
            style_items.group_of(chosen(list(hair.vellus.styles), number // 7)).keyframe_insert("amount", frame=frame)
            changed("key")

    @step(frame=st.integers(1, 3))
    def go_to_frame(self, frame):
        bpy.context.scene.frame_set(frame)
        changed("frame")
