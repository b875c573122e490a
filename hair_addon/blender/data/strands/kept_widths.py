# SPDX-License-Identifier: GPL-3.0-or-later
"""Original radii of kept hair, stored while a map or a curve changes them."""

import numpy as np

from . import attributes, curves


def are_kept(hair):
    """Whether kept hair stores its original radii."""
    return attributes.has(hair, curves.OWN_RADIUS, "FLOAT", "POINT")


def own(hair):
    """Return (N,) float32 original radii of the hair, and current radii of points that were added since."""
    present = curves.read_radii(hair)
    found = attributes.read(hair, curves.OWN_RADIUS, "FLOAT", "POINT")
    if found is None:
        return present
    found = attributes.valid_radii(found)
    return np.where(found > 0.0, found, present)


def change(hair, radii):
    """Write (N,) radii, and store the original radii of the hair."""
    attributes.write(hair, curves.OWN_RADIUS, "FLOAT", "POINT", own(hair))
    attributes.write(hair, "radius", "FLOAT", "POINT", radii)


def restore(hair):
    """Restore the original radii of hair."""
    attributes.write(hair, "radius", "FLOAT", "POINT", own(hair))
    forget(hair)


def forget(hair):
    """Remove the stored original radii; the current radii stay."""
    if are_kept(hair):
        hair.attributes.remove(hair.attributes[curves.OWN_RADIUS])
