# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimates of the time and memory of guides and hair, from counts.

Times are those of two plain cores, measured (tests/benchmarks/test_estimates.py); other computers take half to twice as
long.
"""

from .groom import POINT_COUNT, GuideSettings, HairSettings

# Bytes of Blender's Curves. A point: position (12), radius (4). A curve: offset (4), type (1),
# UV (8), normal (12), the strand that stands for its guide, id, random number (4 each); the
# root: triangle (4), its corners and barycentric coordinates (12 each).
_POINT_BYTES, _CURVE_BYTES = 16, 65
_SLOT_BYTES = 8  # which guide, and its weight
# Bytes on the GPU. A point, and what a strand has beside its points: its root, its range, a random number; and where
# every fourth point of it sees the world, in four textures of four bytes each.
_TEXEL_BYTES, _HEAD_BYTES = 8, 12
_SEEN_STEP, _SEEN_BYTES = 4, 16

# While it is worked on. A triangle of the surface, a guide, a strand.
_FACE_WORK_BYTES, _GUIDE_WORK_BYTES, _STRAND_WORK_BYTES = 760, 3300, 680

# Of strands while they are made and are kept, measured (tests/blender/groom/test_hair_memory.py): a point here, in
# Blender's Curves and its evaluated copy, with styles, and where it is drawn from; a strand, its roots and its guides.
_MADE_POINT_BYTES, _STYLED_POINT_BYTES, _DRAWN_POINT_BYTES = 36, 12, 12
_MADE_STRAND_BYTES = 380

# Placing: a triangle of the surface and a guide, once, and once in each round.
_FACE_SECONDS, _FACE_ROUND_SECONDS = 5e-6, 2e-7
_GUIDE_SECONDS, _GUIDE_ROUND_SECONDS = 4e-5, 9e-6
_SPREAD_SECONDS = 2e-4  # a guide that few coarse ones became, from level to level
_MOST_ROUNDS = 60  # that it takes until guides rest

# Growing strands: a triangle, whose normals it takes, and a strand.
_HAIR_FACE_SECONDS, _STRAND_SECONDS = 2.5e-6, 3e-6

# Simulating: a frame, and a vertex in a substep, with contact.
_FRAME_SECONDS, _VERTEX_SECONDS = 0.02, 4e-7

# While they are simulated: a guide, and a vertex of it.
_SIMULATED_GUIDE_BYTES, _SIMULATED_VERTEX_BYTES = 30_000, 600

# Draping: once, a triangle of the surface, and a guide in a substep.
_DRAPE_SECONDS, _DRAPE_FACE_SECONDS, _DRAPE_GUIDE_SECONDS = 0.15, 4e-6, 1e-5
GROWN_SUBSTEPS = 48  # of guides that are draped as they grow

_TEXEL_SECONDS = 1.5e-6  # of all of the Marschner tables together


def curves_bytes(strand_count: int, point_count: int = POINT_COUNT, slot_count: int = 0) -> int:
    """Memory of strands as a Curves datablock [bytes]; slot_count: guides of each strand that are stored with it."""
    return strand_count * (point_count * _POINT_BYTES + _CURVE_BYTES + slot_count * _SLOT_BYTES)


def strand_bytes(strand_count: int, point_count: int = POINT_COUNT, slot_count: int = 0) -> int:
    """Memory that strands take at most, from when they are made [bytes]; slot_count: guides that each follows."""
    point_bytes = _MADE_POINT_BYTES + _STYLED_POINT_BYTES + _DRAWN_POINT_BYTES
    return strand_count * (point_count * point_bytes + _MADE_STRAND_BYTES + slot_count * _SLOT_BYTES)


def gpu_bytes(strand_count: int, point_count: int = POINT_COUNT) -> int:
    """Memory of drawn strands on the GPU [bytes]: of their points, and of the light that reaches them.

    That is while nobody edits them, and but for the ends of the textures' last rows.
    """
    seen_count = -(-(point_count - 1) // _SEEN_STEP) + 1
    return strand_count * (point_count * _TEXEL_BYTES + _HEAD_BYTES + seen_count * _SEEN_BYTES)


def guide_work_bytes(settings: GuideSettings, face_count: int) -> int:
    """Memory that distributing guides takes while it runs [bytes]; arguments as for `guide_seconds`."""
    return face_count * _FACE_WORK_BYTES + settings.guide_count * _GUIDE_WORK_BYTES


def hair_work_bytes(settings: HairSettings, face_count: int) -> int:
    """Memory that growing strands takes while it runs [bytes]; arguments as for `hair_seconds`."""
    return face_count * _FACE_WORK_BYTES // 3 + settings.strand_count * _STRAND_WORK_BYTES


def guide_seconds(settings: GuideSettings, face_count: int) -> float:
    """How long distributing guides takes [s]; settings: `GuideSettings`; face_count: triangles of the surface."""
    rounds = min(settings.relax_iterations, _MOST_ROUNDS)
    guide = _GUIDE_SECONDS + rounds * _GUIDE_ROUND_SECONDS + (_SPREAD_SECONDS if rounds else 0.0)
    placing = settings.guide_count * guide + face_count * (_FACE_SECONDS + rounds * _FACE_ROUND_SECONDS)
    return placing + (drape_seconds(settings.guide_count, face_count) if settings.drape else 0.0)


def drape_seconds(guide_count: int, face_count: int, substeps: int = GROWN_SUBSTEPS) -> float:
    """How long draping guides takes [s]; face_count: triangles that they may touch; substeps: in all."""
    return _DRAPE_SECONDS + guide_count * substeps * _DRAPE_GUIDE_SECONDS + face_count * _DRAPE_FACE_SECONDS


def hair_seconds(settings: HairSettings, face_count: int) -> float:
    """How long growing strands between guides takes [s]; settings: `HairSettings`; face_count as above."""
    return settings.strand_count * _STRAND_SECONDS + face_count * _HAIR_FACE_SECONDS


def simulation_bytes(vertex_count: int, guide_count: int) -> int:
    """Memory that simulating guides takes while it runs [bytes]; vertex_count: of a guide."""
    return guide_count * (_SIMULATED_GUIDE_BYTES + vertex_count * _SIMULATED_VERTEX_BYTES)


def table_seconds(size: int) -> float:
    """How long baking the Marschner tables takes [s]; size: of each, in texels along a side."""
    return size**2 * _TEXEL_SECONDS


def simulation_seconds(vertex_count: int, guide_count: int, substeps: int, frame_count: int) -> float:
    """How long simulating guides takes [s]; vertex_count: of a guide; substeps: of a frame."""
    return frame_count * (_FRAME_SECONDS + guide_count * vertex_count * substeps * _VERTEX_SECONDS)
