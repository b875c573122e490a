# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides in viewports: lines of constant width over the hair, thin and faded so that the hair is seen behind them.

Frozen points are fainter than others.
"""

import zlib

import bpy
import numpy as np

from ....core import geometry
from ....core.errors import HairError
from ...data import scene
from ...data.strands import curves, frozen_points, gathered_groups
from ...gpu import drawing, strand_textures
from ...gpu.programs import scene_programs, uniforms
from ...groom import bindings
from ...host.caches import Cache
from ...host.notices import name_of
from ...materials import looks
from .. import hair_cache

_LINE_WIDTH = 1.25  # [pixels]
_FRINGE = 3.0  # [pixels]: antialiasing and a dark edge on both sides, as in strands/guides.frag
FROZEN_PLACES = 32  # of a guide at which the viewport knows whether it is frozen
_PLAIN = (0.72, 0.86, 1.0)
_SHORT_HUE = 2.0 / 3.0  # blue; 0 is red
_GOLDEN = 0.61803399  # steps that give neighboring numbers distinct hues


hue_cache = Cache(capacity=8)  # session_uid of guide Curves → ((fingerprint of points, offsets), texture of hues)


def shown(context) -> list:
    """Objects of guides that are drawn in the context's viewport: selected, edited, or set to be shown."""
    found = scene.curves_objects(context.view_layer, "GUIDES", context.space_data)
    return [o for o in found if o.select_get() or o.mode != "OBJECT" or looks.are_guides_shown(o.data)]


def strip_width() -> float:
    """Width of a line with its fringe [pixels], in the resolution of the interface."""
    return _LINE_WIDTH * bpy.context.preferences.system.ui_scale + _FRINGE


def draw(guide_object, view, lights, clip_planes):
    """Draw guides into the bound framebuffer; view, lights: records of `uniforms`; clip_planes: (6, 4) or None."""
    try:
        guides = hair_cache.strands_on_gpu(guide_object.data)
    except HairError as error:
        hair_cache.refuse(guide_object.data, error)
        return
    state = guide_object.data.vellus
    if guides is None or state.guide_opacity == 0.0:
        return
    program = scene_programs.guide_program(is_clipped=clip_planes is not None)
    program.bind()
    program.uniform_float("line_color", (*_color_of(guide_object.data), state.guide_opacity))
    program.uniform_float("strip_width", strip_width())
    hues = _hues_texture(guide_object.data)
    program.uniform_int("color_source", int(state.guide_colors == "GUIDE") if hues is None else 2)
    frozen = _frozen_texture(guide_object.data)
    program.uniform_int("frozen_places", 0 if frozen is None else FROZEN_PLACES)
    given = {"frozen": frozen, "hues": hues}
    samplers = {name: guides.texture if texture is None else texture for name, texture in given.items()}
    record = drawing.strand_record(guides, view, np.array(guide_object.matrix_world, np.float64))
    record["thickness"] = 0.0  # lines of constant width
    with drawing.gpu_state("LESS_EQUAL", depth_writes=False, blend="ALPHA"):
        drawing.draw_strip(guides, program, record, uniforms.uniform_buffer(lights), samplers, clip_planes)


def _frozen_texture(guides):
    """Return a texture with `FROZEN_PLACES` numbers for each guide, evenly from root to tip: 1 at frozen points.

    None if no point is frozen.
    """
    are_frozen = frozen_points.read(guides)
    if are_frozen is None:
        return None
    starts, counts = curves.curve_offsets(guides)[:-1], curves.point_counts(guides)
    steps = np.rint(np.linspace(0.0, 1.0, FROZEN_PLACES) * np.maximum(counts - 1, 0)[:, None]).astype(np.int64)
    values = are_frozen[np.minimum(starts[:, None] + steps, len(are_frozen) - 1)]
    return strand_textures.numbers_texture(values.ravel(), min(strand_textures.TEXTURE_WIDTH, values.size))


