# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors of black bodies are those of Cycles."""

import numpy as np
import pytest

from hair_addon.core.imaging import blackbody

# Linear Rec. 709, rendered by Cycles 5.2.
RENDERED = {
    2000.0: (2.52009535, 0.64685094, 0.0204128),
    2700.0: (1.93507671, 0.80353075, 0.19172148),
    4000.0: (1.41411614, 0.92364192, 0.53367424),
    6500.0: (1.04255211, 0.98405254, 1.03527153),
    12000.0: (0.8262955, 0.99450803, 1.56630766),
    20000.0: (0.8262955, 0.99450803, 1.56630766),
}


@pytest.mark.parametrize("temperature", RENDERED)
def test_a_black_body_has_the_color_of_cycles(temperature):
    """Colors differ by less than 2 % of their greatest channel, and their luminance is 1."""
    found, wanted = blackbody.blackbody_color(temperature), np.array(RENDERED[temperature])
    assert np.abs(found - wanted).max() < 0.02 * wanted.max()
    assert abs(found @ [0.2126, 0.7152, 0.0722] - 1.0) < 1e-3
