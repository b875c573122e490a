# SPDX-License-Identifier: GPL-3.0-or-later
"""Picture menus for looks and style presets, built-in and saved."""

import bpy

from ...core.errors import HairError
from ...core.files import style_presets
from ...core.shading.presets import PRESETS
from ..groom.selection import hair_of
from ..settings import picture_choices, properties, saved_looks, saved_styles, setting_properties
from ..settings.picture_choices import PRESENT
from ..settings.translations import interface_text
from . import look_previews

_ATTRIBUTE = "vellus_pictures"
_OWN = "own "  # prefix of saved names; identifiers of built-in pictures have no spaces


def draw(layout, context, name):
    """Draw a small picture of the present look or style, which opens the picture menu; name: "look" or "style"."""
    group = getattr(context.window_manager, _ATTRIBUTE)
    layout.template_icon_view(group, name, show_labels=True, scale=1.0, scale_popup=5.0)


def _looks():
    built_in = [(name, interface_text(label), look_previews.picture(name)) for name, (label, _look) in PRESETS.items()]
    own = [(_OWN + name, bpy.path.display_name(name), look_previews.swatch(name)) for name in saved_looks.names()]
    look, entries = _own_look(), [*built_in, *own]
    if look is not None and _present_look() == PRESENT:
        entries.append((PRESENT, interface_text("Present Look"), look_previews.present_swatch(look)))
    return entries


def _own_look():
    hair = hair_of(bpy.context.object)
    try:
        return None if hair is None else properties.own_look_of(hair.vellus)
    except HairError:  # already shown as the status of the hair
        return None


def _present_look():
    look = _own_look()
    if look is not None:
        for name, (_label, known) in PRESETS.items():
            if setting_properties.is_stored_as(look, known, skip=("mode",)):  # the mode is not part of a look
                return name
    return PRESENT


def _choose_look(name):
    if name.startswith(_OWN):
        bpy.ops.vellus.apply_saved_look("EXEC_DEFAULT", True, name=name.removeprefix(_OWN))
    else:
        bpy.ops.vellus.apply_preset("EXEC_DEFAULT", True, preset=name)


def _styles():
    built_in = [
        (name, interface_text(label), look_previews.style_picture(name))
        for name, label in style_presets.PRESETS.items()
    ]
    own = [(_OWN + name, bpy.path.display_name(name), _icon("FILE")) for name in saved_styles.names()]
    pictured = [(*entry[:2], _icon("FILE") if entry[2] is None else entry[2]) for entry in built_in]
    return [*pictured, *own, (PRESENT, interface_text("Present Styles"), _icon("IMAGE_DATA"))]


def _icon(name):
    """Number of a Blender icon."""
    return bpy.types.UILayout.bl_rna.functions["prop"].parameters["icon"].enum_items[name].value


def _choose_style(name):
    if name.startswith(_OWN):
        bpy.ops.vellus.apply_saved_style("EXEC_DEFAULT", True, name=name.removeprefix(_OWN))
    else:
        bpy.ops.vellus.apply_style_preset("EXEC_DEFAULT", True, preset=name)


class VellusPictures(bpy.types.PropertyGroup):
    """Menus of pictures"""

    __annotations__ = {
        "look": picture_choices.pictured("Look", "Apply a look to the hair", _looks, _present_look, _choose_look),
        "style": picture_choices.pictured(
            "Style Preset", "Apply a style preset to the hair", _styles, lambda: PRESENT, _choose_style
        ),
    }


CLASSES = (VellusPictures,)


def register():
    """Register the menus on the window manager."""
    picture_choices.attach(_ATTRIBUTE, VellusPictures)


def unregister():
    """Unregister the menus."""
    picture_choices.detach(_ATTRIBUTE)
