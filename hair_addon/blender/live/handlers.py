# SPDX-License-Identifier: GPL-3.0-or-later
"""bpy.app.handlers: detection of outdated hair from depsgraph updates."""

import bpy
from bpy.app.handlers import persistent

from ..data import surface_space, usable_surfaces
from ..data.maps import strand_maps
from ..data.strands import curves, curves_objects
from ..groom import frame_faces, hidden_hair, staleness
from ..groom.dynamics import frame_folders
from ..groom.transfer import groom_settings
from ..host import running, scene_time
from ..host.notices import name_of, say
from ..materials import looks
from ..render import refused_strands
from ..render.frames import composite
from ..render.viewport import viewport
from ..settings import animated, layer_items, style_items
from . import (
    copied_faces,
    density_updates,
    evaluation,
    events,
    file_changes,
    flattened_surfaces,
    hidden_previews,
    invalidation,
    last_update,
    live_hair,
    live_layers,
    moving_surfaces,
    refused_hair,
    simulated_hair,
    stale_marks,
    stored_guide_maps,
    stroke_limits,
    strokes,
    unbaked_renders,
    unlocked_renders,
    updates,
)

# Whether a window is about to evaluate a file that was just opened, which reports all datablocks as updated.
_is_opening = False

# Whether an undo or redo may have restored guides without the hair that was written for them, or the reverse.
_is_undone = False


@persistent
def after_depsgraph_update(scene, depsgraph):
    """Invalidate changed GPU data, and regenerate Curves with changed settings or inputs."""
    reports = updates.read(depsgraph, bpy.app.handlers.depsgraph_update_post, after_depsgraph_update)
    if not scene_time.is_shown(depsgraph):
        return
    global _is_opening, _is_undone
    copies = file_changes.follow([scene])
    is_seen = viewport.is_up_to_date()
    events.scene_changed(updates.are_only_hair(reports), updates.are_only_lamps(reports))
    _follow_scene(reports, scene, depsgraph)
    if _is_opening:
        _is_opening = False
        animated.follow(depsgraph)
        evaluation.evaluate(depsgraph, {})  # for settings that a script has changed since
        return
    deformed = updates.deformed(reports)
    moving_surfaces.shape_changed(deformed & _surfaces())
    changed = updates.originals([u for u in reports if not _is_only_carried(u, deformed)], is_geometry=True)
    transformed = updates.originals(reports, is_transform=True)
    separated = _follow_surfaces(deformed, changed, transformed, depsgraph)
    _follow_places(updates.originals(reports, is_geometry=True, is_transform=True), transformed, scene, depsgraph)
    last_update.remember_places()
    if _is_undone:
        _is_undone = False
        _follow_undo(scene, depsgraph)
    elif copies:
        simulated_hair.show_known(
            [guides for guides in frame_folders.simulating() if guides in copies], scene, depsgraph
        )
    simulated_hair.show_waiting(scene, depsgraph)
    _follow_painting(reports, {surface for surface in deformed if surface.data in changed}, depsgraph)
    combed = _follow_geometry(changed, depsgraph)
    stroke_limits.begin({u.datablock for u in reports if u.is_of(bpy.types.Object)} - {None})
    for hair in evaluation.of_kind("HAIR"):
        if hair.vellus.is_stale and hair.vellus.is_live:
            hidden_previews.hair_changed(hair, is_seen)
    animated.follow(depsgraph)
    simulated_hair.follow_settings(scene, depsgraph)
    if updates.are_only_lamps(reports) and any(map(_is_outdated, bpy.data.hair_curves)):
        events.scene_changed()  # styles may read lamps, and settings may be driven by them
    evaluation.evaluate(depsgraph, combed)
    simulated_hair.note_combed(combed, scene)
    if running.job() is None:
        stored_guide_maps.follow(reports, depsgraph)
        live_hair.follow_masks(_painted(reports), depsgraph)
        evaluation.evaluate_other_scenes(scene)
    if separated:  # last: the update of the view layer calls this handler again
        copied_faces.follow(separated, scene.view_layers[depsgraph.view_layer.name])


def _follow_scene(reports, scene, depsgraph):
    """Update the colors of guides and the compositing of hair after changes of a scene."""
    if any(report.is_of(bpy.types.Scene) for report in reports):
        looks.follow_guides(depsgraph.view_layer)
        composite.follow(scene)
    _repair_soon(scene)


