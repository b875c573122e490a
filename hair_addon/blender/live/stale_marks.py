# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks guides and hair as stale when their inputs have changed; handlers regenerate them later."""

from contextlib import contextmanager

import bpy

from ...core.errors import HairError
from ..data import masks, scene, usable_surfaces
from ..data.strands import curves, drawn_lines, gathered_groups
from ..groom import bindings, frame_faces, staleness
from ..groom.surfaces import applied_transforms, edited_surfaces, kept_densities
from ..groom.surfaces.edited_surfaces import Followed
from ..host import scene_time
from ..host.notices import text_of
from ..settings import animated, marks, ramp_nodes, style_items
from . import events, last_update


def follow_surface(surface_object, depsgraph, is_mesh_edited):
    """Transform the guides of a possibly edited surface, and update the hair between them.

    is_mesh_edited: whether the mesh itself has changed, not only modifiers, so that its weights may have changed too.
    """
    carried = set()  # guides without Auto Update that have followed
    in_place = set()  # hair that an applied transform has left in place
    for guides in bpy.data.hair_curves:
        if guides.surface != surface_object or not _is_carried(guides):
            continue
        followed = _carry_guides(guides, depsgraph, is_mesh_edited)
        if followed is Followed.NOTHING:
            continue
        if not guides.vellus.is_live:
            carried.add(guides)
            continue
        redrawn = set(applied_transforms.followed_by(guides)) if followed is Followed.APPLIED else set()
        mark_followers(guides, redrawn)
        in_place |= redrawn
    edited_surfaces.follow_alone(surface_object, depsgraph, last_update.place_before)
    if is_mesh_edited:
        _follow_edited_mesh(surface_object, depsgraph, carried, in_place)


def _carry_guides(guides, depsgraph, is_mesh_edited):
    """Move guides with their surface, and mark them if their masks or their number differ; returns `Followed`.

    Errors become the guides' status.
    """
    state = guides.vellus
    try:
        place = last_update.place_before(guides)
        followed = edited_surfaces.follow_surface(guides, depsgraph, place, state.is_live)
        was_edited = followed is not Followed.NOTHING
        if was_edited:
            _strands_carried(guides)
        if not state.is_live:
            state.is_stale = state.is_stale or (is_mesh_edited and not was_edited)
            return followed
        # Masks limit its roots. Weights on another frame's faces cannot be compared.
        is_placed = not (curves.is_hand_made(guides) or frame_faces.are_others(guides))
        if is_mesh_edited and not was_edited and is_placed and _may_be_painted(guides, depsgraph):
            state.is_stale = True
        elif was_edited and is_placed and kept_densities.have_other_number(guides, depsgraph):
            state.is_stale = True
    except HairError as error:
        state.status = str(error)
        return Followed.NOTHING
    return followed


def _follow_edited_mesh(surface_object, depsgraph, carried, in_place):
    """Mark hair whose surface has other weights or partings; carried, in_place: as in `follow_surface`."""
    for hair in bpy.data.hair_curves:
        state = hair.vellus
        if curves.grown_on(hair) != surface_object or state.kind != "HAIR":
            continue
        if not state.is_live:
            state.is_stale = state.is_stale or state.guide_curves not in carried
            continue
        if frame_faces.are_others(hair):
            continue
        with _refusal_as_status(hair):
            if _may_be_painted(hair, depsgraph) or staleness.has_other_parting(hair, depsgraph):
                _mark(hair)
            elif style_items.have_masks(state) and hair not in in_place:
                state.is_stale = True


def _strands_carried(guides):
    """Draw guides and the hair between them as an edit has left them; Blender reports them only in its next update."""
    for datablock in (guides, *curves.followers(guides)):
        events.strands_computed(datablock)


def follow_applied():
    """Move hair whose surface had a transform applied without a report: in a file, or while Vellus was disabled."""
    due = {datablock.surface for datablock in bpy.data.hair_curves if applied_transforms.is_due(datablock)}
    for surface_object in due:
        if surface_object.type == "MESH" and surface_object.mode == "OBJECT":
            depsgraph = scene.present_depsgraph()
            if usable_surfaces.is_in(surface_object, depsgraph):
                follow_surface(surface_object, depsgraph, False)


@contextmanager
def _refusal_as_status(target):
    """Show a `HairError` as the status of guides or hair, and mark them as stale.

    Regenerating them raises the error again while the reason lasts, and clears the status afterwards. Bound hair would
    pass for up to date, as its settings are unchanged.
    """
    try:
        yield
    except HairError as error:
        target.vellus.status = str(error)
        _mark(target)


def _is_carried(datablock):
    """Whether an edited surface moves Curves: guides and kept hair; other hair is regenerated."""
    kind = datablock.vellus.kind
    return kind == "GUIDES" or (kind == "HAIR" and curves.is_hand_made(datablock))


