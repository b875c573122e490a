# SPDX-License-Identifier: GPL-3.0-or-later
"""Compositing of hair rendered by Vellus over renders by Cycles or EEVEE.

A scene has a single render engine, so hair is rendered by another scene, the hair scene, which has the first scene as
its background set, with all of its objects in the same frames. The compositor lays its picture over the other. Hair is
hidden from the first scene's engine meanwhile.
"""

import bpy

from ....core.errors import HairError
from ....core.imaging.pixel_sampling import RenderSettings
from ...data import whole_changes
from ...data.pictures import composite_nodes
from ...data.strands import curves_objects
from ...host import running
from ...host.caches import Cache
from ...settings import setting_properties
from ..viewport import viewport

_OF_SCENE = ("camera", "world", "frame_start", "frame_end", "frame_step")
_OF_RENDER = (
    *("resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y"),
    *("use_border", "border_min_x", "border_max_x", "border_min_y", "border_max_y", "use_crop_to_border"),
    *("fps", "fps_base", "frame_map_old", "frame_map_new", "filter_size", "use_lock_interface"),
    *("use_multiview", "views_format"),
    *("use_motion_blur", "motion_blur_shutter", "motion_blur_position"),
    *("use_simplify", "simplify_subdivision_render"),
)
_OWN = {"is_hair_only", "composite_shadow", "has_preview_shadow"}  # render settings that are not copied

refused_cache = Cache()  # session_uid of a hair scene → errors in the current or last render

_COMPOSITED = "vellus_use_compositing"  # custom property of the hair scene: the former `use_compositing`
_REPAIR_DELAY = 0.2  # [s] between attempts while a render runs


def is_on(blender_scene):
    """Whether hair is composited into a scene's pictures."""
    return blender_scene.vellus.hair_scene is not None or composite_nodes.has_nodes(blender_scene)


def turn_on(blender_scene):
    """Composite hair into a scene's pictures. Raises `HairError`."""
    if blender_scene.library is not None:
        raise HairError("The scene is linked from another file and cannot be changed.")
    if blender_scene.render.engine == viewport.ENGINE:
        raise HairError("The render engine Vellus renders hair with its surfaces: choose Cycles or EEVEE.")
    was_composited = blender_scene.render.use_compositing
    with whole_changes.whole_change():
        hair_scene = _new_hair_scene(blender_scene)
        try:
            composite_nodes.insert(blender_scene, hair_scene)
            hair_scene[_COMPOSITED] = was_composited
            blender_scene.render.use_compositing = True
            blender_scene.vellus.hair_scene = hair_scene
            follow(blender_scene)
        except BaseException:
            blender_scene.render.use_compositing = was_composited
            _leave(blender_scene)
            raise


def turn_off(blender_scene):
    """Undo `turn_on`, except for changes by the artist since."""
    hair_scene = blender_scene.vellus.hair_scene
    _leave(blender_scene)
    if hair_scene is not None and _is_ours(hair_scene):
        blender_scene.render.use_compositing = bool(hair_scene[_COMPOSITED])
        if not _users_of(hair_scene):
            _remove(hair_scene)
    follow_all()  # another scene may contain and composite the same hair


def _leave(blender_scene):
    """Remove the nodes, and show hair to Cycles and EEVEE again."""
    composite_nodes.remove(blender_scene)
    blender_scene.vellus.hair_scene = None
    for hair_object in _hair_objects(blender_scene):
        curves_objects.show_again(hair_object)


def _is_ours(hair_scene):
    """Whether a hair scene was made by `turn_on`, and not chosen by an artist."""
    return hair_scene.library is None and _COMPOSITED in hair_scene


def _users_of(hair_scene):
    """Return the scenes whose hair a hair scene renders."""
    return [one for one in bpy.data.scenes if one.vellus.hair_scene == hair_scene]