def _repair_soon(scene):
    """Let a timer repair the compositing of a scene that was copied or lost its hair scene: Blender reports neither,
    and a copy may be shown by a change of its frame alone.
    """
    if composite.needs_repair(scene) and not bpy.app.timers.is_registered(composite.repair):
        bpy.app.timers.register(composite.repair)


def _follow_surfaces(deformed, changed, transformed, depsgraph):
    """Mark hair on deformed or edited surfaces; returns the objects whose copied faces were separated.

    deformed: mesh objects; changed, transformed: datablocks with changes of geometry and of transforms.
    """
    restored = flattened_surfaces.restored(_surfaces() & (deformed | {*transformed}))
    separated = []
    for surface_object in deformed | {*restored}:
        events.surface_moved(surface_object)
        # Hair waits until the surface leaves edit and paint modes, and until copies of its faces are separated.
        if surface_object.mode != "OBJECT":
            continue
        if copied_faces.separate_copies(surface_object):
            separated.append(surface_object)
        else:
            is_edited = surface_object.data in changed and not moving_surfaces.is_to_be_checked_later(surface_object)
            is_edited = is_edited or restored.get(surface_object, False)
            if flattened_surfaces.note(surface_object, is_edited):
                continue
            stale_marks.follow_surface(surface_object, depsgraph, is_edited)
    return separated


def _follow_places(moved, transformed, scene, depsgraph):
    """Mark hair that depends on the places of other objects, and preserve the density of scaled surfaces.

    moved: datablocks with changes of geometry or transforms; transformed: datablocks with changes of transforms.
    """
    stale_marks.follow_partings(moved, transformed, depsgraph)
    stale_marks.follow_flow(moved, transformed, depsgraph)
    stale_marks.follow_styles({datablock for datablock in moved if isinstance(datablock, bpy.types.Object)})
    scaled = {datablock for datablock in transformed if isinstance(datablock, bpy.types.Object)}
    density_updates.follow(scaled, depsgraph)
    density_updates.follow_units(scene, depsgraph)
    stale_marks.follow_ramps()


def _follow_undo(scene, depsgraph):
    """Show baked frames again, and mark hair that undo restored without its guides."""
    simulated_hair.show_known(frame_folders.simulating(), scene, depsgraph)
    for datablock in evaluation.of_kind("HAIR"):
        if datablock.vellus.is_live and staleness.is_left_by_undo(datablock):
            datablock.vellus.is_stale = True
        # The undo step may have been saved before painted looks were written.
        if strand_maps.has_looks(datablock.vellus):
            datablock.vellus.is_shading_stale = True


def _follow_painting(reports, edited, depsgraph):
    """Mark guides and hair that use painted images, or values of edited mesh objects."""
    if any(report.is_of(bpy.types.Image, bpy.types.World) for report in reports):
        events.image_changed()
    painted = {report.datablock for report in reports if report.is_of(bpy.types.Image)} - {None}
    _mark_painted(painted, depsgraph)
    stale_marks.follow_mapped_surfaces(edited)
    stale_marks.follow_wet_places(edited, painted)
    live_layers.follow_masks({surface for surface in edited if surface.mode == "OBJECT"}, depsgraph)


def _follow_geometry(changed, depsgraph):
    """Discard cached data of changed meshes and Curves; returns {guide Curves that have moved: (N, 3) points}."""
    combed = {}
    for datablock in changed:
        if isinstance(datablock, bpy.types.Mesh):
            usable_surfaces.forget_orientation(datablock)
        if isinstance(datablock, bpy.types.Curves):
            events.curves_reported(datablock)
            if datablock.vellus.kind == "GUIDES" and last_update.have_guides_moved(datablock):
                combed[datablock] = strokes.follow(datablock, depsgraph)
    return combed


def _surfaces():
    """Return the objects that strands grow on."""
    return {datablock.surface for datablock in bpy.data.hair_curves} - {None}


def _is_only_carried(update, deformed):
    """Whether hidden Curves are reported only because their surface moved: Curves that were tagged have all flags."""
    datablock = update.datablock
    if not isinstance(datablock, bpy.types.Curves) or datablock.surface not in deformed:
        return False
    return hidden_hair.is_hidden(datablock) and not (update.is_transform or update.is_shading)


def _painted(reports):
    """Return the mesh objects in a paint mode whose colors or weights may have changed."""
    found = {o for o in updates.deformed(reports) if o.mode in {"WEIGHT_PAINT", "VERTEX_PAINT"}}
    if not any(report.is_of(bpy.types.Image) for report in reports):
        return found
    surfaces = {curves.grown_on(hair) for hair in evaluation.of_kind("HAIR")} - {None}
    return found | {surface for surface in surfaces if surface.mode == "TEXTURE_PAINT"}


