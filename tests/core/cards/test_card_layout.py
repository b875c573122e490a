# SPDX-License-Identifier: GPL-3.0-or-later
"""Crossed cards, flyaways and caps have the promised numbers, directions and strands."""

import numpy as np
import pytest

from hair_addon.core.cards import card_layout
from hair_addon.core.cards.card_layout import CardStrands, Placement, laid_cards, texture_segments
from hair_addon.core.cards.card_settings import CardSettings, Level
from hair_addon.core.cards.texels import NO_STRAND
from hair_addon.core.geometry.search import clusters
from tests.core.cards.conftest import sphere, wavy_hair

LEVEL = Level(30, 4, 256)


@pytest.fixture(scope="module")
def strands():
    points = wavy_hair(np.random.default_rng(3), 300, 13)
    radii = np.full(points.shape[:2], 5e-4, np.float32)
    return CardStrands(points, radii, np.full(points.shape, 0.5, np.float32), sphere())


def laid(strands, **changes):
    return laid_cards(strands, LEVEL, CardSettings(card_count=30, segment_count=4, **changes), Placement())


def across(made):
    """Return unit vectors (C, 3) across the middle of cards, and middles (C, 5, 3) of their places."""
    edges = made.mesh.vertices.reshape(30, 5, 2, 3).astype(float)
    vectors = edges[:, 2, 1] - edges[:, 2, 0]
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True), edges.mean(axis=2)


@pytest.mark.parametrize("changes", [{}, {"crossed": 0.5}, {"flyaways": 0.2, "caps": 0.2, "crossed": 1.0}])
def test_the_number_of_cards_is_the_same_with_all_kinds(strands, changes):
    made = laid(strands, **changes)
    assert len(made.mesh.vertices) == LEVEL.vertex_count and made.mesh.triangle_count == LEVEL.triangle_count
    assert made.picture_count == 30


@pytest.mark.parametrize("count", [1, 2, 3, 7, 600])
@pytest.mark.parametrize("parts", [(0.0, 0.0, 0.0), (1.0, 0.9, 0.9), (1.0, 0.0, 0.0), (0.3, 0.5, 0.5)])
def test_some_cards_are_clumps_whatever_the_parts(count, parts):
    crossed, flyaways, caps = CardSettings(**dict(zip(("crossed", "flyaways", "caps"), parts, strict=True))).parts_of(
        count
    )
    assert min(crossed, flyaways, caps) >= 0 and crossed <= count - crossed - flyaways - caps
    assert count - crossed - flyaways - caps >= 1


def test_flyaways_are_far_from_the_nearest_other_strand_by_few_comparisons(monkeypatch):
    """Among strands in clumps of their own, the farthest from the nearest other clump are flyaways; each strand is
    compared with few clumps, and with no more of them if there are more strands.
    """

    def counted(line, lines):
        compared.append(lines.size // lines.shape[-1] // lines.shape[-2])
        return distances(line, lines)

    distances, per_strand = card_layout._distances, []
    monkeypatch.setattr(card_layout, "_distances", counted)
    for count in (200, 1600):
        points, compared = wavy_hair(np.random.default_rng(5), count, 13), []
        found = card_layout._outermost(points, clusters.strand_features(points), count, 20)
        per_strand.append(sum(compared) / count)
        apart = np.stack([distances(line, points) for line in points]) + np.diag(np.full(count, np.inf))
        assert sorted(found) == sorted(np.argsort(-apart.min(axis=1), kind="stable")[:20])
    assert per_strand[1] < 1.2 * per_strand[0] < 40.0


def test_crossed_cards_stand_at_a_right_angle_on_the_same_line(strands):
    made = laid(strands, crossed=1.0)
    vectors, _ = across(made)
    (crossed, _, _) = CardSettings(crossed=1.0).parts_of(30)
    assert crossed == 15
    cosines = np.abs(vectors[15:] @ vectors[:15].T)
    # Each crossed card is at a right angle to one of the first cards.
    assert (cosines.min(axis=1) < 0.02).all()


def test_crossed_cards_show_the_strands_of_their_clump_again(strands):
    made = laid(strands, crossed=1.0)
    assert len(made.strands.places) > 1.5 * len(strands.points)


def test_flyaways_are_the_strands_farthest_from_their_clump(strands):
    """Cards of flyaways are as wide as a strand; a strand that leaves its clump halfway is one of them."""
    points = strands.points.copy()
    away = points[7, 6] + np.linspace(0.0, 1.0, 7)[:, None] * [0.0, 0.0, 0.3]
    points[7, 6:] = away
    made = laid(CardStrands(points, strands.radii, strands.colors, strands.surface), flyaways=0.1)
    edges = made.mesh.vertices.reshape(30, 5, 2, 3)
    widths = np.linalg.norm(edges[:, :, 1] - edges[:, :, 0], axis=-1).max(axis=1)
    assert widths[27:].max() < 0.02 < np.median(widths[:27])  # strands wave by 8 mm
    tips = edges[27:, -1].mean(axis=1)
    assert np.linalg.norm(tips - points[7, -1], axis=1).min() < 5e-3


def test_caps_lie_at_the_roots_and_show_only_the_roots(strands):
    made = laid(strands, caps=0.2)
    edges = made.mesh.vertices.reshape(30, 5, 2, 3)
    longest = np.linalg.norm(np.diff(strands.points, axis=1), axis=-1).sum(axis=1).max()
    away = np.linalg.norm(edges.mean(axis=2), axis=-1).max(axis=1) - 0.1
    assert away[24:].max() < 0.3 * longest < away[:24].max()
    assert set(np.unique(made.strands.reaches)) == {np.float32(0.25), np.float32(1.0)}


def test_textures_show_the_highest_strand(strands):
    """Each texel shows a segment of a strand that lies at the texel."""
    made = laid(strands)
    segments = texture_segments(made.strands, 256, 1)
    y, x = np.nonzero(segments != NO_STRAND)
    strand, piece = np.divmod(segments[y, x], 12)
    first, second = made.strands.places[strand, piece, :2], made.strands.places[strand, piece + 1, :2]
    places, edge = (np.stack([x, y], axis=1) + 0.5) / 256, second - first
    part = np.clip(((places - first) * edge).sum(axis=1) / (edge**2).sum(axis=1), 0.0, 1.0)
    away = np.linalg.norm(places - first - part[:, None] * edge, axis=1)
    assert len(y) > 3000 and (away < 1.3 * made.strands.radii.max()).all()
