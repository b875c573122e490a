# SPDX-License-Identifier: GPL-3.0-or-later
"""Automatic updates: live hair, handlers, first-time setup."""

from ...core.lazy import submodules

__getattr__ = submodules(__name__)