def _remove(hair_scene):
    """Remove a hair scene, unless an artist has added objects; then it belongs to the artist."""
    if hair_scene.collection.objects or hair_scene.collection.children:
        del hair_scene[_COMPOSITED]
    else:
        bpy.data.scenes.remove(hair_scene)


def suspend():
    """Let Cycles and EEVEE render hair until `follow_all`, as nothing else renders it without the add-on."""
    for blender_scene in bpy.data.scenes:
        if blender_scene.vellus.hair_scene is not None and blender_scene.library is None:
            composite_nodes.adjust(blender_scene, False, False)
        for hair_object in _hair_objects(blender_scene):
            curves_objects.show_again(hair_object)


def follow_all():
    """`follow` every scene of the file."""
    for blender_scene in list(bpy.data.scenes):
        follow(blender_scene)


def follow(blender_scene):
    """Update the hair scene, the compositor and the hair's visibility from a scene.

    Unchanged values are not written.
    """
    state = blender_scene.vellus
    if state.hair_scene is None:
        return
    is_its = _is_ours(state.hair_scene) and state.hair_scene.background_set == blender_scene
    if is_its and blender_scene.library is None:
        _update_hair_scene(blender_scene, state.hair_scene)
    for hair_object in _hair_objects(blender_scene):
        curves_objects.hide_from_engines(hair_object, is_seen_by_rays=state.composite_shadow == "ENGINE")


def needs_repair(blender_scene):
    """Whether a scene's hair scene belongs to the scene it was copied from, was deleted, or lost its background set.

    A hair scene that was chosen by an artist is left alone.
    """
    if blender_scene.library is not None:
        return False
    hair_scene = blender_scene.vellus.hair_scene
    if hair_scene is None:
        return composite_nodes.have_lost_scene(blender_scene)
    return _is_ours(hair_scene) and hair_scene.background_set != blender_scene


def repair():
    """Give copies of scenes their own hair scene, and turn compositing off if the hair scene was deleted.

    Must not be called during a depsgraph update, as it creates and removes datablocks. As a timer it waits for the end
    of a render, whose thread reads the nodes: returns the time [s] to the next call, None once it is done.
    """
    if running.is_rendering():
        return _REPAIR_DELAY
    for blender_scene in list(bpy.data.scenes):
        if needs_repair(blender_scene):
            hair_scene = blender_scene.vellus.hair_scene
            if hair_scene is None:
                turn_off(blender_scene)
            elif hair_scene.background_set not in _users_of(hair_scene):  # changed or cleared by an artist
                hair_scene.background_set = blender_scene
                follow(blender_scene)
            else:
                _separate(blender_scene)
                follow(blender_scene)
    return None


def refuse(hair_scene, sentence):
    """Store an error of a render if the scene is a hair scene, as Blender only prints it."""
    if _is_of_another(hair_scene):
        errors = refused_cache.get(hair_scene.original.session_uid, list)
        errors += [] if sentence in errors else [sentence]


def refusals(blender_scene):
    """Errors of the hair in the last render of a scene."""
    hair_scene = blender_scene.vellus.hair_scene
    return [] if hair_scene is None else refused_cache.get(hair_scene.session_uid) or []


def _is_of_another(blender_scene):
    return bool(_users_of(blender_scene.original))


def filmed_scene(blender_scene):
    """Return the scene whose samples and shutter a render uses.

    For a hair scene this is its background set, whose keyframes apply in each frame.
    """
    is_composited = _is_ours(blender_scene) and blender_scene.background_set is not None
    return blender_scene.background_set if is_composited else blender_scene


def is_in_sequence(blender_scene):
    """Whether a scene is rendered as a hair scene in an animation, or without a window.

    In renders for the compositor, Blender does not set the engine's `is_animation`. Without a window it is unknown, and
    nothing was played.
    """
    if not _is_of_another(blender_scene):
        return False
    renders = (one for one in running.found() if one.bl_idname == "RENDER_OT_render")
    is_animation = any(one.properties.animation for one in renders)
    return is_animation or bpy.app.background