def _is_outdated(datablock):
    """Whether guides or hair are about to be evaluated."""
    return datablock.vellus.is_live and (datablock.vellus.is_stale or datablock.vellus.is_shading_stale)


def _mark_painted(images, depsgraph):
    """Mark guides and hair as stale if their images were painted: roots stay if the pixels did not change."""
    names = {name_of(image) for image in images}
    painting = set()
    stale_marks.follow_mapped_images(images)
    for datablock in bpy.data.hair_curves:
        surface, used = curves.grown_on(datablock), stale_marks.images_of(datablock)
        if surface is None or not used:
            continue
        if not datablock.vellus.is_live:
            datablock.vellus.is_stale = datablock.vellus.is_stale or bool(used & names)
            continue
        uid = surface.session_uid
        if surface.mode == "TEXTURE_PAINT":
            painting.add(uid)
        if used & names or (last_update.painting_cache.get(uid) and uid not in painting):
            stale_marks.follow_images(datablock, depsgraph)
    last_update.painting_cache.clear()
    for uid in painting:
        last_update.painting_cache.keep(uid, True)


@persistent
def before_frame_change(_scene, _depsgraph):
    """Remember setting values, to detect animated changes, and let `after_other_handlers` run last."""
    animated.remember()
    after = bpy.app.handlers.frame_change_post
    if after_other_handlers in after and after[-1] is not after_other_handlers:
        after.remove(after_other_handlers)
        after.append(after_other_handlers)


@persistent
def after_frame_change(scene, depsgraph):
    """Deform strands with their surfaces; regenerate animated hair, in renders too."""
    reports, edited = updates.read(depsgraph, bpy.app.handlers.frame_change_post, after_frame_change), set()
    if scene_time.is_shown(depsgraph):
        events.scene_changed(is_hair_only=updates.are_only_hair_in_frame(reports))
        for report in reports:
            if report.is_geometry and updates.type_of_object(report) == "CURVES":
                events.hair_evaluated(report.datablock)
        deformed = updates.deformed(reports)
        edited = _edited_by_script(reports, deformed)
        moving_surfaces.frame_changed(deformed & _surfaces())
        frame_faces.note(deformed & _surfaces() - edited, depsgraph)
        for surface_object in deformed:
            events.surface_moved(surface_object)
        _repair_soon(scene)
    if not scene_time.may_write(scene, depsgraph):
        unlocked_renders.note(scene)
        return
    is_render = scene_time.is_rendered(depsgraph)
    try:
        combed = _follow_script(reports, edited, scene, depsgraph)
        moved = live_layers.follow_frame(depsgraph) | combed
        have_ramps_changed = stale_marks.follow_keyed_ramps(depsgraph)
        is_outdated = (
            not is_render and not scene_time.is_shown_moving() and any(map(_is_outdated, bpy.data.hair_curves))
        )
        if animated.follow(depsgraph) or have_ramps_changed or moved or is_outdated:
            _evaluate_in_frame(moved, combed, scene, depsgraph)
    finally:
        simulated_hair.follow_frame(scene, depsgraph)
        if is_render:
            live_hair.write_all()


@persistent
def after_other_handlers(scene, depsgraph):
    """Follow meshes and guides that handlers of scripts have edited since `after_frame_change`, after which scripts
    read hair.
    """
    if not _have_others() or not scene_time.may_write(scene, depsgraph):
        return
    if (
        _have_others(bpy.app.handlers.frame_change_post)
        and _follow_edited_meshes()
        and scene_time.is_rendered(depsgraph)
    ):
        live_hair.write_all()
    moved = _moved_guides(bpy.data.hair_curves, depsgraph)
    if moved:
        _evaluate_in_frame(moved, moved, scene, depsgraph)


def _evaluate_in_frame(moved, combed, scene, depsgraph):
    """Evaluate outdated hair, and hair of moved guides; combed: those of them that a script has moved."""
    is_render = scene_time.is_rendered(depsgraph)
    # A render may subdivide surfaces differently; hair is rooted on the viewport's mesh.
    evaluation.evaluate(bpy.context.evaluated_depsgraph_get() if is_render else depsgraph, moved)
    simulated_hair.note_combed(combed, scene)
    if is_render:
        live_hair.write_all()


