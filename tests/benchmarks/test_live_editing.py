# SPDX-License-Identifier: GPL-3.0-or-later
"""Times from editing a guide to points on the GPU, and for a deforming surface; printed.

Asserted: while guides are combed nothing is searched, nothing is written, and not all of the hair is uploaded.
"""

import math
import time

import bpy
import gpu
import numpy as np
import pytest

import hair_addon
from hair_addon.blender.data import scene
from hair_addon.blender.data.strands import curves
from hair_addon.blender.host import running
from hair_addon.blender.live import events, invalidation, live_hair
from hair_addon.blender.render import drawn_scene, hair_cache
from hair_addon.blender.render.viewport import hair_picture
from tests.support.counting import counts_of
from tests.support.meshes import HEAD

_GUIDE_COUNT = 200
_COMBED = 8  # guides under a brush


@pytest.fixture
def head():
    """Return the sample head in an empty file, as in a window."""
    hair_addon.register()
    gpu.init()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath=str(HEAD))
    head = bpy.context.selected_objects[0]
    bpy.context.view_layer.objects.active = head
    yield head
    live_hair.cancel_writing()
    invalidation.data_replaced()
    hair_addon.unregister()


def median_ms(work, repetitions=7):
    times = []
    for _ in range(repetitions):
        started = time.perf_counter()
        work()
        times.append(time.perf_counter() - started)
    return 1e3 * float(np.median(times))


def points_of(datablock):
    return curves.read_points(datablock).reshape(len(datablock.curves), -1, 3)


def comb(guides):
    """Move some guides as one step of a brush does, and update Blender."""
    combed = points_of(guides)
    near = np.linalg.norm(combed[:, 0] - combed[0, 0], axis=1).argsort()[:_COMBED]
    combed[near, 1:] += np.float32([0.0, 0.0, 1e-3])
    guides.attributes["position"].data.foreach_set("vector", combed.ravel())
    guides.update_tag()
    bpy.context.view_layer.update()


def on_gpu(hair):
    """Bring the hair to the GPU and wait until it is there."""
    strands = hair_cache.strands_on_gpu(hair)
    with gpu.types.GPUFrameBuffer(color_slots=strands.texture).bind():
        gpu.state.active_framebuffer_get().read_color(0, 0, 1, 1, 4, 0, "FLOAT")


class View:
    """A viewport of 1280 × 720 pixels that shows the head while a stroke runs."""

    def __init__(self):
        self.picture = hair_picture.HairPicture((1280, 720))
        self.matrices = drawing_place()
        self.drawn = self._read(None)

    def _read(self, before):
        context = bpy.context
        depsgraph = context.evaluated_depsgraph_get()
        is_draft = before is not None
        return drawn_scene.read(context.scene, context.view_layer, depsgraph, before=before, is_draft=is_draft)

    def redraw(self):
        """Redraw after a change of the hair alone."""
        self.drawn = self._read(self.drawn)
        self.picture.restart()
        self.picture.add_pass(self.drawn, *self.matrices)
        self.picture.read()


def drawing_place():
    """Return (world to view, view to clip) of a camera before the face."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -1.2, 1.75), (math.pi / 2, 0.0, 0.0)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    for new in (camera, sun):
        bpy.context.scene.collection.objects.link(new)
    bpy.context.scene.camera = camera
    return scene.read_camera(bpy.context.scene, bpy.context.evaluated_depsgraph_get(), 1280, 720)


@pytest.mark.long
@pytest.mark.parametrize("strand_count", [30_000, 100_000])
def test_live_editing(head, strand_count, monkeypatch):
    monkeypatch.setattr(running, "has_window", lambda: True)
    bpy.ops.vellus.distribute_guides(guide_count=_GUIDE_COUNT)
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    bpy.ops.vellus.interpolate_hair(strand_count=strand_count)
    guides, hair = (bpy.data.hair_curves[name] for name in ("Guides", "Hair"))
    on_gpu(hair)
    comb(guides), on_gpu(hair)  # compiles the program that moves strands
    counts = counts_of(monkeypatch)
    edit = median_ms(lambda: comb(guides))
    edit_and_upload = median_ms(lambda: (comb(guides), on_gpu(hair)))
    view = View()
    edit_and_draw = median_ms(lambda: (comb(guides), view.redraw()))
    assert counts["searches"] == counts["uploads"] == counts["writes"] == 0
    monkeypatch.undo()
    monkeypatch.setattr(running, "has_window", lambda: True)
    write = median_ms(lambda: (comb(guides), live_hair.write_all())) - edit
    whole = median_ms(lambda: (events.strands_computed(hair), on_gpu(hair)))

    basis = head.shape_key_add(name="Basis")
    key = head.shape_key_add(name="Key")
    rest = np.array([point.co for point in basis.data], np.float32)
    key.data.foreach_set("co", (rest + 0.1 * rest[:, [1, 2, 0]]).ravel())

    def deform():
        key.value = 1.0 - 0.5 * key.value
        bpy.context.view_layer.update()

    deform()
    follow = median_ms(deform)
    follow_and_upload = median_ms(lambda: (deform(), on_gpu(hair)))
    bpy.data.objects["Hair"].modifiers[0].show_viewport = False
    without_nodes = median_ms(deform)
    print(
        f"\n{strand_count:7} strands, {_COMBED} of {_GUIDE_COUNT} guides: edit to computed {edit:.1f} ms,"
        f" to uploaded {edit_and_upload:.1f} ms, to drawn {edit_and_draw:.0f} ms;"
        f" writing {write:.1f} ms; uploading all {whole:.1f} ms; surface deforms: Blender's update {follow:.1f} ms"
        f" ({without_nodes:.1f} without the nodes), with our upload {follow_and_upload:.1f} ms"
    )