def _separate(blender_scene):
    """Give a copy of a scene its own hair scene in place of the original's, or none if it has no nodes for it."""
    state = blender_scene.vellus
    of_original, state.hair_scene = state.hair_scene, None
    if composite_nodes.are_of(blender_scene, of_original):
        hair_scene = _new_hair_scene(blender_scene)
        hair_scene[_COMPOSITED] = of_original.get(_COMPOSITED, True)
        composite_nodes.lay_over(blender_scene, hair_scene)
        state.hair_scene = hair_scene


def _update_hair_scene(blender_scene, hair_scene):
    """Copy shared settings of a scene to its hair scene, and adjust the scene's nodes."""
    state = blender_scene.vellus
    is_ours = blender_scene.render.engine == viewport.ENGINE
    _copy(blender_scene, hair_scene, _OF_SCENE)
    _copy(blender_scene.render, hair_scene.render, _OF_RENDER)
    _copy_shutter_curve(blender_scene.render.motion_blur_shutter_curve, hair_scene.render.motion_blur_shutter_curve)
    _copy(state, hair_scene.vellus, [n for n in setting_properties.names_of(RenderSettings) if n not in _OWN])
    _copy_cameras(blender_scene, hair_scene)
    _copy_views(blender_scene.render.views, hair_scene.render.views)
    composite_nodes.adjust(blender_scene, state.composite_shadow == "PASS", not is_ours)


def _new_hair_scene(blender_scene):
    hair_scene = bpy.data.scenes.new(f"{blender_scene.name} Hair")
    hair_scene.background_set = blender_scene
    hair_scene.render.engine, hair_scene.render.film_transparent = viewport.ENGINE, True
    hair_scene.vellus.is_hair_only = True
    view_layer = hair_scene.view_layers[0]
    view_layer.use_pass_z = view_layer.vellus.has_hair_shadow = True
    return hair_scene


def _copy(source, target, names):
    for name in names:
        value = getattr(source, name)
        if getattr(target, name) != value:
            setattr(target, name, value)


def _copy_shutter_curve(source, target):
    """Copy the points of a `CurveMapping` with a single curve."""
    wanted = _points_of(source)
    if _points_of(target) == wanted:
        return
    points = target.curves[0].points
    while len(points) < len(wanted):
        points.new(0.5, 1.0)
    while len(points) > len(wanted):
        points.remove(points[1])  # ends cannot be removed
    for point, (place, kind) in zip(points, wanted, strict=True):
        point.location, point.handle_type = place, kind
    target.update()


def _points_of(mapping):
    return [(tuple(point.location), point.handle_type) for point in mapping.curves[0].points]


def _copy_cameras(blender_scene, hair_scene):
    """Copy the markers that switch cameras."""
    wanted = [(marker.frame, marker.camera) for marker in blender_scene.timeline_markers if marker.camera is not None]
    if [(marker.frame, marker.camera) for marker in hair_scene.timeline_markers] != wanted:
        hair_scene.timeline_markers.clear()
        for frame, camera in wanted:
            hair_scene.timeline_markers.new(camera.name, frame=frame).camera = camera


def _copy_views(source, target):
    """Copy the views of a stereo picture, and their camera suffixes."""
    wanted = [(view.name, view.use, view.camera_suffix) for view in source]
    if [(view.name, view.use, view.camera_suffix) for view in target] == wanted:
        return
    for view in [view for view in target if view.name not in source]:
        target.remove(view)
    for name, is_used, suffix in wanted:
        view = target.get(name) or target.new(name)
        view.use, view.camera_suffix = is_used, suffix


def _hair_objects(blender_scene):
    """Objects of hair in a scene, and in collections that are instanced in it."""
    objects = {*blender_scene.objects}
    objects |= {o for other in blender_scene.objects if other.instance_collection for o in _instanced(other)}
    return [o for o in objects if o.type == "CURVES" and o.data.vellus.kind == "HAIR"]


def _instanced(instancer):
    return instancer.instance_collection.all_objects
