# SPDX-License-Identifier: GPL-3.0-or-later
"""What hair the open file holds, in words and numbers."""

from dataclasses import asdict

import bpy

from ..core import estimate
from ..core.errors import HairError
from ..core.groom import GuideSettings, HairSettings
from . import curves, properties, scene, strand_arrays, surface_checks
from .curves import followers


def open_file():
    """{name: value} of the open file's surfaces, guides and hair, and of curves that are not ours."""
    shown = bpy.context.scene.objects
    return {
        "metres_per_unit": strand_arrays.metres_per_unit(bpy.context.scene),
        "surfaces": [_surface(o) for o in shown if o.type == "MESH"],
        "guides": [_guides(c) for c in bpy.data.hair_curves if c.vellus.kind == "GUIDES"],
        "hair": [_hair(c) for c in bpy.data.hair_curves if c.vellus.kind == "HAIR"],
        "curves": [_counts(c) for c in bpy.data.hair_curves if c.vellus.kind == "NONE"],
    }


def _surface(surface_object):
    mesh = surface_object.data
    uv_map = mesh.uv_layers.active.name if mesh.uv_layers.active else None
    triangles = scene.triangle_count(surface_object, bpy.context.view_layer)
    return {"name": surface_object.name, "vertices": len(mesh.vertices), "triangles": triangles, "uv_map": uv_map}


def _counts(datablock):
    return {"name": datablock.name, "strands": len(datablock.curves), "points": len(datablock.points)}


def _guides(datablock):
    return {
        **_counts(datablock),
        "surface": datablock.surface and datablock.surface.name,
        "is_combed": curves.is_combed(datablock),
        "hair": [hair.name for hair in followers(datablock)],
        "settings": _settings(lambda: properties.to_settings(datablock.vellus.guides, GuideSettings)),
        "warnings": _warnings(datablock),
    }


def _hair(datablock):
    state = datablock.vellus
    slots = state.hair.neighbour_limit if state.hair.guide_map else 0
    points = len(datablock.points) // max(1, len(datablock.curves))
    return {
        **_counts(datablock),
        "bytes": estimate.curves_bytes(len(datablock.curves), points, slots),
        "surface": datablock.surface and datablock.surface.name,
        "guides": state.guide_curves and state.guide_curves.name,
        "is_combed": curves.is_combed(datablock),
        "model": state.model,
        "settings": _settings(lambda: properties.to_settings(state.hair, HairSettings)),
        "appearance": _settings(lambda: properties.look_of(state)),
        "warnings": _warnings(datablock),
    }


def _settings(read):
    """Settings as {name: value}, or why they cannot be."""
    try:
        return asdict(read())
    except HairError as error:
        return {"error": str(error)}


def _warnings(datablock):
    """What the panel would say is amiss."""
    state = datablock.vellus
    said = [warning.text for warning in surface_checks.warnings_of(datablock.surface, [datablock])]
    return said + [status for status in (state.status, state.shading_status, state.uv_status) if status]
