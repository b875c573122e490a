# SPDX-License-Identifier: GPL-3.0-or-later
"""Base of all panels in the Hair tab: location, and text that fits the sidebar."""

import textwrap

from ...data.pictures import picture_jobs
from ...host.notices import text_of
from ...settings.translations import CONTEXT, interface_text, status_text
from ..operators.systems import is_combing

_CHARACTER_WIDTH = 6.8  # pixels of Blender's interface font on average, at a scale of one
_ICON_AND_MARGINS = 66.0
_NARROWEST = 18  # characters
_LONGEST = 1500  # characters, more than any message has; damaged files may contain longer text

LONG, LARGE = 2.0, 500e6  # [s], [bytes]: smaller estimates are not shown


class HairTab:
    """Mixed into every panel of the tab."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Hair"
    bl_translation_context = CONTEXT


def split(layout):
    """Put labels of a layout in a separate column; return the layout."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    return layout


def write(layout, context, text, icon="NONE"):
    """Draw a translated sentence, wrapped to the width of the sidebar."""
    room = context.region.width / context.preferences.system.ui_scale - _ICON_AND_MARGINS
    text = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
    lines = textwrap.wrap(text, max(int(room / _CHARACTER_WIDTH), _NARROWEST)) or [""]
    column = layout.column(align=True)
    column.scale_y = 0.8 if len(lines) > 1 else 1.0
    below = "NONE" if icon == "NONE" else "BLANK1"
    for place, line in enumerate(lines):
        column.label(text=line, icon=icon if place == 0 else below, translate=False)


def write_status(layout, context, state, name="status"):
    """Draw the error of guides or hair, if there is one; state: `VellusCurves`; name: of the error's property."""
    status = text_of(state, name)
    if status:
        write(layout, context, status_text(status), "ERROR")


def write_missing_pictures(layout, context):
    """Draw notes about worlds, lights and surfaces that Cycles is rendering or cannot render, and a button to retry."""
    for sentence, is_error in picture_jobs.sentences():
        write(layout, context, sentence, "ERROR" if is_error else "INFO")
    if picture_jobs.has_failed():
        layout.operator("vellus.retry_baking", icon="FILE_REFRESH")


def write_stale(layout, context, state):
    """Draw a note and a button if guides or hair are out of date and Auto Update is off."""
    if state.is_stale and not state.is_live:
        write(layout, context, interface_text("Out of date: settings or inputs have changed."), "INFO")
        layout.operator("vellus.update_hair", icon="FILE_REFRESH")


def draw_combing(layout, context):
    """Draw the button that starts or stops combing."""
    text, icon = ("Stop Combing", "CHECKMARK") if is_combing(context) else ("Comb Guides", "SCULPTMODE_HLT")
    layout.operator("vellus.comb_guides", text=text, icon=icon)


def megabytes(count):
    """Format bytes for display."""
    return f"{count / 1e6:.0f} MB" if count >= 1e7 else f"{count / 1e6:.1f} MB"


def draw_work(layout, seconds, byte_count):
    """Draw the time and memory estimate of long work."""
    if seconds >= LONG or byte_count >= LARGE:
        text = interface_text(
            "Takes about {seconds} s, {memory}", seconds=_rounded(seconds), memory=megabytes(byte_count)
        )
        layout.label(text=text, icon="SORTTIME", translate=False)


def _rounded(seconds):
    """Round to one digit, the accuracy of estimates."""
    return f"{float(f'{seconds:.0e}'):g}"
