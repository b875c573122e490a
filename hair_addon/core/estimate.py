# SPDX-License-Identifier: GPL-3.0-or-later
"""What guides and hair cost, by counts alone: said before the work, and how long work is told from short.

Times are those of one plain core, measured; other computers take half to twice as long.
"""

from .groom import POINT_COUNT

# Bytes of Blender's Curves. A point: position (12), radius (4). A curve: offset (4), type (1), UV (8), normal (12),
# guide, id, random number (4 each); the root: triangle (4), its corners and barycentric coordinates (12 each).
_POINT_BYTES, _CURVE_BYTES = 16, 65
_TEXEL_BYTES = 16  # RGBA, single precision

_ROUND_SECONDS = 1e-5  # one guide, one round of relaxation
_GUIDE_SECONDS = 5e-5
_STRAND_SECONDS = 2e-6


def curves_bytes(strand_count, point_count=POINT_COUNT):
    """Memory of strands as a Curves datablock [bytes]."""
    return strand_count * (point_count * _POINT_BYTES + _CURVE_BYTES)


def gpu_bytes(strand_count, point_count=POINT_COUNT):
    """Memory of strands on the GPU [bytes], but for the end of the texture's last row."""
    return strand_count * point_count * _TEXEL_BYTES


def guide_seconds(settings):
    """How long distributing guides takes [s]; settings: `GuideSettings`."""
    return settings.guide_count * (settings.relax_iterations * _ROUND_SECONDS + _GUIDE_SECONDS)


def hair_seconds(settings):
    """How long growing strands between guides takes [s]; settings: `HairSettings`."""
    return settings.strand_count * _STRAND_SECONDS
