# SPDX-License-Identifier: GPL-3.0-or-later
"""What operators of styles share."""

from ....groom.selection import hair_of
from ....settings import properties, style_items


def active_style_of(context):
    """The properties of the active hair's active style, None where there is none."""
    hair = hair_of(context.object)
    return None if hair is None else style_items.active_of(hair.vellus)


def has_styles(operator, context):
    """Whether the active hair has an active style; a `poll`, with its message."""
    operator.poll_message_set("Select hair with styles.")
    return active_style_of(context) is not None


def fit_switch():
    """The property of operators whose lengths may follow the surface."""
    description = "Multiply lengths, which are for a human head, by the size of the surface"
    return properties.switch("Fit to Surface", description, True)


def keep_switch():
    """The property of operators that may add styles in place of replacing them."""
    description = "Add the styles of the preset after the present ones, in place of replacing them"
    return properties.switch("Keep Styles", description, False)
