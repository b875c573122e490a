# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender requires a package beside blender_manifest.toml; it re-exports the add-on's two functions."""

from .hair_addon import register, unregister

__all__ = ["register", "unregister"]
