# SPDX-License-Identifier: GPL-3.0-or-later
"""Thickness and wetness of bound hair by maps."""

from bpy.types import Curves

from ..data.maps import ramps
from . import bindings, mapped_wetness, strand_thickness
from .bindings import BoundHair


def apply(hair: Curves, bound: BoundHair) -> None:
    """Give bound hair the thickness and the wetness that the maps and the ramp of its Curves have now."""
    (thickness, status), (wetness, of_wetness) = strand_thickness.read(hair, bound), mapped_wetness.read(hair, bound)
    bound.thicken(thickness, status or of_wetness, ramps.samples(hair.vellus.thickness_ramp))
    bound.soak(wetness)


def is_same(hair: Curves, bound: BoundHair) -> bool:
    """Whether bound hair has the thickness and the wetness that `apply` would give it."""
    (thickness, status), (wetness, of_wetness) = strand_thickness.read(hair, bound), mapped_wetness.read(hair, bound)
    return (
        (status or of_wetness) == bound.map_status
        and bindings.are_same(thickness, bound.thickness)
        and bindings.are_same(wetness, bound.mapped_wetness)
        and bindings.are_same(ramps.samples(hair.vellus.thickness_ramp), bound.course)
    )
