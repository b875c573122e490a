# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair as in a window on a graphics card."""

from tests.support.pictures.gpu_strands import watched, window  # noqa: F401 (fixtures)
