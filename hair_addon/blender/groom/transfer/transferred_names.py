# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a groom transferred to another mesh: names that the mesh lacks are cleared, and lengths scaled."""

from bpy.types import Curves, Object, PropertyGroup

from ....core.dynamics.rod.settings import DynamicsSettings
from ....core.grooming.groom import GuideSettings, HairSettings
from ....core.params import declared
from ....core.styling.kinds import KINDS
from ...host.notices import text_of
from ...settings import style_items


def clear(guides: Curves, hair: Curves | None, target: Object) -> list[str]:
    """Clear names in the settings of guides and their hair that a mesh object lacks; returns these names."""
    if hair is None:
        settings = guides.vellus.guides
        # They are drawn on the other mesh, and hand-made guides do not follow them.
        settings.flow_lines = ""
        return _clear_masks(settings, "density_group", "density_image", target)
    settings = hair.vellus.hair
    cleared = _clear_masks(settings, "density_group", "density_image", target)
    cleared += _clear_unless(settings, "region_group", target.vertex_groups)
    lines = text_of(settings, "part_lines")
    if lines:
        settings.part_lines = ""
        cleared.append(lines)
    attributes = {*_names(target.vertex_groups), *_names(target.data.attributes), *_names(guides.attributes)}
    for item in hair.vellus.styles:
        group = style_items.group_of(item)
        name, image = text_of(group, "mask"), text_of(group, "mask_image")
        if name and name not in attributes:
            group.mask = ""
            cleared.append(name)
        if image and not target.data.uv_layers:
            group.mask_image = ""
            cleared.append(image)
    return cleared


def scale_lengths(owner: PropertyGroup, factor: float) -> None:
    """Multiply the lengths in a property group of guide, hair or dynamics settings."""
    names = {entry.identifier for entry in owner.bl_rna.properties}
    for settings_class in (GuideSettings, HairSettings, DynamicsSettings):
        for name, _default, details in declared(settings_class):
            if details.unit == "LENGTH" and name in names:
                _scale(owner, name, factor)


def scale_style(item: PropertyGroup, factor: float) -> None:
    """Multiply the lengths in the settings of a style."""
    owner = style_items.group_of(item)
    for name, _default, details in declared(KINDS[item.kind]):
        if details.unit == "LENGTH":
            _scale(owner, name, factor)


def _scale(owner, name, factor):
    if factor != 1.0:
        setattr(owner, name, getattr(owner, name) * factor)


def _clear_masks(settings, group, image, target):
    cleared = _clear_unless(settings, group, target.vertex_groups)
    if text_of(settings, image) and not target.data.uv_layers:
        cleared.append(text_of(settings, image))
        setattr(settings, image, "")
    return cleared


def _clear_unless(settings, name, collection):
    value = text_of(settings, name)
    if not value or value in collection:
        return []
    setattr(settings, name, "")
    return [value]


def _names(collection):
    return (text_of(one, "name") for one in collection)
