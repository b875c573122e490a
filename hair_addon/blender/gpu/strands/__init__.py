# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands made on the GPU: interpolated between guides, styled, carried by their surface; what of them changed."""

from ....core.lazy import submodules

__getattr__ = submodules(__name__)
