# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice among pictures: an enumeration with icons that is not stored."""

import bpy

from .translations import CONTEXT

PRESENT = "PRESENT"  # identifier of the item for a present value that is none of the others


def pictured(name, description, entries, present, choose):
    """Return an enumeration property; entries(): [(identifier, label, icon)]; present(): the present identifier, or
    `PRESENT`; choose(identifier): called when a picture is clicked.
    """
    texts = {}  # Blender keeps pointers to the strings of dynamic items: keep them alive

    def kept(text):
        return texts.setdefault(text, text)

    def items(_group, _context):
        return [
            (kept(identifier), kept(label), "", icon, number)
            for number, (identifier, label, icon) in enumerate(entries())
        ]

    def read(_group):
        identifiers = [entry[0] for entry in entries()]
        found = present()
        return identifiers.index(found) if found in identifiers else -1

    def write(_group, number):
        identifier = entries()[number][0]
        if identifier not in (PRESENT, present()):
            choose(identifier)

    return bpy.props.EnumProperty(
        name=name, description=description, items=items, get=read, set=write, translation_context=CONTEXT
    )


def attach(name, group_class):
    """Give the window manager a group of such properties."""
    setattr(bpy.types.WindowManager, name, bpy.props.PointerProperty(type=group_class))


def detach(name):
    """Remove the group."""
    delattr(bpy.types.WindowManager, name)
