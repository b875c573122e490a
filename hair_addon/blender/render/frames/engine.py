# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine: draws surfaces and hair with the viewport's code, at any resolution, also without a window."""

import contextlib

import bpy
import numpy as np

from ....core.errors import HairError, memory_as_sentence
from ....core.imaging import pixel_sampling
from ....core.long_work import Stopped, no_progress, part_of
from ...data import scene
from ...data.pictures import cameras, rendered_files
from ...gpu import drawing, world_texture
from ...groom.dynamics import frame_folders
from ...host import scene_time
from ...settings import setting_properties
from ...settings.translations import error_text, interface_text
from .. import data_passes, drawn_scene, film, light_groups, light_paths, mattes, motion_vectors
from ..viewport import rendered_view, viewport
from . import composite, frame_progress
from .frame_progress import FrameProgress
from .panoramic_frame import PanoramicFrame
from .tiled_frame import Frame

NAME = viewport.ENGINE

_CURVE_PARTS = 256  # samples of a shutter curve, as in Cycles
# Shares of the progress bar: of reading neighboring frames for motion vectors, and of reading within each motion step.
_NEIGHBOURS, _READING = 0.1, 0.25
_EVALUATING = "Evaluating the scene"


_listener = no_progress  # an additional progress callback of renders, which may raise `Stopped`


@contextlib.contextmanager
def listening(progress):
    """Report renders to progress(step, part) in a context; a render ends without a picture if it raises `Stopped`."""
    global _listener
    _listener = progress
    try:
        yield
    finally:
        _listener = no_progress


