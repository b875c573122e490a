# SPDX-License-Identifier: GPL-3.0-or-later
"""What guides are simulated in: poses of their surface, force fields, colliders, wetness."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
