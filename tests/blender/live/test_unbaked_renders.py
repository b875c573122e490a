# SPDX-License-Identifier: GPL-3.0-or-later
"""Missing baked frames in other engines: Blender's command line ends before them, a window reports them."""

import sys
from types import SimpleNamespace

import bpy
import pytest

from hair_addon.blender.live import handlers, refused_hair, unbaked_renders
from hair_addon.blender.render.frames import composite
from hair_addon.blender.ui import menus
from tests.support.interface.layout import draw

SENTENCE = 'Frame 4 of the guides "Guides" is not baked: bake their dynamics first.'


@pytest.fixture
def scene(hair, tmp_path, monkeypatch):
    """Return a scene in frame 4 with simulated hair; frames 1 to 3 are baked, and Blender was started to render an
    animation.
    """
    scene, guides = bpy.context.scene, bpy.data.objects["Guides"]
    guides.data.vellus.simulates, guides.data.vellus.cache_folder = True, str(tmp_path)
    scene.frame_start, scene.frame_end, scene.render.engine = 1, 2, "CYCLES"
    bpy.context.view_layer.objects.active = guides
    assert bpy.ops.vellus.bake_dynamics() == {"FINISHED"}
    scene.frame_set(4)
    monkeypatch.setattr(sys, "argv", ["blender", "-b", "shot.blend", "-a"])
    monkeypatch.setattr(unbaked_renders, "bpy", SimpleNamespace(app=SimpleNamespace(binary_path="/opt/blender")))
    return scene


def test_blender_started_to_render_ends_before_the_frame(scene, capsys, monkeypatch):
    assert handlers.before_rendered_frame in bpy.app.handlers.render_pre
    with pytest.raises(SystemExit) as ended:
        handlers.before_rendered_frame(scene)
    assert ended.value.code == 1 and capsys.readouterr().err == f"Vellus: {SENTENCE}\n"
    for words in (["-b", "--render-frame", "4"], ["--background", "-f", "3", "--", "-x"]):
        monkeypatch.setattr(sys, "argv", ["blender", *words])
        with pytest.raises(SystemExit):
            unbaked_renders.before_frame(scene)
    scene.frame_set(3)
    unbaked_renders.before_frame(scene)
    bpy.data.objects["Guides"].data.vellus.simulates = False
    scene.frame_set(4)
    unbaked_renders.before_frame(scene)


@pytest.mark.parametrize("what", ["our engine", "composited", "a script", "a word of a script", "Python"])
def test_what_is_refused_elsewhere_or_is_more_than_a_render_goes_on(scene, monkeypatch, capsys, what):
    if what == "our engine":
        scene.render.engine = "VELLUS"
    elif what == "composited":
        monkeypatch.setattr(composite, "is_on", lambda _scene: True)
    elif what == "Python":
        monkeypatch.setattr(unbaked_renders, "bpy", SimpleNamespace(app=SimpleNamespace(binary_path="")))
    else:
        words = ["--python", "x.py", *(["--", "-a"] if what == "a word of a script" else [])]
        monkeypatch.setattr(sys, "argv", ["blender", "-b", *words])
    unbaked_renders.before_frame(scene)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("is_animation", [True, False], ids=["an animation", "a still picture"])
def test_a_window_says_so_after_an_animation(scene, monkeypatch, capsys, is_animation):
    rendering = SimpleNamespace(bl_idname="RENDER_OT_render", properties=SimpleNamespace(animation=is_animation))
    monkeypatch.setattr(unbaked_renders.running, "has_window", lambda: True)
    monkeypatch.setattr(unbaked_renders.running, "found", lambda: [rendering])
    handlers.before_rendering(scene)
    for _frame in range(2):
        handlers.before_rendered_frame(scene)
    assert capsys.readouterr().err.count(SENTENCE) == is_animation
    refused_hair.end(scene)
    assert bpy.app.timers.is_registered(refused_hair.offer) == is_animation
    if is_animation:
        bpy.app.timers.unregister(refused_hair.offer)
    assert draw(menus.VELLUS_MT_refused_hair).texts == [SENTENCE] * is_animation
    handlers.before_rendering(scene)
    assert draw(menus.VELLUS_MT_refused_hair).texts == []