def _follow_edited_meshes():
    """Follow meshes of surfaces that handlers of scripts have edited in this frame; returns whether there are any.

    Evaluating them reports them to `after_depsgraph_update`.
    """
    meshes = {one.data for one in _surfaces() if one.type == "MESH" and one.mode == "OBJECT"}
    are_moved = [*map(last_update.has_mesh_moved, meshes)]
    if any(are_moved):
        bpy.context.evaluated_depsgraph_get()
    return any(are_moved)


def _have_others(frame_handlers=None):
    """Whether scripts or other add-ons have handlers of frames; frame_handlers: one of Blender's two lists, or both."""
    own = before_frame_change, after_frame_change, after_other_handlers
    both = *bpy.app.handlers.frame_change_pre, *bpy.app.handlers.frame_change_post
    return any(handler not in own for handler in (both if frame_handlers is None else frame_handlers))


def _edited_by_script(reports, deformed):
    """Return the surfaces whose meshes a script edited just before it changed the frame, or in a handler before that;
    no other update reports them.

    Animated meshes are reported in each frame, edited or not. Playback without such handlers begins after an update.
    """
    is_moving = scene_time.is_shown_moving()
    if is_moving and not _have_others(bpy.app.handlers.frame_change_pre):
        return set()
    meshes = {mesh for mesh in updates.originals(reports, is_geometry=True) if isinstance(mesh, bpy.types.Mesh)}
    reported = [one for one in deformed & _surfaces() if one.data in meshes]
    doubtful = {one.data for one in reported if is_moving or _is_animated(one.data)}
    unchanged = {mesh for mesh in doubtful if not last_update.has_mesh_moved(mesh)}
    return {one for one in reported if one.data not in unchanged}


def _is_animated(mesh):
    return any(one is not None and one.animation_data is not None for one in (mesh, mesh.shape_keys))


def _follow_script(reports, edited, scene, depsgraph):
    """Follow surfaces that a script edited, and guides that it moved, just before it changed the frame.

    Returns {guide Curves that have moved: None}, whose points are read later, as settings of the frame may change them.
    """
    have_others = _have_others()
    if _is_opening or (scene_time.is_shown_moving() and not have_others):
        return {}
    if edited:
        separated = _follow_surfaces(edited, {one.data for one in edited}, [], depsgraph)
        stale_marks.follow_mapped_surfaces(edited)
        live_layers.follow_masks({one for one in edited if one.mode == "OBJECT"}, depsgraph)
        if separated:
            copied_faces.follow(separated, scene.view_layers[depsgraph.view_layer.name])
    # Guides that a handler has just moved are not reported yet.
    return _moved_guides(
        bpy.data.hair_curves if have_others else updates.originals(reports, is_geometry=True), depsgraph
    )


def _moved_guides(datablocks, depsgraph):
    """Return {guide Curves among datablocks that have moved: None}."""
    guides = [one for one in datablocks if isinstance(one, bpy.types.Curves) and one.vellus.kind == "GUIDES"]
    return dict.fromkeys(_follow_geometry(guides, depsgraph))


def _show_hidden():
    """Let Blender evaluate all hair; what Material Preview hides is hidden again a moment later."""
    moving_surfaces.resume()
    hidden_hair.show_all()


@persistent
def before_reading(*_args):
    """Write hair before a save or a render reads its Curves, and update the hair scene that a render composites."""
    _show_hidden()
    stale_marks.follow_applied()
    live_layers.record_all()
    live_hair.write_all()
    file_changes.follow(bpy.data.scenes)
    if bpy.app.background:  # in a window a timer repairs, as a render runs in parallel
        composite.repair()
    composite.follow_all()


@persistent
def before_rendering(*_args):
    """Forget the hair that earlier renders refused."""
    refused_hair.begin()


@persistent
def before_rendered_frame(scene, *_args):
    """Refuse or report a frame in which another engine would render baked hair as it is combed."""
    unbaked_renders.before_frame(scene)


@persistent
def before_saving(*_args):
    """Store in the file where its baked frames and surfaces are, so that they are found under another file name; report
    changes that the file does not store.
    """
    frame_folders.remember()
    for datablock in bpy.data.hair_curves:
        surface_space.remember_place(datablock)
        if datablock.vellus.kind == "HAIR" and groom_settings.has_unsaved_changes(datablock):
            sentence = '"{name}" is a library override: the file does not store its other settings. Make it local.'
            datablock.vellus.status = sentence.format(name=name_of(datablock))
            say(datablock.vellus.status)