def _may_be_painted(target, depsgraph):
    """Whether weights that limit roots have changed; nothing is read without a vertex group."""
    return masks.of_curves(target).group != "" and staleness.has_other_mask(target, depsgraph)


def follow_mask(guides, depsgraph):
    """Mark hair as stale if the mask of its guides has changed; the guides may be unchanged."""
    for hair in curves.followers(guides):
        state = hair.vellus
        if not state.is_live or hair.surface is None:
            continue
        with _refusal_as_status(hair):
            if not masks.own(state.hair) and staleness.has_other_mask(hair, depsgraph):
                _mark(hair)


def follow_partings(changed, transformed, depsgraph):
    """Mark hair as stale if its part lines or guide regions are among `changed` datablocks and differ.

    transformed: datablocks with another transform; part lines stay on such a surface only as its children.
    """
    for hair in bpy.data.hair_curves:
        state = hair.vellus
        if state.kind != "HAIR" or not _parts_by(hair, changed, transformed):
            continue
        if not state.is_live:
            state.is_stale = True
            continue
        with _refusal_as_status(hair):
            if staleness.has_other_parting(hair, depsgraph):
                _mark(hair)


def follow_flow(changed, transformed, depsgraph):
    """Mark guides as stale if their flow lines have moved on the surface, or the part lines that divide the flow.

    Part lines do not concern combed guides. Arguments as for `follow_partings`.
    """
    for guides in bpy.data.hair_curves:
        state = guides.vellus
        lines = text_of(state.guides, "flow_lines")
        if state.kind != "GUIDES" or not lines:
            continue
        if not drawn_lines.have_moved(lines, guides.surface, changed, transformed) and not (
            _is_parted_anew(guides, changed, transformed) and not curves.is_combed(guides)
        ):
            continue
        if not state.is_live:
            state.is_stale = True
            continue
        with _refusal_as_status(guides):
            if staleness.has_other_flow(guides, depsgraph):
                state.is_stale = True


def _is_parted_anew(guides, changed, transformed):
    """Whether hair of guides with flow lines may have other part lines."""
    return any(
        hair.vellus.is_stale
        or drawn_lines.have_moved(text_of(hair.vellus.hair, "part_lines"), guides.surface, changed, transformed)
        for hair in curves.followers(guides)
    )


def _parts_by(hair, changed, transformed):
    state = hair.vellus
    if drawn_lines.have_moved(text_of(state.hair, "part_lines"), curves.grown_on(hair), changed, transformed):
        return True
    # Each step of a stroke would read the guides, so they are read only if they have a region attribute or ties.
    guides, names = state.guide_curves, (text_of(state.hair, "region_attribute"), gathered_groups.TIE)
    if guides is None or guides not in changed:
        return False
    return any(name in guides.attributes for name in names) or _was_parted_by_ties_alone(hair)


def _was_parted_by_ties_alone(hair):
    settings, bound = hair.vellus.hair, bindings.of(hair)
    others = text_of(settings, "region_group"), text_of(settings, "part_lines")
    key = hair.vellus.parting_key if bound is None else bound.parting_key
    return key != "" and text_of(settings, "region_attribute") == gathered_groups.NAME and not any(others)


def images_of(target):
    """Return the names of the images that mask guides or hair; hair does not include its guides' image."""
    state = target.vellus
    if state.kind == "GUIDES":
        return {text_of(state.guides, "density_image")} - {""}
    of_styles = {style_items.masks_of(item)[1] for item in state.styles}
    return {text_of(state.hair, "density_image"), *of_styles} - {""}


def follow_images(target, depsgraph):
    """Mark guides or hair as stale if their images were painted. Roots wait until Texture Paint is left.

    Blender also reports unchanged images, for example after undo. Regenerating hair for these would change the hair of
    a surface that has been scaled since.
    """
    state = target.vellus
    masking = text_of(state.guides if state.kind == "GUIDES" else state.hair, "density_image")
    if curves.grown_on(target).mode == "TEXTURE_PAINT":
        state.is_stale = True
        return
    bound = bindings.of(target)
    is_painted = state.status not in ("", "" if bound is None else bound.map_status)
    with _refusal_as_status(target):
        is_painted = is_painted or (state.kind == "HAIR" and staleness.has_other_style_images(target))
        if masking and staleness.has_other_mask(target, depsgraph):
            is_painted = True
            if state.kind == "HAIR":
                bindings.invalidate(target)
    state.is_stale = state.is_stale or is_painted


def _mapped():
    """Return [(hair or guides, map)] of maps with an effect: combed guides do not change by maps of their growth."""
    return [(one, item) for one in bpy.data.hair_curves for item in one.vellus.maps if _has_effect(one, item)]


def _has_effect(mapped, item):
    return mapped.vellus.kind == "HAIR" or item.setting.startswith("dynamics.") or not curves.is_combed(mapped)


