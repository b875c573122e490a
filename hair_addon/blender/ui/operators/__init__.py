# SPDX-License-Identifier: GPL-3.0-or-later
"""All operators: a package a subject, one file per operator: read, compute, write."""

from . import conversion, dynamics, guide_tools, library, looks, output, pictures, styles, surface, systems

PACKAGES = (systems, surface, conversion, guide_tools, styles, dynamics, looks, library, pictures, output)
CLASSES = tuple(cls for package in PACKAGES for cls in package.CLASSES)
