# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair that is exported."""

from tests.support.exchange.exported import baked, twisted  # noqa: F401 (fixtures)
