# SPDX-License-Identifier: GPL-3.0-or-later
"""UVs are ambiguous exactly where two faces overlap in the layout."""

import numpy as np
import pytest

from hair_addon.core.geometry.faces.uv_maps import misleading_fraction
from hair_addon.core.geometry.mesh import TriMesh


def squares(count):
    """Return a row of unit squares of two triangles, all with the UVs (F, 3, 2) of one square."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)
    vertices = np.concatenate([corners + np.array((2.0 * place, 0, 0)) for place in range(count)]).astype(np.float32)
    faces = np.concatenate([np.array([(0, 1, 2), (0, 2, 3)]) + 4 * place for place in range(count)]).astype(np.int32)
    return TriMesh(vertices, faces), np.tile(corners[[(0, 1, 2), (0, 2, 3)]][..., :2], (count, 1, 1))


def test_a_layout_without_overlaps_leads_everywhere():
    mesh, uvs = squares(4)
    apart = uvs + np.repeat(np.arange(4.0), 2)[:, None, None] * (1.5, 0.0)
    assert misleading_fraction(mesh, apart.astype(np.float32)) == 0.0


@pytest.mark.parametrize("count", [2, 4])
def test_of_faces_on_top_of_each_other_one_is_found(count):
    mesh, uvs = squares(count)
    assert misleading_fraction(mesh, uvs) == pytest.approx(1.0 - 1.0 / count, abs=0.02)


def test_a_mirrored_half_is_astray():
    mesh, uvs = squares(2)
    uvs[2:, :, 0] = 1.0 - uvs[2:, :, 0]
    assert misleading_fraction(mesh, uvs) > 0.45


def test_half_an_overlap_is_half_astray():
    mesh, uvs = squares(2)
    uvs[2:, :, 0] += 0.5
    assert misleading_fraction(mesh, uvs) == pytest.approx(0.25, abs=0.02)


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_a_layout_without_an_area_leads_nowhere(value):
    mesh, uvs = squares(2)
    assert misleading_fraction(mesh, np.full_like(uvs, value)) == 1.0
