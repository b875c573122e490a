# SPDX-License-Identifier: GPL-3.0-or-later
"""The Warp device for tests of the mathematics: the processor, unless VELLUS_TEST_DEVICE names another."""

import os

DEVICE = os.environ.get("VELLUS_TEST_DEVICE", "cpu")
