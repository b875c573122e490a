# SPDX-License-Identifier: GPL-3.0-or-later
"""Summary of the hair in the open file."""

from dataclasses import asdict

import bpy

from ...core.errors import HairError
from ...core.grooming import cost
from ...core.grooming.groom import GuideSettings, HairSettings
from ..data import scene
from ..data.strands import curves, delivered_hair
from ..data.strands.curves import followers
from ..groom.dynamics import frame_folders, guide_baking
from ..groom.systems import diagnostics
from ..host import scene_time
from ..host.notices import name_of
from ..render import hair_places
from ..settings import properties, setting_properties, style_items
from . import strand_arrays


def open_file():
    """Return {name: value} of the surfaces, guides, hair and other curves in the open file."""
    shown = bpy.context.scene.objects
    return {
        "meters_per_unit": strand_arrays.meters_per_unit(bpy.context.scene),
        "surfaces": [_surface(o) for o in shown if o.type == "MESH"],
        "guides": [_guides(c) for c in bpy.data.hair_curves if c.vellus.kind == "GUIDES"],
        "hair": [_hair(c) for c in bpy.data.hair_curves if c.vellus.kind == "HAIR"],
        "curves": [_counts(c) for c in bpy.data.hair_curves if c.vellus.kind == "NONE"],
    }


def rendered_hair():
    """Return [{name, strands, surface}] of each hair object that renders of the open scene show.

    Instances are not listed apart from their object.
    """
    layers = [layer for layer in bpy.context.scene.view_layers if layer.use]
    objects = dict.fromkeys(place.hair_object for layer in layers for place in hair_places.hair_places(layer, None, ()))
    return [
        {"name": name_of(o), "strands": len(o.data.curves), "surface": o.data.surface and name_of(o.data.surface)}
        for o in objects
    ]


def _surface(surface_object):
    mesh = surface_object.data
    uv_map = name_of(mesh.uv_layers.active) if mesh.uv_layers.active else None
    triangles = scene.triangle_count(surface_object, bpy.context.view_layer)
    return {"name": name_of(surface_object), "vertices": len(mesh.vertices), "triangles": triangles, "uv_map": uv_map}


def _counts(datablock):
    return {"name": name_of(datablock), "strands": len(datablock.curves), "points": len(datablock.points)}


def _guides(datablock):
    return {
        **_counts(datablock),
        "surface": datablock.surface and name_of(datablock.surface),
        "is_combed": curves.is_combed(datablock),
        "hair": [name_of(hair) for hair in followers(datablock)],
        "settings": _settings(lambda: setting_properties.to_settings(datablock.vellus.guides, GuideSettings)),
        "simulates": datablock.vellus.simulates,
        "dynamics": _settings(lambda: properties.own_dynamics_of(datablock.vellus)),
        "baked": _baked(datablock),
        "warnings": _warnings(datablock),
    }


def _baked(guides):
    """State, missing frames and outdated parts of baked guides; None without baked frames."""
    frames = frame_folders.frames_of(guides)
    if frames is None or frames.manifest is None:
        return None
    manifest, there = frames.manifest, set(frames.frame_numbers())
    wanted = range(manifest.first, manifest.last + 1)
    return {
        "folder": str(frames.folder),
        "first": manifest.first,
        "last": manifest.last,
        "state": manifest.state,
        "missing": [number for number in wanted if number not in there or frames.fault_of(number) is not None],
        "outdated": _changed_parts(guides, manifest),
    }


def _changed_parts(guides, manifest):
    """Return the names of inputs that have changed since baking, such as settings, guides or surface."""
    if manifest.guide_count != len(guides.curves):
        return ["guides"]
    try:
        scene.present_depsgraph()  # masks are read from it, and a file that was just opened is not evaluated
        return guide_baking.changed_parts(guides, scene_time.present_scene(), manifest)
    except HairError as error:
        return [str(error)]


def _hair(datablock):
    state = datablock.vellus
    slots = state.hair.neighbour_limit if "guide_index_0" in datablock.attributes else 0
    points = len(datablock.points) // max(1, len(datablock.curves))
    return {
        **_counts(datablock),
        "bytes": cost.curves_bytes(len(datablock.curves), points, slots),
        "surface": datablock.surface and name_of(datablock.surface),
        "guides": state.guide_curves and name_of(state.guide_curves),
        "is_combed": curves.is_combed(datablock),
        "is_delivered": delivered_hair.is_delivered(datablock),
        "model": state.model,
        "settings": _settings(lambda: setting_properties.to_settings(state.hair, HairSettings)),
        "appearance": _settings(lambda: properties.own_look_of(state)),
        "styles": [_style(item) for item in state.styles],
        "warnings": _warnings(datablock),
    }


def _style(item):
    return {"kind": item.kind, "name": name_of(item)} | _settings(lambda: style_items.settings_of(item))


def _settings(read):
    """Settings as {name: value}, or the reason why they cannot be read."""
    try:
        return asdict(read())
    except HairError as error:
        return {"error": str(error)}


def _warnings(datablock):
    """Warnings shown in the panel."""
    state = datablock.vellus
    texts = [warning.text for warning in diagnostics.warnings_of(datablock.surface, [datablock])]
    return texts + [status for status in (state.status, state.shading_status, state.uv_status) if status]
