# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors of black bodies are those of Cycles."""

import numpy as np
import pytest

from hair_addon.core.imaging import blackbody

# Linear Rec. 709, rendered by Cycles 5.2.
RENDERED = {
    0.0: (5.4132943, 0.0, 0.0),
    800.0: (5.4138594, 0.0, 0.0),
    900.0: (4.9839606, 0.0, 0.0),
    1000.0: (4.6013613, 0.0390419, 0.0),
    1200.0: (3.9655328, 0.2278973, 0.0),
    1500.0: (3.2643068, 0.4340463, 0.0),
    1950.0: (2.5785143, 0.6305838, 0.0098378),
    2000.0: (2.52009535, 0.64685094, 0.0204128),
    2700.0: (1.93507671, 0.80353075, 0.19172148),
    4000.0: (1.41411614, 0.92364192, 0.53367424),
    6500.0: (1.04255211, 0.98405254, 1.03527153),
    12000.0: (0.8262955, 0.99450803, 1.56630766),
    20000.0: (0.8262955, 0.99450803, 1.56630766),
}


@pytest.mark.parametrize("temperature", RENDERED)
def test_a_black_body_has_the_color_of_cycles(temperature):
    """Colors are those of Cycles within single precision, and have a luminance of 1 where no channel is negative."""
    found, wanted = blackbody.blackbody_color(temperature), np.array(RENDERED[temperature])
    np.testing.assert_allclose(found, wanted, atol=2e-5)
    if wanted.all():
        assert abs(found @ [0.2126, 0.7152, 0.0722] - 1.0) < 2e-3
