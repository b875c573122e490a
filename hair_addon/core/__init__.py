# SPDX-License-Identifier: GPL-3.0-or-later
"""Mathematics in NumPy and Warp: arrays in, arrays out, no Blender."""
