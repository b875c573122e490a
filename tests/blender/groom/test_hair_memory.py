# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that need much of the free memory are refused or confirmed, and no hair is lost if memory runs out."""

import ctypes
import gc
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.host import memory, notices, running
from hair_addon.blender.live import evaluation
from hair_addon.blender.ui.operators.base import modal
from hair_addon.core.errors import HairError
from hair_addon.core.grooming import cost
from hair_addon.core.kernels import parallel
from tests.support.commands import HEAD, run_here
from tests.support.interface.layout import draw
from tests.support.reading import points

REFUSED = r"These strands need [\d.]+ GB of memory, and [\d.]+ GB are free"


@pytest.fixture
def free(monkeypatch):
    """Return a function that sets the part of free memory that 10,000 strands of 41 points take."""

    def leave(part):
        needed = cost.strand_bytes(10_000, 41, 4)
        monkeypatch.setattr(memory, "free_bytes", lambda: int(needed / part))
        notices.printed_cache.clear()

    return leave


def resident(name):
    """Return a figure of this process [bytes]."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(f"{name}:"))


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="the system does not tell what was used at most")
@pytest.mark.parametrize(("strands", "point_count"), [(60_000, 41), (10_000, 257)])
def test_strands_take_what_is_estimated(guides, strands, point_count):
    """Generating strands takes between half of the estimated memory and all of it, without styles and viewports."""
    api.interpolate_hair(guides.data, strand_count=100, point_count=point_count)  # loads what is to be loaded
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)  # what tests before have freed would be taken again, and not be seen
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    before = resident("VmRSS")
    hair = api.interpolate_hair(guides.data, strand_count=strands, point_count=point_count)
    taken = resident("VmHWM") - before
    estimate = cost.strand_bytes(strands, point_count, hair.vellus.hair.neighbour_limit)
    assert 0.5 * estimate < taken < 1.05 * estimate, (taken / estimate, taken)


def test_more_than_there_is_is_refused_before_anything_is_made(hair, free):
    free(0.8)
    before, objects = points(hair), set(bpy.data.objects)
    sphere = hair.data.surface
    with pytest.raises(HairError, match=REFUSED):
        api.interpolate_hair(hair.data.vellus.guide_curves, strand_count=10_000)
    with pytest.raises(HairError, match=REFUSED):
        api.add_hair(sphere, api.GroomSettings(api.GuideSettings(guide_count=9), api.HairSettings(strand_count=10_000)))
    with pytest.raises(HairError, match=REFUSED):
        api.distribute_guides(sphere, guide_count=100_000)
    bpy.context.view_layer.objects.active = sphere
    with pytest.raises(RuntimeError, match=REFUSED):
        bpy.ops.vellus.add_hair(strand_count=10_000)
    hair.data.vellus.hair.strand_count = 20_000  # in the panel
    bpy.context.view_layer.update()
    assert hair.data.vellus.status.startswith("These strands need")
    assert set(bpy.data.objects) == objects
    np.testing.assert_array_equal(points(hair), before)


def test_the_command_line_refuses_and_says(free, tmp_path, capsys):
    free(0.8)
    words = ["groom", HEAD, "--guides", 20, "--strands", 10_000, "--out", tmp_path / "hair.npz"]
    ended = run_here(*words)
    assert ended.status == 1 and "These strands need" in ended.errors and not list(tmp_path.iterdir())
    free(0.4)
    ended = run_here(*words)
    assert ended.status == 0 and (tmp_path / "hair.npz").exists()
    assert capsys.readouterr().err.count("of the free memory") == 1


def test_what_hair_has_already_is_not_asked_for_again(hair, free, monkeypatch):
    """In a window, hair that needs much more memory than it has waits for the button; other hair does not."""
    monkeypatch.setattr(running, "has_window", lambda: True)
    state = hair.data.vellus
    free(0.4)
    state.hair.strand_count = 10_000
    with memory.asking():
        evaluation.evaluate(bpy.context.evaluated_depsgraph_get(), {})
    assert "% of the free memory: use fewer, or click Regenerate Strands" in state.status
    assert len(hair.data.curves) == 500
    monkeypatch.setattr(running, "has_window", lambda: False)
    assert "% of the free memory" in " ".join(draw(bpy.types.VELLUS_PT_interpolation).texts)
    bpy.context.view_layer.objects.active = hair
    bpy.ops.vellus.interpolate_hair(strand_count=10_000)
    assert len(hair.data.curves) == 10_000 and state.status == ""
    state.hair.tip_taper = 0.5
    with memory.asking():
        evaluation.evaluate(bpy.context.evaluated_depsgraph_get(), {})
    assert state.status == ""


class _Asked(modal.LongOperator):
    """An operator of hair in a window, as Blender runs it."""

    bl_idname = "VELLUS_OT_interpolate_hair"
    properties = SimpleNamespace(is_property_set=lambda name: name == "strand_count")
    strand_count, seed = 10_000, 1

    def __init__(self):
        self.reported, self.begun = [], []

    def as_keywords(self):
        return {"strand_count": self.strand_count, "seed": self.seed}

    def work(self, _context):
        memory.require_for_hair(cost.strand_bytes(10_000, 41, 4))
        yield lambda _progress: None
        return []

    def _invoke_anew(self, values):
        self.begun.append(values)
        return {"RUNNING_MODAL"}

    def report(self, kinds, text):
        self.reported.append((*kinds, text))


def test_an_operator_asks_once_before_it_takes_much(free, monkeypatch):
    free(0.4)
    monkeypatch.setattr(running, "has_window", lambda: True)
    asked = []

    def invoke_confirm(operator, _event, **given):
        asked.append(given)
        return {"RUNNING_MODAL"}

    context = SimpleNamespace(window_manager=SimpleNamespace(invoke_confirm=invoke_confirm))
    operator = _Asked()
    operator._event, operator._asks = None, True
    assert operator.begin(context) == {"RUNNING_MODAL"} and not operator.begun
    assert asked == [{"title": "Use 40% of the Free Memory?", "message": asked[0]["message"], "icon": "WARNING"}]
    assert operator.execute(context) == {"CANCELLED"}  # the work that goes on is a step of its own
    assert operator.begun == [{"strand_count": 10_000}] and modal.LongOperator._takes_much
    monkeypatch.setattr(modal.LongOperator, "_takes_much", False)


@pytest.mark.parametrize("place", ["of strands", "of a binding"])
def test_no_memory_is_one_sentence_and_loses_nothing(hair, monkeypatch, place, capsys):
    before = points(hair)

    def refuse(*_shape, **_options):
        raise MemoryError

    with monkeypatch.context() as short:
        if place == "of strands":
            short.setattr(parallel, "empty_vectors", refuse)
        else:
            short.setattr("hair_addon.core.grooming.groom.bind_hair", refuse)
        hair.data.vellus.hair.strand_count = 600
        bpy.context.view_layer.update()
        assert hair.data.vellus.status.startswith("Not enough memory: use fewer strands")
        with pytest.raises(HairError, match="Not enough memory"):
            api.interpolate_hair(hair.data.vellus.guide_curves, strand_count=700)
    np.testing.assert_array_equal(points(hair), before)
    hair.data.vellus.hair.strand_count = 500
    bpy.context.view_layer.update()
    assert hair.data.vellus.status == "" and "Traceback" not in capsys.readouterr().err
    np.testing.assert_array_equal(points(hair), before)


def test_limits_of_a_group_and_of_a_process_count(tmp_path, monkeypatch):
    for name, text in (("max", "900000000"), ("current", "500000000"), ("stat", "anon 1\ninactive_file 100000000\n")):
        (tmp_path / f"memory.{name}").write_text(text, encoding="ascii")
    monkeypatch.setattr(memory, "_GROUP", tmp_path)
    assert memory._left_in_group() == 500_000_000
    monkeypatch.setattr(memory, "_available", lambda: 10**12)
    monkeypatch.setattr(memory, "_left_by_limit", lambda: None)
    assert memory.free_bytes() == 500_000_000
    (tmp_path / "memory.max").write_text("max", encoding="ascii")
    assert memory.free_bytes() == 10**12
    monkeypatch.setattr(memory, "_left_by_limit", lambda: 10**6)
    assert memory.free_bytes() == 10**6
