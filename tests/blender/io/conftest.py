# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures of exported hair."""

from tests.support.exchange.exported import baked, twisted  # noqa: F401 (fixtures)
