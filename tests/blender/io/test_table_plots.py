# SPDX-License-Identifier: GPL-3.0-or-later
"""There is a plot for each table, with texels at the positions of its axes."""

import numpy as np
import pytest

from hair_addon.blender.io import table_plots
from hair_addon.core.shading.tables import dual_scattering, lookup_tables, table_axes


def pixels(picture):
    """Return (H, W, 3) floats, the top line first."""
    with picture.with_buffer() as buffer:
        return np.array(buffer)[::-1, :, :3].astype(float)


@pytest.mark.parametrize("mode", ["classic", "energy"])
def test_every_table_has_its_picture(mode):
    tables = lookup_tables.bake(lookup_tables.Settings(mode=mode, size=32))
    pictures = table_plots.plot_tables(tables, dual_scattering.bake(tables))
    assert set(pictures) == {*table_axes.tables_of(mode), *table_axes.DUAL_TABLES}
    for picture in pictures.values():
        assert pixels(picture).std() > 5.0


def test_light_is_where_its_texel_is_and_labels_stand_outside():
    """One bright column of N_TRT is drawn at phi = 3/4 pi, in the row of the greatest cosine, and labels are
    outside.
    """
    tables = lookup_tables.bake(lookup_tables.Settings(mode="energy", size=16))
    tables.n_trt[:] = 0.0
    tables.n_trt[15, 12] = 1.0
    shown = pixels(table_plots.plot_tables(tables, dual_scattering.bake(tables))["n_trt"])
    left, top, size = table_plots._LEFT, table_plots._TOP, table_plots._PANEL
    inside = shown[top : top + size, left : left + size].mean(axis=-1)
    lines, columns = np.nonzero(inside > 250.0)
    assert lines.min() >= size * 15 // 16 and (columns.min(), columns.max()) == (size * 12 // 16, size * 13 // 16 - 1)
    for margin in (shown[:top, left:], shown[top + size + 2 :], shown[:, : left - 2]):
        assert margin.max() > 200.0  # letters
