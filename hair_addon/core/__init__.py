# SPDX-License-Identifier: GPL-3.0-or-later
"""The mathematics: NumPy and Warp, arrays in, arrays out, no Blender."""
