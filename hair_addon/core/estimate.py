# SPDX-License-Identifier: GPL-3.0-or-later
"""What guides and hair cost, by counts alone: said before the work, and how long work is told from short.

Times are those of one plain core, measured; other computers take half to twice as long.
"""

from .groom import POINT_COUNT

# Bytes of Blender's Curves. A point: position and rest position (12 each), radius (4). A curve: offset (4), type (1),
# UV (8), normal (12), guide, id, random number (4 each); the
# root: triangle (4), its corners and barycentric coordinates (12 each).
_POINT_BYTES, _CURVE_BYTES = 28, 65
_SLOT_BYTES = 8  # which guide, and its weight
_TEXEL_BYTES = 16  # RGBA, single precision

_ROUND_SECONDS = 1e-5  # one guide, one round of relaxation
_GUIDE_SECONDS = 5e-5
_STRAND_SECONDS = 4e-6
_TEXEL_SECONDS = 1.5e-6  # of all of the Marschner tables together


def curves_bytes(strand_count, point_count=POINT_COUNT, slot_count=0):
    """Memory of strands as a Curves datablock [bytes]; slot_count: guides of each strand that are stored with it."""
    return strand_count * (point_count * _POINT_BYTES + _CURVE_BYTES + slot_count * _SLOT_BYTES)


def gpu_bytes(strand_count, point_count=POINT_COUNT):
    """Memory of strands on the GPU [bytes], but for the end of the texture's last row."""
    return strand_count * point_count * _TEXEL_BYTES


def guide_seconds(settings):
    """How long distributing guides takes [s]; settings: `GuideSettings`."""
    return settings.guide_count * (settings.relax_iterations * _ROUND_SECONDS + _GUIDE_SECONDS)


def hair_seconds(settings):
    """How long growing strands between guides takes [s]; settings: `HairSettings`."""
    return settings.strand_count * _STRAND_SECONDS


def table_seconds(settings):
    """How long baking the Marschner tables takes [s]; settings: `lookup_tables.Settings`."""
    return settings.size**2 * _TEXEL_SECONDS
