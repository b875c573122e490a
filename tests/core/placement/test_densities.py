# SPDX-License-Identifier: GPL-3.0-or-later
"""A density of guides and strands sets their number by the area that they grow on."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon import api
from hair_addon.core.errors import HairError
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.placement import densities

KINDS = (GuideSettings(guide_density=0.5), HairSettings(strand_density=0.5))


def count_of(settings):
    return getattr(settings, densities.COUNTS[densities.name_of(settings)])


@pytest.mark.parametrize("settings", KINDS)
def test_a_number_is_density_times_area_and_stays_within_rounding(settings):
    for area in (0.001, 0.02, 3.0):
        assert count_of(densities.counted(settings, area)) == round(0.5e4 * area)
    counted = densities.counted(settings, 0.02)
    assert densities.counted(counted, 0.02 * (1.0 + 1e-6)) == counted, "no root is placed anew"
    assert densities.of_count(count_of(counted), 0.02) == pytest.approx(0.5)
    assert count_of(densities.counted(settings, 1e-9)) == 1
    unset = replace(settings, **{densities.name_of(settings): 0.0})
    assert densities.counted(unset, 3.0) == unset
    with pytest.raises(HairError, match=r"decrease (Guide|Strand) Density"):
        densities.counted(settings, 1e6)
    with pytest.raises(HairError, match="density must be between 0"):
        replace(settings, **{densities.name_of(settings): -1.0})


def test_arrays_grow_as_many_as_their_density():
    square = np.float32([(0, 0, 0), (0.2, 0, 0), (0.2, 0.1, 0), (0, 0.1, 0)]), np.int32([(0, 1, 2), (0, 2, 3)])
    guides = api.distribute_guides(square, guide_density=0.1, relax_iterations=0, length=0.02)
    assert len(guides) == 20
    assert len(api.interpolate_hair(guides, mesh=square, strand_density=1.5, radius=1e-4, point_count=3)) == 300
