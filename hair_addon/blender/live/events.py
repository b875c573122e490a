# SPDX-License-Identifier: GPL-3.0-or-later
"""What each event makes stale: a function for each, of the caches that it concerns.

After an event nothing is drawn or computed from what was cached before it.
"""

from ..gpu import world_texture
from ..groom.guides import guide_states
from ..render import hair_cache
from ..render.viewport import viewport


def scene_changed(is_hair_only=False):
    """Anything was changed, hidden or shown: viewports read their scenes again; is_hair_only: nothing but hair."""
    viewport.invalidate(is_hair_only=is_hair_only)


def curves_reported(datablock):
    """Blender reports a Curves datablock as changed, which it may be: its strands, and what binds them."""
    hair_cache.invalidate_unless_same(datablock)
    guide_states.state_cache.invalidate(datablock.session_uid)


def strands_made(datablock):
    """Guides or hair were computed again: strands of the datablock."""
    hair_cache.strand_cache.invalidate(datablock.session_uid)
    guide_states.state_cache.invalidate(datablock.session_uid)


def surface_moved(surface_object):
    """A surface may have another shape: its pose, and by it where strands are."""
    hair_cache.invalidate_pose(surface_object)


def image_changed():
    """Pixels of images, or a world, may be others: the world's light. Each render looks by itself."""
    world_texture.check_image()
