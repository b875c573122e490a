# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender demands a package beside blender_manifest.toml; this one hands on the add-on's two functions."""

from .hair_addon import register, unregister

__all__ = ["register", "unregister"]
