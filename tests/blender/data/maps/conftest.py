# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair whose settings are given by maps."""

import bpy
import pytest

from hair_addon import api


@pytest.fixture
def curls(hair):
    """Return hair Curves with the style Curl."""
    api.add_style(hair.data, "CURL", radius=0.05, pitch=0.2)
    bpy.context.view_layer.update()
    return hair.data
