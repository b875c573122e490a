# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on registered in Blender, and scenes to grow hair in."""

from tests.support.scenes import *  # noqa: F403 (fixtures)
