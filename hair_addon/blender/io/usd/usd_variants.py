# SPDX-License-Identifier: GPL-3.0-or-later
"""Variants of a group in USD: levels of detail of its strands, and looks.

    /groom/<group>{look=…}   binding of strands to a material, and its mean color; stronger than levels
    /groom/<group>{lod=…}    values of strands: fewer and thicker ones in each level
    /groom/<group>/looks     materials of the looks

Without variants everything is written to the prims themselves, whose values would hide those of variants.
"""

from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from ....core.shading import appearance
from ....core.shading.appearance import Appearance
from . import usd_materials

LEVELS = ("full", "half", "quarter", "eighth", "sixteenth", "thirty_second")

PRESENT_LOOK = "present"

RADIAL_ROUGHNESS = "groom_radial_roughness"  # a primvar that is not in the specification

_LEVEL, _LOOK = "lod", "look"


@dataclass(frozen=True)
class Variants:
    """Number of levels of detail, 1 for strands without variants, and {variant: look} beside the present look."""

    level_count: int = 1
    looks: dict[str, Appearance] = field(default_factory=dict)


class Level:
    """Every `step`-th strand of a group, thicker so that the total width is the same.

    counts: (S,) points of all strands; path: of the variant, None without variants.
    """

    def __init__(self, path, counts, step):
        self.path, self._step = path, step
        self.counts = counts[::step]
        self.thickness = len(counts) / max(len(self.counts), 1)
        self._points = slice(None) if step == 1 else np.repeat(np.arange(len(counts)) % step == 0, counts)

    def of_curves(self, values):
        """Return the values (s, ...) of this level's strands; values: (S, ...) of all strands."""
        return values[:: self._step]

    def of_points(self, values):
        """Return the values (n, ...) at the points of this level's strands; values: (N, ...) of all points."""
        return values[self._points]


@contextmanager
def editing(stage, path):
    """A context that writes to a variant by path, or to the prims themselves for None."""
    if path is None:
        yield
        return
    set_name, name = path.GetVariantSelection()
    variants = stage.GetPrimAtPath(path.StripAllVariantSelections()).GetVariantSet(set_name)
    shown = variants.GetVariantSelection()
    variants.SetVariantSelection(name)  # attributes can be created only in a selected variant
    with variants.GetVariantEditContext():
        yield
    variants.SetVariantSelection(shown)


def define_levels(group, counts, level_count):
    """Define levels of detail of a group's prim; returns [`Level`], the first with all strands."""
    if level_count == 1:
        return [Level(None, counts, 1)]
    paths = _define(group, _LEVEL, LEVELS[:level_count])
    return [Level(path, counts, 2**index) for index, path in enumerate(paths)]


def define_looks(stage, group, strands, present, looks, has_color, has_radial):
    """Define looks of the prims of a group and its strands; returns the path of the present look's variant.

    present: its `UsdShade.Material`; looks: {variant: `Appearance`}; has_color, has_radial: whether strands
    have colors, and a radial roughness that differs between them.
    """
    from pxr import UsdGeom, UsdShade

    scope = UsdGeom.Scope.Define(stage, group.GetPath().AppendChild("looks")).GetPath()
    materials = [usd_materials.define_material(stage, scope.AppendChild(name), look) for name, look in looks.items()]
    paths = _define(group, _LOOK, [PRESENT_LOOK, *looks])
    for path, material in zip(paths, [present, *materials], strict=True):
        with editing(stage, path):
            UsdShade.MaterialBindingAPI(strands).Bind(material)
    for path, look in zip(paths[1:], looks.values(), strict=True):
        if has_color:
            with editing(stage, path):
                _write_mean(strands, look, has_radial)
    return paths[0]


def _define(group, set_name, names):
    """Define a set of variants of a prim and select the first; returns their paths. Earlier sets are stronger."""
    variants = group.GetVariantSets().AddVariantSet(set_name)
    for name in names:
        variants.AddVariant(name)
    variants.SetVariantSelection(names[0])
    return [group.GetPath().AppendVariantSelection(set_name, name) for name in names]


def _write_mean(strands, look, has_radial):
    """Write one color, roughness and, if wanted, radial roughness of a look for all strands."""
    from pxr import Gf, Sdf, UsdGeom

    color = Gf.Vec3f(*map(float, appearance.mean_color(look)))
    primvars = UsdGeom.PrimvarsAPI(strands)
    for name in ("groom_color", "displayColor"):
        primvars.CreatePrimvar(name, Sdf.ValueTypeNames.Color3fArray, UsdGeom.Tokens.constant).Set([color])
    shaded = appearance.shaded(look)
    values = {"groom_roughness": shaded.roughness}
    if has_radial:
        values[RADIAL_ROUGHNESS] = shaded.radial_roughness
    for name, value in values.items():
        primvars.CreatePrimvar(name, Sdf.ValueTypeNames.FloatArray, UsdGeom.Tokens.constant).Set([value])