class VellusRenderEngine(bpy.types.RenderEngine):
    """Surfaces and hair shaded as in the viewport"""

    bl_idname = NAME
    bl_label = "Vellus"
    bl_use_gpu_context = True
    bl_use_eevee_viewport = True  # for Material Preview
    bl_use_shading_nodes_custom = False

    def update_render_passes(self, scene=None, renderlayer=None):
        """Register the passes with Blender, for sockets of the compositor and layers of multilayer files."""
        for name in _passes(renderlayer, scene.render.use_motion_blur):
            channels, kind = film.channels_of(name)
            self.register_pass(scene, renderlayer, name, len(channels), channels, kind)

    def view_update(self, context, depsgraph):
        """Do nothing: handlers process changes."""

    def view_draw(self, context, depsgraph):
        """Draw a viewport with Rendered shading."""
        try:
            if rendered_view.draw(context):
                self.tag_redraw()
        except HairError as error:
            self.error_set(error_text(error))

    def render(self, depsgraph):
        """Render a view layer in the depsgraph's frame."""
        try:
            self._render(depsgraph)
        except Stopped:
            pass  # by Esc: Blender keeps the last picture
        except HairError as error:
            self._refuse(depsgraph.scene, error_text(error))
        except KeyboardInterrupt:  # raised by a script
            self._refuse(depsgraph.scene, interface_text("Canceled: nothing was rendered."))
        except Exception as error:  # a bug must not result in a black picture
            self._refuse(depsgraph.scene, interface_text("Vellus could not render this: {error}", error=error))
            raise

    def _refuse(self, blender_scene, sentence):
        self.report({"ERROR"}, sentence)
        composite.refuse(blender_scene, sentence)

    @memory_as_sentence()
    def _render(self, depsgraph):
        blender_scene, view_layer = depsgraph.scene, depsgraph.view_layer
        self._require_renderable(blender_scene)
        size, window = scene.picture_size(blender_scene.render)
        views = self._views(view_layer)
        filmed = composite.filmed_scene(blender_scene)
        offsets = _offsets(filmed.render, filmed.vellus.motion_steps)
        wanted = _passes(view_layer, blender_scene.render.use_motion_blur)
        passes = [name for name in wanted if not mattes.is_matte(name)]
        labels = mattes.Labels(view_layer.pass_cryptomatte_depth) if len(passes) < len(wanted) else None
        film_settings = self._film_settings(depsgraph, size, passes, labels, len(offsets))
        frames = {view: self._frame(depsgraph, view, size, window, film_settings) for view in views}
        progress = FrameProgress(self, frame_progress.share_of(depsgraph), _listener)
        before = _NEIGHBOURS if "Vector" in passes else 0.0
        others = self._others(depsgraph, size, views, part_of(progress, 0.0, before)) if before else {}
        world_texture.check_image()
        progress(_EVALUATING, before)
        known, refused, noted, each = {}, {}, {}, (1.0 - before) / len(offsets)
        for index in scene_time.visit(blender_scene, offsets, self.frame_set):
            progress.moment = interface_text("Motion step {number} of {count}", number=index + 1, count=len(offsets))
            begun, end = before + each * index, before + each * (index + 1)
            drawn_from = begun + _READING * each
            with drawing.ALONE:
                reading, callbacks = part_of(progress, begun, drawn_from), (refused.__setitem__, noted.__setitem__)
                drawn = drawn_scene.read_render(depsgraph, known, *callbacks, reading)
            for number, (view, frame) in enumerate(frames.items()):
                first, last = (drawn_from + (end - drawn_from) * (number + n) / len(frames) for n in (0, 1))
                self._expose(frame, drawn, depsgraph, view, size, others.get(view), part_of(progress, first, last))
                is_last = index + 1 == len(offsets)
                if is_last or not bpy.app.background:
                    arrays = frame.arrays()
                    if labels is not None and is_last:
                        arrays |= labels.passes(frame.mattes(), view_layer)
                    self._show(view_layer, view, window, arrays, labels if is_last else None)
            progress(_EVALUATING, end)
        # Errors come last, after a picture of everything else. A command that renders to a file fails: a picture
        # without some of the hair is not a valid result.
        for error in refused.values():
            self._refuse(blender_scene, error_text(error))
        for note in noted.values():
            composite.refuse(blender_scene, error_text(note))
            if not bpy.app.background:  # already printed to the console
                self.report({"WARNING"}, error_text(note))

    def _require_renderable(self, blender_scene):
        """Raise `HairError` for an unsupported camera, frames that are not baked, and missing or damaged files."""
        _require_supported(self.camera_override)
        frames = [scene_time.frame_of(blender_scene)]
        if self.is_animation or composite.is_in_sequence(blender_scene):
            frame_folders.require_baked(frames, blender_scene)
        frame_folders.require_readable(frames, blender_scene)
        if _listener is no_progress:  # `io.pictures.frames` checks by itself
            self._check_files(blender_scene)

    def _film_settings(self, depsgraph, size, passes, labels, step_count):
        """Return the arguments of a `Frame` after its window; motion steps share samples and paths."""
        blender_scene = depsgraph.scene
        filmed = composite.filmed_scene(blender_scene)
        sample_count = depsgraph.view_layer.samples or filmed.vellus.sample_count
        filter_width = pixel_sampling.FILTER_WINDOW * filmed.render.filter_size
        has_lens = cameras.read_lens(blender_scene, depsgraph, self.camera_override) is not None
        lens_passes = -(-pixel_sampling.LENS_PASSES // step_count) if has_lens else 1
        path_count = -(-light_paths.path_count(blender_scene, size) // step_count)
        is_transparent = blender_scene.render.film_transparent
        of_step = -(-sample_count // step_count)
        return of_step, passes, is_transparent, filter_width, lens_passes, path_count, labels, step_count

    def _expose(self, frame, drawn, depsgraph, view, size, around, progress):
        """Draw a motion step of a view; around: [`Places`] one frame before and after, None without a motion pass."""
        with drawing.ALONE:
            camera = self._camera(depsgraph, view, size)
            lens = cameras.read_lens(depsgraph.scene, depsgraph, self._camera_object(depsgraph, view))
            moving = None
            if around is not None:
                moving = motion_vectors.Motion(around[0], motion_vectors.places(drawn, *camera), around[1], size)
        frame.expose(drawn, *camera, moving, lens, progress)

    def _check_files(self, blender_scene):
        """Raise `HairError` if files are missing or damaged, in the background; in a window, show a warning."""
        wanted = blender_scene.original, [scene_time.frame_of(blender_scene)]
        if bpy.app.background:
            rendered_files.require(*wanted)
        elif names := rendered_files.missing(*wanted):
            sentence = "Files are missing or damaged: {names}; restore or relink them."
            self.report({"WARNING"}, interface_text(sentence, names=rendered_files.in_short(names)))

    def _views(self, view_layer):
        """Names of the views of a stereo picture; the empty name for other pictures."""
        result = self.begin_result(0, 0, 1, 1, layer=view_layer.name)
        names = [view.name for view in result.views]
        self.end_result(result, cancel=True)
        return names or [""]

    def _camera(self, depsgraph, view, size):
        """Return (world to view, view to clip) of a view."""
        camera, eye = self._camera_object(depsgraph, view), None
        if view and camera is not None:
            eye = self.camera_model_matrix(camera), self.camera_shift_x(camera)
        return scene.read_camera(depsgraph.scene, depsgraph, *size, camera, eye)

    def _camera_object(self, depsgraph, view):
        """Return the evaluated camera of a view, or None, and make it the engine's active view."""
        if view:
            self.active_view_set(view)
        camera = self.camera_override or depsgraph.scene.camera
        return camera and cameras.camera_of_view(depsgraph.scene, camera.original, view).evaluated_get(depsgraph)

    def _frame(self, depsgraph, view, size, window, settings):
        """Return the `Frame` or `PanoramicFrame` of a view. Raises `HairError`."""
        self._camera(depsgraph, view, size)  # raises an error if there is none
        camera = self._camera_object(depsgraph, view)
        shift = self.camera_shift_x(camera) if view and camera.type == "CAMERA" else None
        panorama = cameras.read_panorama(depsgraph.scene, camera, size, shift)
        if panorama is None:
            return Frame(size, window, *settings)
        if self.use_spherical_stereo(camera):
            raise HairError("Vellus cannot render spherical stereo: turn off Spherical Stereo of the camera.")
        *_others, labels, _step_count = settings
        if labels is not None:
            raise HairError(
                "Panoramic cameras have no mattes: turn off the passes Cryptomatte, Object Index and Material Index."
            )
        if "Vector" in settings[1]:
            raise HairError("Panoramic cameras have no motion vectors: turn off the pass Vector.")
        clip = camera.data.clip_start, camera.data.clip_end
        outside = 0.0 if depsgraph.scene.vellus.is_hair_only else 1.0
        return PanoramicFrame(panorama, clip, outside, size, window, *settings)

    def _others(self, depsgraph, size, views, progress):
        """Return {view: [`Places`]} of everything one frame before and one frame after."""
        found = {view: [] for view in views}
        progress(_EVALUATING, 0.0)
        for index in scene_time.visit(depsgraph.scene, [-1.0, 1.0], self.frame_set):
            with drawing.ALONE:
                reading = part_of(progress, 0.5 * index, 0.5 * (index + 1))
                drawn = drawn_scene.read_unlit(depsgraph, {}, _ignore, _ignore, reading)
                for view, places in found.items():
                    places.append(motion_vectors.places(drawn, *self._camera(depsgraph, view, size)))
        return found

    def _show(self, view_layer, view, window, arrays, labels=None):
        """Pass the current picture of a view to Blender; labels: of its mattes, for the metadata of files."""
        result = self.begin_result(0, 0, *window[2:], layer=view_layer.name, view=view)
        for render_pass in result.layers[0].passes:
            if render_pass.name in arrays:
                render_pass.rect.foreach_set(np.ascontiguousarray(arrays[render_pass.name]).ravel())
        for name, text in ({} if labels is None else labels.metadata(view_layer)).items():
            self.get_result().stamp_data_add_field(name, text)
        self.end_result(result)


def _ignore(_datablock, _error):
    """Do nothing: hair that cannot be drawn is reported for the frame itself, not for its neighbors."""


def _passes(view_layer, is_blurred):
    """Names of the enabled passes. A frame with motion blur has no motion vectors, which would blur it again."""
    wanted = setting_properties.to_settings(view_layer.vellus, pixel_sampling.PassSettings)
    names = ["Combined"]
    if view_layer.use_pass_z:
        names.append("Depth")
    names += [name for setting, name in data_passes.SETTINGS.items() if getattr(view_layer, setting)]
    if wanted.has_denoising_data:
        names += data_passes.DENOISING
    if view_layer.use_pass_vector and not is_blurred:
        names.append("Vector")
    if view_layer.use_pass_shadow:
        names.append("Shadow")
    if wanted.has_hair_mask:
        names.append("Hair Mask")
    if wanted.has_lobes:
        names += film.LOBES
    if wanted.has_hair_shadow:
        names.append("Hair Shadow")
    return names + light_groups.pass_names(view_layer) + mattes.pass_names(view_layer)


def _offsets(render, count):
    """Times [frames] of the motion steps, relative to the frame."""
    if not render.use_motion_blur or render.motion_blur_shutter <= 0.0:
        return [0.0]
    curve = render.motion_blur_shutter_curve
    curve.initialize()
    openings = [curve.evaluate(curve.curves[0], (part + 0.5) / _CURVE_PARTS) for part in range(_CURVE_PARTS)]
    shutter, position = render.motion_blur_shutter, render.motion_blur_position
    return pixel_sampling.moments(shutter, position, count, np.array(openings)).tolist()


def _require_supported(camera):
    if camera is not None and camera.type == "CAMERA" and camera.data.type not in {"PERSP", "ORTHO", "PANO"}:
        raise HairError("Vellus renders perspective, orthographic and panoramic cameras: change the camera type.")
