# SPDX-License-Identifier: GPL-3.0-or-later
"""Problems with a surface or its hair, each with the operator that fixes it.

Panels call these functions on every redraw: geometry is read only once after a mesh is edited.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import bpy
from bpy.types import Curves, Object

from ...data import rest_nodes, rest_sources, usable_surfaces
from ...data.strands import curves, curves_objects, delivered_hair, follow_nodes
from ...host.notices import name_of, text_of
from ...settings.translations import interface_text
from .. import bindings, frame_faces
from ..selection import has_object, is_shown
from . import copied_hair


@dataclass(frozen=True)
class Warning:
    """text: translated; operator: `bl_idname` of the operator that fixes it, empty if there is none."""

    text: str
    operator: str = ""


def warnings_of(surface: Object | None, parts: Iterable[Curves]) -> list[Warning]:
    """Return [Warning] about a mesh object, None if it is missing, and the guide and hair Curves on it."""
    partings = [warning for part in parts if part.vellus.kind == "HAIR" for warning in parting_warnings(part)]
    there = None if surface is None or usable_surfaces.is_deleted(surface) else surface
    places = () if there is None else _of_places(there, parts)
    first = [*_of_library(surface, parts), *_of_surface(there, parts), *places, *_of_uv_map(there, parts)]
    if there is not None and any(map(frame_faces.are_others, parts)):
        text = '"{name}" has other faces in this frame: hair stays on the faces of the frame in which it was generated.'
        first.append(Warning(interface_text(text, name=name_of(there))))
    flows = [warning for part in parts if part.vellus.kind == "GUIDES" for warning in flow_warnings(part)]
    return [*first, *_of_guides(parts), *dict.fromkeys([*partings, *flows])]


def parting_warnings(hair: Curves) -> list[Warning]:
    """Return [Warning] about missing part lines and region groups of a hair Curves datablock."""
    lines, group = (text_of(hair.vellus.hair, name) for name in ("part_lines", "region_group"))
    found = []
    if lines and lines not in bpy.data.objects:
        found.append(Warning(interface_text('No object "{name}": pick another part line.', name=lines)))
    surface = curves.grown_on(hair)
    if surface is not None and group and group not in surface.vertex_groups:
        text = 'No vertex group "{name}": pick another for regions.'
        found.append(Warning(interface_text(text, name=group)))
    return found


def flow_warnings(guides: Curves) -> list[Warning]:
    """Return [Warning] about missing flow lines of a guide Curves datablock."""
    name = text_of(guides.vellus.guides, "flow_lines")
    if not name or name in bpy.data.objects:
        return []
    return [Warning(interface_text('No object "{name}": pick other flow lines.', name=name))]


def modifier_notes(hair_object: Object | None) -> list[str]:
    """Return translated sentences about modifiers of a hair object (or None) that take effect only in renders."""
    if hair_object is None or not hair_object.data.vellus.is_drawn:
        return []
    shown = {name_of(m) for m in hair_object.modifiers if m.show_viewport}
    found = [name for name in follow_nodes.modifiers_of_artist(hair_object) if name not in shown]
    if not found:
        return []
    if len(found) == 1:
        return [interface_text("1 modifier shows in renders only: {name}", name=found[0])]
    sentence = "{count} modifiers show in renders only: {names}"
    return [interface_text(sentence, count=len(found), names=", ".join(found))]


def _of_library(surface, parts):
    linked = next((block for block in (surface, *parts) if block is not None and block.library is not None), None)
    if linked is not None:
        yield Warning(interface_text('"{name}" is linked: make a library override.', name=name_of(linked)))


def _of_surface(surface, parts):
    if surface is None:
        if parts:
            yield Warning(interface_text("The surface is missing: pick a mesh."), "vellus.attach_to_surface")
        return
    if any(abs(component - 1.0) > 1e-4 for component in surface.scale):
        yield Warning(interface_text("The scale is not applied."), "vellus.apply_scale")
    if usable_surfaces.is_inside_out(surface):
        yield Warning(interface_text("The mesh is inside out: hair grows inward."), "vellus.flip_normals")
    lost = rest_nodes.lost_copies(surface)
    if lost is not None:
        text = '"{name}" copies faces that are deformed already: move it up, or apply it.'
        yield Warning(interface_text(text, name=name_of(lost)))
    elif parts and rest_sources.lacks(surface, bpy.context.view_layer.depsgraph):
        text = 'Modifiers of "{name}" create faces without rest positions: hair does not follow their deformation.'
        yield Warning(interface_text(text, name=name_of(surface)))
    if surface.mode != "OBJECT" and any(part.vellus.is_stale for part in parts):
        yield Warning(interface_text("Hair updates when you leave this mode."))


def _of_places(surface, parts):
    """Yield a warning about the first hair object that is apart from its surface, or will be when the surface moves."""
    view_layer = bpy.context.view_layer
    shown = [] if view_layer is None else [o for o in view_layer.objects if o is not None and o.type == "CURVES"]
    for user in shown:
        if user.data not in parts or user.library is not None or delivered_hair.modifier_of(user) is not None:
            continue
        if user.parent not in (surface, None) and user.parent.data == surface.data:
            continue  # on a linked duplicate of the surface, wherever it is
        names = {"hair": name_of(user), "name": name_of(surface)}
        if curves_objects.is_elsewhere(user, surface):
            text = '"{hair}" was moved away from "{name}": attach it to move it back.'
        elif user.parent is None and not user.constraints and user.animation_data is None:
            text = '"{hair}" has lost its parent and stays behind when "{name}" moves: attach it.'
        else:
            continue
        yield Warning(interface_text(text, **names), "vellus.attach_to_surface")
        return


def _of_uv_map(surface, parts):
    if surface is None:
        return
    maps = surface.data.uv_layers
    if not maps:
        yield Warning(interface_text("No UV map: hair nodes need one."), "vellus.make_uv_map")
        return
    lost = next((name for name in (text_of(part, "surface_uv_map") for part in parts) if name not in maps), None)
    if lost is not None:
        text = 'UV map "{name}" is missing.' if lost else "The hair has no UV coordinates."
        yield Warning(interface_text(text, name=lost), "vellus.use_uv_map")
    elif any(part.vellus.uv_status for part in parts):
        yield Warning(interface_text("UVs overlap: hair nodes misplace strands."), "vellus.make_uv_map")


def _of_guides(parts):
    hair = [part for part in parts if part.vellus.kind == "HAIR" and is_shown(part)]
    if any(part.vellus.guide_curves is None for part in hair):
        yield Warning(interface_text("The hair has no guides: pick some."))
    elif not all(has_object(part.vellus.guide_curves) for part in hair):
        yield Warning(interface_text("The guides' object was deleted."), "vellus.restore_guides")
    elsewhere = next((part for part in hair if copied_hair.are_elsewhere(part)), None)
    if elsewhere is not None:
        values = {"hair": name_of(elsewhere), "name": name_of(elsewhere.vellus.guide_curves.surface)}
        sentence = '"{hair}" follows guides that grow on "{name}": give it guides of its own.'
        yield Warning(interface_text(sentence, **values), "vellus.make_own_guides")


def sharing_note(hair: Curves) -> str:
    """Return a translated sentence that names other hair with the same guides; empty if there is none."""
    names = ", ".join(name_of(other) for other in copied_hair.sharing(hair))
    return interface_text("Other hair follows the same guides: {names}", names=names) if names else ""


def color_note(guides: Curves) -> str:
    """Return a translated sentence if guides have the color of their clumps only after the hair changes, else empty.

    Clumps are computed with the hair, and unknown in a file that was opened and after undo.
    """
    if guides.vellus.guide_colors != "CLUMP" or bindings.with_clumps(guides) is not None:
        return ""
    have_clumps = any(curves.has_clumps(hair) for hair in curves.followers(guides))
    return interface_text("Clumps are colored after the next change of the hair.") if have_clumps else ""
