# SPDX-License-Identifier: GPL-3.0-or-later
"""What all panels of the Hair tab share: their place, rows of settings, and text that fits the sidebar."""

import textwrap

from ...core.params import declared
from .. import running
from ..translations import CONTEXT, interface_text

_CHARACTER_WIDTH = 6.8  # pixels of Blender's interface font on average, at a scale of one
_ICON_AND_MARGINS = 66.0
_NARROWEST = 18  # characters

LONG, LARGE = 2.0, 500e6  # [s], [bytes]: work that takes less is not spoken of


class HairTab:
    """Mixed into every panel of the tab."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Hair"
    bl_translation_context = CONTEXT


def split(layout):
    """The layout with names in a column of their own."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    return layout


def rows(layout, group, settings_class, names):
    """A row for each of these settings of a class, in the order of declaration."""
    for name, _default, _details in declared(settings_class):
        if name in names:
            layout.prop(group, name)


def others(settings_class, *shown):
    """Names of the settings of a class that are in none of some tuples: a new one is never without its row."""
    names = {name for names in shown for name in names}
    return tuple(name for name, _default, _details in declared(settings_class) if name not in names)


def write(layout, context, text, icon="NONE"):
    """A sentence, translated already, over as many lines as the sidebar's width asks for."""
    room = context.region.width / context.preferences.system.ui_scale - _ICON_AND_MARGINS
    lines = textwrap.wrap(text, max(int(room / _CHARACTER_WIDTH), _NARROWEST)) or [""]
    column = layout.column(align=True)
    column.scale_y = 0.8 if len(lines) > 1 else 1.0
    for place, line in enumerate(lines):
        column.label(text=line, icon=icon if place == 0 else "BLANK1", translate=False)


def megabytes(count):
    """Bytes as an artist reads them."""
    return f"{count / 1e6:.0f} MB" if count >= 1e7 else f"{count / 1e6:.1f} MB"


def draw_work(layout, seconds, byte_count):
    """What work will take, where that is much."""
    if seconds >= LONG or byte_count >= LARGE:
        text = interface_text(
            "Takes about {seconds} s, {memory}", seconds=_rounded(seconds), memory=megabytes(byte_count)
        )
        layout.label(text=text, icon="SORTTIME", translate=False)


def _rounded(seconds):
    """To one digit: nobody knows better."""
    return f"{float(f'{seconds:.0e}'):g}"


def draw_progress(layout):
    """The bar of the work that is under way; whether there is any."""
    job = running.job()
    if job is None:
        return False
    step = interface_text("Stopping" if job.is_stopping else job.step)
    layout.progress(text=step, factor=job.part, type="BAR")
    layout.label(text="Esc stops it and changes nothing")
    return True
