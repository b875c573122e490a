# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection of outdated guides and hair: keys of roots, guides, masks and partings."""

import hashlib
from collections.abc import Mapping

import numpy as np
from bpy.types import Curves, Depsgraph

from ...core import geometry
from ...core.grooming import groom
from ...core.params import Settings
from ...core.styling import program
from ..data import masks, scene
from ..data.strands import curves, drawn_lines, partings
from ..host.notices import text_of
from ..settings import setting_properties, style_items

_HALF = 16  # digits of a root key that encode settings


def root_key(settings: Settings, density: np.ndarray | None, image: np.ndarray | None = None) -> str:
    """Return the key of the inputs of root placement, without the surface. image: its values, if there is one.

    density: of the vertices of a `Surface.of_cage`, which are the same at every level of subdivision.

    The first half of the key encodes settings, the second half painted weights and images.
    """
    names = (
        *("seed", "guide_count", "relax_iterations", "density_image", "curvature", "symmetric"),
        "strand_count",
    )
    values = {name: getattr(settings, name, None) for name in names}
    if isinstance(settings, groom.HairSettings):  # as in files from before strands had an image
        values["density_image"] = settings.density_image or None
    placing = repr(list(values.values()))
    painted = b"".join(values.tobytes() for values in (density, image) if values is not None)
    return _half_key(placing.encode()) + _half_key(painted)


def _half_key(data):
    return hashlib.blake2b(data, digest_size=_HALF // 2).hexdigest()


def keep_roots(target: Curves, depsgraph: Depsgraph, matching: np.ndarray) -> None:
    """Count the stored roots of guides or hair as placed on a surface with other faces.

    matching: (V,) present index of each former vertex, -1 if deleted. If the weights of matched vertices show that the
    mask was painted meanwhile, roots stay out of date. Raises `HairError`.
    """
    state = target.vellus
    if not state.root_key:
        return
    settings, density, image = _placing(target, depsgraph)
    if density is not None and ((matching >= 0) & (matching < len(density))).all():
        as_before = root_key(settings, density[matching], image)
        if as_before[_HALF:] != state.root_key[_HALF:]:
            return
    key = root_key(settings, density, image)
    if key[:_HALF] == state.root_key[:_HALF]:
        state.root_key = key


def images_key(values: Mapping[str, np.ndarray]) -> str:
    """Return the key of images that mask styles, {name: (H, W) float32}; empty without images."""
    parts = [f"{name} {each.shape} {geometry.fingerprint.fingerprint(each)}" for name, each in sorted(values.items())]
    return _half_key("\n".join(parts).encode()) if parts else ""


def has_other_style_images(hair: Curves) -> bool:
    """Whether images that mask styles were painted or replaced since hair was written. Raises `HairError`."""
    keys = program.mask_keys(style_items.styles_of(hair.vellus))
    read = {image: scene.read_image(image, may_be_black=True) for _name, image, _is_inverted in keys}
    values = {image: found for image, found in read.items() if found is not None}
    return hair.vellus.style_images_key != images_key(values)


def guides_digest(guide_curves: Curves | None) -> str:
    """Return the digest of guides, to detect hair written for other guides: undo may restore only one of both."""
    if guide_curves is None:
        return ""

    return geometry.fingerprint.fingerprint(curves.read_points(guide_curves))


def is_left_by_undo(hair: Curves) -> bool:
    """Whether hair was written for other guides: undo may restore only one of both."""
    followed = hair.vellus.followed
    return followed != "" and followed != guides_digest(hair.vellus.guide_curves)


def has_other_parting(target: Curves, depsgraph: Depsgraph) -> bool:
    """Whether the regions or part lines of hair have changed. Raises `HairError`."""
    if not partings.is_wanted(target.vellus.hair) or target.surface is None:
        return False
    settings = setting_properties.to_settings(target.vellus.hair, groom.HairSettings)
    surface_object = curves.grown_on(target)
    surface = scene.read_surface(surface_object, depsgraph).cage
    parting = partings.read(surface_object, surface, target.vellus.guide_curves, settings, depsgraph)
    return parting.key != target.vellus.parting_key


def has_other_flow(guides: Curves, depsgraph: Depsgraph) -> bool:
    """Whether flow lines of guides, or part lines that divide them, have changed since growth. Raises `HairError`."""
    name = text_of(guides.vellus.guides, "flow_lines")
    if not name or guides.surface is None:
        return False
    part_names = drawn_lines.part_names_around(guides)
    return drawn_lines.flow_key(guides.surface, name, part_names, depsgraph) != guides.vellus.flow_key


def has_other_mask(target: Curves, depsgraph: Depsgraph) -> bool:
    """Whether the mask was replaced or painted since roots were placed. Raises `HairError`."""
    return target.vellus.root_key != root_key(*_placing(target, depsgraph))


def _placing(target, depsgraph):
    """Return the settings, weights (V,) and image values that place roots of guides or hair now."""
    state, mask = target.vellus, masks.of_curves(target)
    group, settings_class = (
        (state.guides, groom.GuideSettings) if state.kind == "GUIDES" else (state.hair, groom.HairSettings)
    )
    settings = setting_properties.to_settings(group, settings_class)
    density = scene.read_cage_weights(curves.grown_on(target), depsgraph, mask.group)
    return settings, density, scene.read_image(mask.image)
