# SPDX-License-Identifier: GPL-3.0-or-later
"""Partings: vertex groups, integer attributes and curves → regions and line segments; ties of gathered guides."""

import hashlib
from dataclasses import dataclass

import numpy as np

from ....core import geometry
from ....core.errors import HairError
from ....core.interpolation.regions import Regions
from ...host.notices import name_of, text_of
from .. import scene
from . import drawn_lines, gathered_groups

_WHOLE = {"INT", "INT8", "BOOLEAN"}


@dataclass(frozen=True)
class Partings:
    """regions: tuple of `Regions`; lines: (L, 2, 3) float64 [m] in a `Surface`'s coordinates, or None.

    lines_key: `drawn_lines.key` of the lines; tie_fractions: (G,) float32 as in `gathered_groups.Gathered`, or None.
    """

    regions: tuple
    lines: np.ndarray | None
    lines_key: str
    tie_fractions: np.ndarray | None

    @property
    def key(self):
        """A digest of regions, lines and ties; empty for none."""
        if not self.regions and self.lines is None and self.tie_fractions is None:
            return ""
        digest = hashlib.blake2b(digest_size=16)
        for array in (part for r in self.regions for part in (r.corners, r.guides)):
            digest.update(b"-" if array is None else array.tobytes())
        digest.update(self.lines_key.encode() or b"-")
        digest.update(b"" if self.tie_fractions is None else self.tie_fractions.tobytes())
        return digest.hexdigest()


def is_wanted(settings):
    """Whether `HairSettings` (or their properties) contain a region or part lines."""
    return any(text_of(settings, name) for name in ("region_group", "region_attribute", "part_lines"))


def read(surface_object, surface, guide_curves, settings, depsgraph):
    """Read the `Partings` of `HairSettings` on a `Surface`; guide_curves: None if there are none yet."""
    regions = []
    weights = scene.read_weights(surface_object, surface, depsgraph, settings.region_group)
    if weights is not None:
        regions.append(Regions((weights > 0.5).astype(np.int32)[surface.mesh.triangles]))
    if settings.region_attribute:
        numbers = _read_numbers(surface_object, surface, guide_curves, settings.region_attribute, depsgraph)
        regions += [] if numbers is None else [numbers]
    lines = drawn_lines.read(surface_object, surface, settings.part_lines, depsgraph)
    tie_fractions = None if guide_curves is None else gathered_groups.tie_fractions_of(guide_curves)
    return Partings(
        tuple(regions), lines, drawn_lines.key(surface_object, settings.part_lines, depsgraph), tie_fractions
    )


def _read_numbers(surface_object, surface, guide_curves, name, depsgraph):
    """Return the `Regions` of an attribute; None for that of gathered guides without any. Raises `HairError`."""
    numbers = corners = guides = None
    evaluated = surface_object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        attribute = mesh.attributes.get(name)
        if attribute is not None:
            domain, numbers = attribute.domain, _whole_numbers(attribute, name_of(surface_object), ("POINT", "FACE"))
    finally:
        evaluated.to_mesh_clear()
    if numbers is not None:
        numbers = scene.on_surface(surface_object, surface, depsgraph, numbers, domain)
        if domain == "POINT":
            corners = numbers[surface.mesh.triangles]
        else:
            corners = np.repeat(numbers[geometry.faces.face_places.owners(surface.faces)][:, None], 3, axis=1)
    attribute = None if guide_curves is None else guide_curves.attributes.get(name)
    if attribute is not None:
        guides = _whole_numbers(attribute, name_of(guide_curves), ("CURVE",))
    if corners is None and guides is None:
        if name == gathered_groups.NAME:
            return None  # the guides were grown again
        sentence = 'Neither "{name}" nor its guides have an attribute "{attribute}": pick another, or clear the field.'
        raise HairError(sentence, name=name_of(surface_object), attribute=name)
    return Regions(corners, guides)


def _whole_numbers(attribute, owner, domains):
    """Return (N,) int32. Raises `HairError` for other types and domains."""
    if attribute.data_type not in _WHOLE or attribute.domain not in domains:
        sentence = 'The attribute "{attribute}" of "{name}" cannot separate hair: use integers on faces or vertices.'
        if "CURVE" in domains:
            sentence = 'The attribute "{attribute}" of "{name}" cannot separate hair: use integers on curves.'
        raise HairError(sentence, attribute=name_of(attribute), name=owner)
    numbers = np.empty(len(attribute.data), bool if attribute.data_type == "BOOLEAN" else np.int32)
    attribute.data.foreach_get("value", numbers)
    return numbers.astype(np.int32)