def follow_mapped_images(images):
    """Mark hair whose settings vary by any of some images, which may have been painted."""
    for _mapped_curves, item in _mapped() if images else ():
        if item.kind == "IMAGE" and item.image in images:
            marks.mark_changed_map(item)


def follow_mapped_surfaces(surfaces):
    """Mark hair whose settings vary by weights or attributes of any of some surfaces, which may have been painted."""
    for mapped, item in _mapped() if surfaces else ():
        if curves.grown_on(mapped) in surfaces and item.kind in {"GROUP", "ATTRIBUTE", "IMAGE"}:
            marks.mark_changed_map(item)


def follow_wet_places(surfaces, images):
    """Mark the simulation of guides as stale if a mask of their wetness may have been painted: an image among `images`,
    or a mask on a surface among `surfaces`.
    """
    for hair in bpy.data.hair_curves if surfaces or images else ():
        guides = hair.vellus.guide_curves
        if guides is None or hair.vellus.kind != "HAIR" or not guides.vellus.simulates:
            continue
        for item in hair.vellus.styles:
            mask, image = style_items.masks_of(item) if item.kind == "WET" else ("", "")
            is_painted = (mask or image) and guides.surface in surfaces
            is_reported = image and any(text_of(painted, "name") == image for painted in images)
            if is_painted or (is_reported and _has_other_style_images(hair)):
                guides.vellus.is_dynamics_stale = True


def _has_other_style_images(hair):
    try:
        return staleness.has_other_style_images(hair)
    except HairError:  # the hair's status says so
        return True


def follow_ramps():
    """Mark hair and guides with an edited ramp of the thickness or of a map, which Blender does not report.

    A copy of hair gets ramps of its own.
    """
    owners = {}
    for hair in bpy.data.hair_curves:
        state = hair.vellus
        if state.kind == "HAIR" and state.thickness_ramp is not None:
            _own_ramp(state, "thickness_ramp", owners)
            is_other = ramp_nodes.text_of(state.thickness_ramp) != state.thickness_key
            if is_other and (curves.is_hand_made(hair) or not curves.is_combed(hair)):
                state.is_stale = True
        for item in state.maps:
            for name in ("ramp", "course"):
                if getattr(item, f"{name}_tree") is not None:
                    _own_ramp(item, f"{name}_tree", owners)
                    _follow_ramp_of_map(hair, item, name)


def follow_keyed_ramps(depsgraph):
    """Mark hair and guides if keyed color ramps of their maps have changed in a frame; returns whether any has."""
    is_render, is_changed = scene_time.is_rendered(depsgraph), False
    for hair in bpy.data.hair_curves:
        for item in animated.keyed_ramps(hair) if hair.is_editable else ():
            if is_render:  # Blender animates the original ramps only for viewports
                ramp_nodes.copy_colors(item.ramp_tree, item.ramp_tree.evaluated_get(depsgraph))
            is_changed = _follow_ramp_of_map(hair, item, "ramp") or is_changed
    return is_changed


def _follow_ramp_of_map(hair, item, name):
    """Mark hair if the ramp of its map has changed since the last update; returns whether it has."""
    key = ramp_nodes.text_of(getattr(item, f"{name}_tree"))
    is_changed = key != getattr(item, f"{name}_key") and hair.is_editable
    if is_changed:
        setattr(item, f"{name}_key", key)
        if _has_effect(hair, item):
            marks.mark_changed_map(item)
    return is_changed


def _own_ramp(owner, name, owners):
    """Copy the ramp of a map or a hair if another one has it; owners: {node group: the first owner's hair}."""
    tree = getattr(owner, name)
    if owners.setdefault(tree, owner.id_data) != owner.id_data and owner.id_data.is_editable:
        setattr(owner, name, tree.copy())


def follow_styles(changed):
    """Mark hair as stale if its styles read any of the `changed` objects, or read objects and its surface changed."""
    for hair in bpy.data.hair_curves:
        state = hair.vellus
        if state.kind != "HAIR" or not state.styles:
            continue
        named = style_items.objects_named(state)
        if named and (curves.grown_on(hair) in changed or any(bpy.data.objects.get(name) in changed for name in named)):
            state.is_stale = True


def mark_followers(guide_curves, redrawn=()):
    """Mark all hair between some guides as stale, except kept hair that has followed them.

    Only redraw hair in `redrawn`.
    """
    for hair in curves.followers(guide_curves):
        if hair in redrawn:
            events.strands_computed(hair)
        elif not (curves.is_hand_made(hair) and hair.vellus.followed == staleness.guides_digest(guide_curves)):
            _mark(hair)


def _mark(hair):
    """Mark hair as stale, even if it was regenerated since it was written."""
    bindings.invalidate(hair)
    hair.vellus.is_stale = True
