# SPDX-License-Identifier: GPL-3.0-or-later
"""Selection and style of outlined hair in a viewport; outlines over other render engines."""

from ...gpu.visibility_buffer import VisibilityBuffer
from .. import scene_drawing
from . import hair_picture, picture_detail
from .outline import HairOutline, OutlineStyle

# Blender does not outline objects in Sculpt Mode or Edit Mode, and strokes must be visible.
_MODES = {"OBJECT", "POSE"}


def has_outlines(context):
    """Whether the context's viewport shows outlines of selected objects."""
    overlay = context.space_data.overlay
    return overlay.show_overlays and overlay.show_outline_selected and context.mode in _MODES


def outlined(context, drawn, is_see_through=False):
    """Return (items of `channels`, style) for `HairOutline.restart` of a `DrawnScene`'s selected hair; None without
    any.

    Hashable. is_see_through: whether lines of occluded hair are as opaque as others.
    """
    if not any(drawn.selected) or not has_outlines(context):
        return None
    active = context.view_layer.objects.active
    active_owner = None if active is None else active.session_uid
    found = zip(drawn.owners, drawn.selected, strict=True)
    channels = tuple((i, int(owner != active_owner)) for i, (owner, selected) in enumerate(found) if selected)
    theme, scale = context.preferences.themes[0].view_3d, context.preferences.system.pixel_size
    width = max(theme.outline_width, 1) * scale
    return channels, OutlineStyle(
        tuple(theme.object_active), tuple(theme.object_selected), width, scale, is_see_through
    )


def may_be_outlined(context):
    """Whether the viewport shows outlines, and hair or an object that may have instances of hair is selected."""
    return has_outlines(context) and any(map(_may_show_hair, context.selected_objects))


def _may_show_hair(selected):
    if selected.type == "CURVES":
        return selected.data.vellus.kind == "HAIR"
    return selected.instance_type != "NONE" or any(modifier.type == "NODES" for modifier in selected.modifiers)


class LoneOutline:
    """The outline of hair in a region of size (width, height) that is rendered by another engine."""

    def __init__(self, size):
        self.size = size
        self._detail = picture_detail.whole(size, hair_picture.samples_per_side())
        self._buffer = VisibilityBuffer(*self._detail.buffer_size)
        self._outline = HairOutline(size)
        self._pass_count = 0

    @property
    def is_fine(self):
        """Whether all passes are drawn."""
        return self._outline.is_fine

    def restart(self, channels, style):
        """Start another outline, or another view of it; arguments as for `HairOutline.restart`."""
        self._outline.restart(channels, style)
        self._pass_count = 0

    def add_pass(self, drawn, world_to_view, view_to_clip):
        """Find the hair of a `DrawnScene` once more; world_to_view, view_to_clip: (4, 4)."""
        view = self._detail.pass_record((world_to_view, view_to_clip), self.size, self._pass_count)
        self._outline.add_pass(drawn, view, self._buffer, self._detail)
        with self._buffer.hiding():
            scene_drawing.draw_hiding(drawn, view)
        scene_drawing.find_hair(drawn, view, self._buffer)
        self._outline.add_seen(self._buffer, self._detail)
        self._pass_count += 1

    def show(self):
        """Draw the outline over the bound viewport."""
        self._outline.show()
