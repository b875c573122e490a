# SPDX-License-Identifier: GPL-3.0-or-later
"""What commands of Blender change around hair: other scenes that show it, new names, copies, other files."""

from ..data import thin_hair
from ..groom import copied_hair, followed_names
from ..settings import animated


def follow(blender_scenes):
    """Bring up to date what hair names and follows, and how some scenes draw it."""
    thin_hair.follow(blender_scenes)
    followed_names.follow()
    copied_hair.follow()


def take_as_it_is():
    """Take what a file, an import or an undo brought for what strands were made with."""
    followed_names.follow()
    animated.remember(is_made_with=True)
    copied_hair.remember()
