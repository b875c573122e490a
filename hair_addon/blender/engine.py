# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine: surfaces and hair by the viewport's drawing code, of any size, without a window too."""

import contextlib
import math
import time

import bpy
import numpy as np

from ..core import picture
from ..core.errors import HairError
from ..core.long_work import Stopped, unheard
from . import drawing, drawn_scene, film, motion, properties, rendered_view, scene, viewport
from .frame import Frame
from .translations import error_text, interface_text

NAME = viewport.ENGINE

_TURN = 0.002  # [s] between passes, in which a window that waits to be drawn gets its turn


_listener = unheard  # what else is told how far a render is, and may raise `Stopped` to end it


@contextlib.contextmanager
def listening(progress):
    """Tell progress(step, part) of renders, for a while; one ends without a picture where that raises `Stopped`."""
    global _listener
    _listener = progress
    try:
        yield
    finally:
        _listener = unheard


class VellusRenderEngine(bpy.types.RenderEngine):
    """Surfaces and hair as the viewport shades them"""

    bl_idname = NAME
    bl_label = "Vellus"
    bl_use_gpu_context = True
    bl_use_eevee_viewport = True  # for Material Preview
    bl_use_shading_nodes_custom = False

    def update_render_passes(self, scene=None, renderlayer=None):
        """Tell Blender which passes there will be: sockets of the compositor, layers of a multilayer file."""
        for name in _passes(renderlayer, scene.render.use_motion_blur):
            channels, kind = _KINDS.get(name, ("RGB", "COLOR"))
            self.register_pass(scene, renderlayer, name, len(channels), channels, kind)

    def view_update(self, context, depsgraph):
        """Something moved: what that is, handlers know."""

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
        except HairError as error:
            self.report({"ERROR"}, error_text(error))
        except KeyboardInterrupt:  # a script's
            self.report({"ERROR"}, interface_text("Stopped: nothing was rendered."))
        except Exception as error:  # a defect of ours must not pass a black picture off as the scene
            self.report({"ERROR"}, interface_text("Vellus could not render this: {error}", error=error))
            raise

    def _render(self, depsgraph):
        blender_scene, view_layer = depsgraph.scene, depsgraph.view_layer
        _require_supported(blender_scene, self.camera_override)
        size, window = scene.picture_size(blender_scene.render)
        moments = _moments(blender_scene.render, blender_scene.vellus.motion_steps)
        sample_count = view_layer.samples or blender_scene.vellus.sample_count
        passes = _passes(view_layer, blender_scene.render.use_motion_blur)
        film_settings = passes, blender_scene.render.film_transparent, blender_scene.render.filter_size
        frame = Frame(size, window, -(-sample_count // len(moments)), *film_settings)
        others = self._others(depsgraph, size) if "Vector" in passes else []
        known, done, in_all = {}, 0, frame.pass_count * len(moments)
        for index in self._at(blender_scene, moments):
            said = interface_text("Moment {number} of {count}", number=index + 1, count=len(moments))
            self.update_stats("", said)
            with drawing.ALONE:
                drawn = drawn_scene.read_render(depsgraph, known)
                camera = scene.read_camera(blender_scene, depsgraph, *size, self.camera_override)
                moving = motion.Motion(others[0], motion.places(drawn, *camera), others[1], size) if others else None
            for _pass in frame.expose(drawn, *camera, moving):
                done += 1
                if not bpy.app.background:
                    time.sleep(_TURN)
                self.update_progress(done / in_all)
                if self.test_break() or _is_stopped(done / in_all):
                    return
            if index + 1 == len(moments) or not bpy.app.background:
                self._show(view_layer, window, frame.arrays())

    def _others(self, depsgraph, size):
        """Where everything is a frame before and a frame after: [`motion.Places`]."""
        found = []
        for _index in self._at(depsgraph.scene, [-1.0, 1.0]):
            with drawing.ALONE:
                there = drawn_scene.read_unlit(depsgraph, {})
                camera = scene.read_camera(depsgraph.scene, depsgraph, *size, self.camera_override)
                found.append(motion.places(there, *camera))
        return found

    def _at(self, blender_scene, moments):
        """Bring the scene to each moment, from its frame, and back: a generator of their indices."""
        now = blender_scene.frame_current_final
        try:
            for index, moment in enumerate(moments):
                if moment != 0.0:
                    self._set_time(now + moment)
                yield index
        finally:
            if any(moments):
                self._set_time(now)

    def _set_time(self, frames):
        whole = math.floor(frames)
        self.frame_set(whole, subframe=frames - whole)

    def _show(self, view_layer, window, arrays):
        """Hand over what there is of the picture."""
        result = self.begin_result(0, 0, *window[2:], layer=view_layer.name)
        for render_pass in result.layers[0].passes:
            if render_pass.name in arrays:
                render_pass.rect.foreach_set(np.ascontiguousarray(arrays[render_pass.name]).ravel())
        self.end_result(result)


def _is_stopped(part):
    try:
        _listener("Rendering", part)
    except Stopped:
        return True
    return False


# (channels, kind) of passes that are not the colours of light.
_KINDS = {
    "Combined": ("RGBA", "COLOR"),
    "Depth": ("Z", "VALUE"),
    "Hair Mask": ("X", "VALUE"),
    "Vector": ("XYZW", "VECTOR"),
}


def _passes(view_layer, is_blurred):
    """Names of the passes that are switched on. What is blurred already has no motion that could blur it."""
    wanted = properties.to_settings(view_layer.vellus, picture.PassSettings)
    names = ["Combined"]
    if view_layer.use_pass_z:
        names.append("Depth")
    if view_layer.use_pass_vector and not is_blurred:
        names.append("Vector")
    if view_layer.use_pass_shadow:
        names.append("Shadow")
    if wanted.has_hair_mask:
        names.append("Hair Mask")
    if wanted.has_lobes:
        names += film.LOBES
    return names


def _moments(render, count):
    if not render.use_motion_blur or render.motion_blur_shutter <= 0.0:
        return [0.0]
    return picture.moments(render.motion_blur_shutter, render.motion_blur_position, count).tolist()


def _require_supported(blender_scene, camera):
    if blender_scene.render.use_multiview:
        raise HairError("Vellus renders one view: switch Stereoscopy off in the Output properties.")
    if camera is not None and camera.type == "CAMERA" and camera.data.type not in {"PERSP", "ORTHO"}:
        raise HairError("Vellus renders perspective and orthographic cameras: pick one of these as the lens's type.")
