# SPDX-License-Identifier: GPL-3.0-or-later
"""`CurveSet`s from flat arrays of all curves: one set for the guides and one for the strands of each group."""

from collections.abc import Mapping

import numpy as np

from .curve_file import CurveSet


def curve_sets(
    name: str,
    points: np.ndarray,
    counts: np.ndarray,
    *,
    radii: np.ndarray | None = None,
    is_guide: np.ndarray | None = None,
    group_ids: np.ndarray | None = None,
    group_names: Mapping[int, str] | None = None,
    ids: np.ndarray | None = None,
    root_uvs: np.ndarray | None = None,
    guide_ids: np.ndarray | None = None,
    guide_weights: np.ndarray | None = None,
) -> list[CurveSet]:
    """Return the `CurveSet`s of polylines; curves without points are left out.

    name: of curves without a group; points: (N, 3); counts: (C,) numbers of points, with sum N; radii: (N,);
    is_guide: (C,) bool, group_ids: (C,) int, None if the file does not state them; group_names: ID → name. ids, (C,),
    root_uvs, (C, 2), guide_ids and guide_weights, (C, 3): as in `CurveSet`.
    """
    whole = CurveSet(
        name or "Hair",
        points,
        counts.astype(np.int64),
        np.zeros(len(counts), bool),
        radii,
        ids=ids,
        root_uvs=root_uvs,
        guide_ids=guide_ids,
        guide_weights=guide_weights,
    )
    groups = np.zeros(len(counts), np.int64) if group_ids is None else group_ids
    kinds = np.zeros(len(counts), np.int64) if is_guide is None else is_guide.astype(np.int64)
    pairs, which = np.unique(np.stack([groups, kinds], axis=1), axis=0, return_inverse=True)
    found = []
    for number, (group, kind) in enumerate(pairs.tolist()):
        some = whole.some((which.reshape(-1) == number) & (whole.counts > 0))
        if len(some):
            found.append(_named(some, group, None if is_guide is None else bool(kind), group_names or {}))
    return found


def _named(curves, group, is_guide, names):
    group_name = names.get(group, "")
    title = group_name or curves.name
    return CurveSet(
        f"{title} Guides" if is_guide else title,
        curves.points,
        curves.counts,
        curves.is_smooth,
        curves.radii,
        is_guide=is_guide,
        group_id=group,
        group_name=group_name,
        ids=curves.ids,
        root_uvs=curves.root_uvs,
        guide_ids=None if is_guide else curves.guide_ids,
        guide_weights=None if is_guide else curves.guide_weights,
    )