@persistent
def after_import(context=None, *_args):
    """Make names of styles and layers readable for Blender's rename operators; show hair that was saved hidden.

    context: Blender's list of what was imported, None for a whole file: nodes alone bring no hair.
    """
    if context is not None and all(item.id_type == "NODETREE" for item in context.import_items):
        return
    _show_hidden()
    file_changes.accept_state()
    for hair in evaluation.of_kind("HAIR"):
        style_items.make_names_readable(hair.vellus.styles, style_items.default_name)
    for guides in evaluation.of_kind("GUIDES"):
        style_items.make_names_readable(guides.vellus.layers, lambda _item: layer_items.FIRST_NAME)


@persistent
def after_load(*_args):
    """Take the hair of a file as up to date. Without a window Blender reports no update of the file, so baked frames
    are shown here.
    """
    global _is_opening, _is_undone
    _is_opening = not bpy.app.background
    _is_undone = True  # does not affect a file that was saved during a stroke
    after_import()
    live_hair.cancel_writing()
    live_layers.cancel()
    invalidation.clear()
    file_changes.accept_state()
    stale_marks.follow_applied()
    file_changes.follow(bpy.data.scenes)
    _hide_drawn_hair()
    composite.follow_all()  # a file does not store that linked hair is hidden from other engines
    if bpy.app.background and any(frame_folders.simulating()):
        blender_scene, depsgraph = bpy.context.scene, bpy.context.evaluated_depsgraph_get()
        simulated_hair.show_known(frame_folders.simulating(), blender_scene, depsgraph)


def _hide_drawn_hair():
    """Stop Blender from drawing hair that Vellus draws, as in older files and after the add-on was disabled."""
    for hair in evaluation.of_kind("HAIR"):
        if hair.vellus.is_drawn:
            curves_objects.draw_natively(hair, False)


def _take_over():
    """Draw the hair that Blender drew while the add-on was disabled."""
    file_changes.follow(bpy.data.scenes)
    _hide_drawn_hair()
    composite.follow_all()
    looks.follow_guides(bpy.context.view_layer)


@persistent
def after_undo(*_args):
    """Undo may restore guides without their hair."""
    global _is_undone
    _is_undone = True
    live_hair.cancel_writing()
    live_layers.cancel()
    _show_hidden()  # the undo step may have been saved while hair was hidden
    invalidation.data_replaced()
    file_changes.accept_state()


@persistent
def after_render(scene, *_args):
    """Report the hair that a render could not show."""
    unlocked_renders.end(scene)
    refused_hair.end(scene)


@persistent
def after_playing(*_args):
    """Restore the playback settings that Play from Start has changed, and let Blender deform hair again."""
    simulated_hair.end()
    moving_surfaces.resume()


_HANDLERS = (
    (bpy.app.handlers.depsgraph_update_post, after_depsgraph_update),
    (bpy.app.handlers.frame_change_pre, before_frame_change),
    (bpy.app.handlers.frame_change_post, after_frame_change),
    (bpy.app.handlers.frame_change_post, after_other_handlers),
    (bpy.app.handlers.animation_playback_post, after_playing),
    (bpy.app.handlers.save_pre, before_reading),
    (bpy.app.handlers.save_pre, before_saving),
    (bpy.app.handlers.render_init, before_reading),
    (bpy.app.handlers.render_init, before_rendering),
    (bpy.app.handlers.render_pre, before_rendered_frame),
    (bpy.app.handlers.render_complete, after_render),
    (bpy.app.handlers.render_cancel, after_render),
    (bpy.app.handlers.undo_post, after_undo),
    (bpy.app.handlers.redo_post, after_undo),
    (bpy.app.handlers.load_post, after_load),
    (bpy.app.handlers.blend_import_post, after_import),
)


def register():
    """Add the handlers."""
    for handlers, handler in _HANDLERS:
        handlers.append(handler)
    hidden_previews.register()
    # Blender gives no access to the file while it enables an add-on.
    bpy.app.timers.register(_take_over)


def unregister():
    """Remove the handlers, write pending hair, and stop compositing hair over other engines' renders."""
    for handlers, handler in _HANDLERS:
        handlers.remove(handler)
    offers = unlocked_renders.offer, refused_hair.offer, refused_strands.show_in_panels
    for timer in (_take_over, *offers, composite.repair):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    simulated_hair.end()
    moving_surfaces.resume()
    hidden_previews.unregister()
    density_updates.unregister()
    live_hair.write_all()
    live_hair.cancel_writing()  # of hair that waits for its next evaluation
    composite.suspend()
