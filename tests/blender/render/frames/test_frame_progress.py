# SPDX-License-Identifier: GPL-3.0-or-later
"""The progress bar of a render rises through all stages, view layers and motion steps without jumps; Esc cancels."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.render.frames import engine
from hair_addon.blender.render.frames.frame_progress import FrameProgress
from tests.support.pictures.rendering import configure


class Recorder:
    """A render engine that records its progress: fractions of the bar, and texts."""

    def __init__(self):
        self.engine, self.parts, self.texts, self.stops_in = None, [], [], None

    def update_progress(self, part):
        self.parts.append(part)
        self.engine.update_progress(part)

    def update_stats(self, stats, text):
        self.texts.append(text)
        self.engine.update_stats(stats, text)

    def test_break(self):
        is_there = self.stops_in is not None and self.stops_in in self.texts[-1]
        return is_there or self.engine.test_break()


@pytest.fixture
def told(lit, monkeypatch):
    """Return the `Recorder` of renders of the hairy sphere, with light among strands."""
    recorder = Recorder()

    def recorded(its_engine, *given):
        recorder.engine = its_engine
        return FrameProgress(recorder, *given)

    monkeypatch.setattr(engine, "FrameProgress", recorded)
    bpy.context.scene.vellus.multiple_scattering = "GRID"
    return recorder


def render(folder, **settings):
    configure(filepath=str(folder / "frame.png"), sample_count=16, **settings)
    return bpy.ops.render.render(write_still=True)


def steps_of(texts):
    """Return the names of steps without repetitions and without their moments, in order."""
    return list(dict.fromkeys(text.split(" | ")[-1] for text in texts))


READING = ["Reading hair", "Reading surfaces", "Reading lights", "Drawing shadows"]
STEPS = ["Evaluating the scene", *READING, "Following light", *(f"Pass {number} of 16" for number in range(1, 17))]


def assert_rises(parts, most):
    """Assert that progress rises; most: the largest step."""
    steps = np.diff([0.0, *parts])
    assert (steps >= 0.0).all() and steps.max() <= most
    assert parts[-1] == pytest.approx(1.0) and len({*parts}) > 8


def test_the_bar_rises_through_all_stages(told, tmp_path):
    parts, texts = told.parts, told.texts
    camera = bpy.context.scene.camera.data
    camera.dof.use_dof, camera.dof.focus_distance = True, 8.0  # so that there are several passes
    render(tmp_path)
    assert_rises(parts, 0.17)
    assert steps_of(texts) == STEPS
    assert parts[texts.index(next(t for t in texts if "Following light" in t))] == pytest.approx(0.25, abs=0.02)


def test_it_is_one_bar_over_moments_and_view_layers(told, tmp_path):
    parts, texts = told.parts, told.texts
    scene = bpy.context.scene
    second = scene.view_layers.new("Second")
    scene.view_layers.new("Off").use = False
    second.use_pass_vector = True  # of which a blurred picture has none
    render(tmp_path, use_motion_blur=True, motion_steps=3)
    assert_rises(parts, 0.11)
    moments = [text.split(" | ")[0] for text in texts if " | " in text]
    assert list(dict.fromkeys(moments)) == [f"Motion step {number} of 3" for number in (1, 2, 3)]
    assert sum(0.45 < part < 0.55 for part in parts) > 1  # where one layer ends, and the other begins
    parts.clear()
    render(tmp_path, use_motion_blur=False)
    assert_rises(parts, 0.28)  # a pass is drawn at once


@pytest.mark.parametrize("step", ["Reading lights", "Following light", "Pass 1 of"])
def test_esc_is_heard_in_each_stage(told, tmp_path, step):
    parts, texts = told.parts, told.texts
    told.stops_in = step
    scene = bpy.context.scene
    scene.frame_set(3)
    render(tmp_path, use_motion_blur=True, motion_steps=2)
    assert step in texts[-1] and max(parts) < 0.6
    assert (scene.frame_current, scene.frame_subframe) == (3, 0.0)
