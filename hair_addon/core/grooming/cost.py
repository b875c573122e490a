# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimates of the time and memory of guides and hair, from counts.

Times were measured on two ordinary cores (tests/benchmarks/test_estimates.py); other computers take half to twice as
long.
"""

from .groom import POINT_COUNT, GuideSettings, HairSettings

# Bytes of Blender's Curves. Per point: position (12), radius (4). Per curve: offset (4), type (1), UV (8), normal (12),
# representative of its guide, ID, random number (4 each); root: triangle (4), corners, barycentric (12 each).
_POINT_BYTES, _CURVE_BYTES = 16, 65
_SLOT_BYTES = 8  # index and weight of a guide
# Bytes on the GPU. Per point; per strand, besides its points: root, range, random number; and visibility of the world
# at every fourth point, in four textures of four bytes each.
_TEXEL_BYTES, _HEAD_BYTES = 8, 12
_SEEN_STEP, _SEEN_BYTES = 4, 16

# Working memory per triangle of the surface, guide and strand.
_FACE_WORK_BYTES, _GUIDE_WORK_BYTES, _STRAND_WORK_BYTES = 760, 3300, 680

# Memory of strands while they are created and stored, measured (tests/blender/groom/test_hair_memory.py). Per point: in
# arrays, Blender's Curves and their evaluated copy; styles; drawing. Per strand: roots and guides.
_MADE_POINT_BYTES, _STYLED_POINT_BYTES, _DRAWN_POINT_BYTES = 36, 12, 12
_MADE_STRAND_BYTES = 380

# Placing guides: per triangle of the surface and per guide, once and in each round.
_FACE_SECONDS, _FACE_ROUND_SECONDS = 5e-6, 2e-7
_GUIDE_SECONDS, _GUIDE_ROUND_SECONDS = 4e-5, 9e-6
_SPREAD_SECONDS = 2e-4  # per guide for all coarser levels
_MOST_ROUNDS = 60  # until convergence

# Growing strands: per triangle, for its normals, and per strand.
_HAIR_FACE_SECONDS, _STRAND_SECONDS = 2.5e-6, 3e-6

# Simulation: per frame, and per vertex and substep, with contact.
_FRAME_SECONDS, _VERTEX_SECONDS = 0.02, 4e-7

# Memory of simulation: per guide, and per vertex.
_SIMULATED_GUIDE_BYTES, _SIMULATED_VERTEX_BYTES = 30_000, 600

# Draping: once, per triangle of the surface, and per guide and substep.
_DRAPE_SECONDS, _DRAPE_FACE_SECONDS, _DRAPE_GUIDE_SECONDS = 0.15, 4e-6, 1e-5
GROWN_SUBSTEPS = 48  # of guides that are draped as they grow

_TEXEL_SECONDS = 1.5e-6  # for all Marschner tables together


def curves_bytes(strand_count: int, point_count: int = POINT_COUNT, slot_count: int = 0) -> int:
    """Return the memory of strands as a Curves datablock [bytes]; slot_count: stored guides of each strand."""
    return strand_count * (point_count * _POINT_BYTES + _CURVE_BYTES + slot_count * _SLOT_BYTES)


def strand_bytes(strand_count: int, point_count: int = POINT_COUNT, slot_count: int = 0) -> int:
    """Return the peak memory of strands [bytes]; slot_count: guides of each strand."""
    point_bytes = _MADE_POINT_BYTES + _STYLED_POINT_BYTES + _DRAWN_POINT_BYTES
    return strand_count * (point_count * point_bytes + _MADE_STRAND_BYTES + slot_count * _SLOT_BYTES)


def gpu_bytes(strand_count: int, point_count: int = POINT_COUNT) -> int:
    """Return the memory of drawn strands on the GPU [bytes], for their points and their lighting.

    Excludes buffers for editing and the padding of the textures' last rows.
    """
    seen_count = -(-(point_count - 1) // _SEEN_STEP) + 1
    return strand_count * (point_count * _TEXEL_BYTES + _HEAD_BYTES + seen_count * _SEEN_BYTES)


def guide_work_bytes(settings: GuideSettings, face_count: int) -> int:
    """Return the working memory for distributing guides [bytes]; arguments as in `guide_seconds`."""
    return face_count * _FACE_WORK_BYTES + settings.guide_count * _GUIDE_WORK_BYTES


def hair_work_bytes(settings: HairSettings, face_count: int) -> int:
    """Return the working memory for growing strands [bytes]; arguments as in `hair_seconds`."""
    return face_count * _FACE_WORK_BYTES // 3 + settings.strand_count * _STRAND_WORK_BYTES


def guide_seconds(settings: GuideSettings, face_count: int) -> float:
    """Return the time for distributing guides [s]; settings: `GuideSettings`; face_count: triangles of the surface."""
    rounds = min(settings.relax_iterations, _MOST_ROUNDS)
    guide = _GUIDE_SECONDS + rounds * _GUIDE_ROUND_SECONDS + (_SPREAD_SECONDS if rounds else 0.0)
    placing = settings.guide_count * guide + face_count * (_FACE_SECONDS + rounds * _FACE_ROUND_SECONDS)
    return placing + (drape_seconds(settings.guide_count, face_count) if settings.drape else 0.0)


def drape_seconds(guide_count: int, face_count: int, substeps: int = GROWN_SUBSTEPS) -> float:
    """Return the time for draping guides [s]; face_count: triangles of the colliding surface; substeps: in total."""
    return _DRAPE_SECONDS + guide_count * substeps * _DRAPE_GUIDE_SECONDS + face_count * _DRAPE_FACE_SECONDS


def hair_seconds(settings: HairSettings, face_count: int) -> float:
    """Return the time for growing strands [s]; settings: `HairSettings`; face_count: triangles of the surface."""
    return settings.strand_count * _STRAND_SECONDS + face_count * _HAIR_FACE_SECONDS


def simulation_bytes(vertex_count: int, guide_count: int) -> int:
    """Return the working memory for simulating guides [bytes]; vertex_count: per guide."""
    return guide_count * (_SIMULATED_GUIDE_BYTES + vertex_count * _SIMULATED_VERTEX_BYTES)


def table_seconds(size: int) -> float:
    """Return the time for baking the Marschner tables [s]; size: texels along a side of each table."""
    return size**2 * _TEXEL_SECONDS


def simulation_seconds(vertex_count: int, guide_count: int, substeps: int, frame_count: int) -> float:
    """Return the time for simulating guides [s]; vertex_count: per guide; substeps: per frame."""
    return frame_count * (_FRAME_SECONDS + guide_count * vertex_count * substeps * _VERTEX_SECONDS)