def _hues_texture(guides):
    """Return a texture with the hue of each guide; None if no number determines the colors."""
    if not len(guides.curves):
        return None
    if guides.vellus.guide_colors == "TIE":
        return _numbers_texture(_hues_of_ties(guides))
    if guides.vellus.guide_colors == "CLUMP":
        return _texture_of_clumps(guides)
    if guides.vellus.guide_colors != "LENGTH":
        return None
    starts, points = curves.curve_offsets(guides), curves.read_points(guides)
    source, known = (geometry.fingerprint.fingerprint(points), starts.tobytes()), hue_cache.get(guides.session_uid)
    if known is None or known[0] != source:
        hues = _hues_of_lengths(geometry.strands.ragged_lengths(points, starts))
        known = hue_cache.keep(guides.session_uid, (source, _numbers_texture(hues)))
    return known[1]


def _texture_of_clumps(guides):
    """Return a texture with the hues of `_hues_of_clumps` for `bindings.with_clumps`."""
    bound = bindings.with_clumps(guides)
    if bound is None:
        return _numbers_texture(np.full(len(guides.curves), -1.0))
    numbers = bound.styles.styling.lock_numbers()
    nearest = bound.binding.guide_weights.indices.numpy()[:, 0]
    source = len(guides.curves), numbers.tobytes(), nearest.tobytes()
    known = hue_cache.get(guides.session_uid)
    if known is None or known[0] != source:
        hues = _hues_of_clumps(len(guides.curves), numbers, nearest)
        known = hue_cache.keep(guides.session_uid, (source, _numbers_texture(hues)))
    return known[1]


def _numbers_texture(values):
    return strand_textures.numbers_texture(values, min(strand_textures.TEXTURE_WIDTH, len(values)))


def _hues_of_lengths(lengths):
    """Return hues (G,) from blue for the shortest guide to red for the longest one; green if lengths are equal.

    lengths: (G,), zero in place of NaN.
    """
    lengths = np.nan_to_num(lengths)
    least, most = lengths.min(), lengths.max()
    part = np.full(len(lengths), 0.5) if most - least <= 1e-4 * most else (lengths - least) / (most - least)
    return _SHORT_HUE * (1.0 - part)


def _hues_of_ties(guides):
    """Return hues (G,) of the ties and locks of gathered guides; -1 for the others, which have the plain color."""
    groups = gathered_groups.groups_of(guides)
    if groups is None:
        return np.full(len(guides.curves), -1.0)
    return np.where(groups > 0, groups * _GOLDEN % 1.0, -1.0)


def _hues_of_clumps(guide_count, numbers, nearest):
    """Return hues (G,), a random hue for each clump; -1 for guides without a clump, which have the plain color.

    A guide belongs to the clump of most of its strands: the strands whose nearest guide it is. numbers: (S,) in [0, 1),
    -1 for strands without a clump; nearest: (S,) nearest guide of each strand, -1 for none.
    """
    hues = np.full(guide_count, -1.0)
    is_valid = (numbers >= 0.0) & (nearest >= 0) & (nearest < guide_count)
    pairs = np.stack([nearest[is_valid], numbers[is_valid].astype(np.float64)], axis=1)
    clumps, counts = np.unique(pairs, axis=0, return_counts=True)
    for guide, hue in clumps[np.argsort(counts, kind="stable")]:  # the largest count comes last
        hues[int(guide)] = hue
    return hues


def _color_of(guides):
    """Return the color of all guides of an object: plain, or a hue of its own for each hair system."""
    if guides.vellus.guide_colors != "SYSTEM":
        return _PLAIN
    turn = zlib.crc32(name_of(guides).encode()) / 2**32
    hue = np.clip(np.abs((turn + np.array([0.0, 2 / 3, 1 / 3])) % 1.0 * 6.0 - 3.0) - 1.0, 0.0, 1.0)
    return tuple(0.35 + 0.65 * hue)
