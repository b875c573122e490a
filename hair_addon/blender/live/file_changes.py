# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes around hair by commands of Blender: scenes that show it, new names, copies, other files."""

from ..data import thin_hair
from ..groom import followed_names
from ..groom.systems import copied_hair
from ..settings import animated


def follow(blender_scenes):
    """Update names and references of hair, and how some scenes draw it. Returns Curves that were copied."""
    thin_hair.follow(blender_scenes)
    followed_names.follow()
    return copied_hair.follow()


def accept_state():
    """Take the state after loading, an import or an undo as the state that strands were made with."""
    followed_names.follow()
    animated.remember(is_made_with=True)
    copied_hair.remember()
