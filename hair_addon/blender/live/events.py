# SPDX-License-Identifier: GPL-3.0-or-later
"""One function for each event, which invalidates the caches that the event makes stale.

After an event nothing is drawn or computed from values that were cached before it.
"""

from ..data.maps import image_pixels
from ..data.pictures import root_colors, surface_means, unread_nodes
from ..gpu import world_texture
from ..groom.guides import guide_states, outside_guides
from ..render import hair_cache, modified_hair
from ..render.viewport import viewport


def scene_changed(is_hair_only=False, is_light_only=False):
    """Anything was changed, hidden or shown: views and panels read scenes again; is_hair_only: only hair changed;
    is_light_only: only lamps changed.
    """
    viewport.invalidate(is_hair_only, is_light_only)
    if not is_hair_only:
        unread_nodes.sentence_cache.clear()


def curves_reported(datablock):
    """Blender reports a Curves datablock, which may have changed: invalidate its strands and their guide states."""
    hair_cache.invalidate_unless_same(datablock)
    modified_hair.invalidate_users(datablock)
    guide_states.state_cache.invalidate(datablock.session_uid)


def looks_written(datablock):
    """Looks of strands by maps were written to hair Curves: cached strands get them."""
    hair_cache.follow_looks(datablock)


def hair_evaluated(hair_object):
    """Blender has evaluated an object of hair for another frame: its modifiers may have changed the strands."""
    modified_hair.invalidate(hair_object)


def strands_computed(datablock):
    """Guides or hair were computed again: invalidate the strands of the datablock."""
    hair_cache.strand_cache.invalidate(datablock.session_uid)
    guide_states.state_cache.invalidate(datablock.session_uid)


def surface_moved(surface_object):
    """A surface may be deformed: invalidate its pose, which places strands and keeps guides outside."""
    outside_guides.barrier_cache.clear()
    hair_cache.invalidate_pose(surface_object)


def image_changed():
    """Pixels of images or a world may have changed: read maps again, and check the world's light.

    Each render checks by itself.
    """
    image_pixels.pixel_cache.clear()
    surface_means.picture_cache.clear()
    world_texture.check_image()
    root_colors.sample_cache.clear()
