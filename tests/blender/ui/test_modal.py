# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work in a window ends without partial results by events, by Esc or in any other way."""

import threading
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom import pipeline
from hair_addon.blender.host import running
from hair_addon.blender.live import handlers
from hair_addon.blender.render import offscreen
from hair_addon.blender.settings import setting_properties
from hair_addon.core.errors import HairError
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from hair_addon.core.long_work import Job, Stage, run_now
from tests.support.interface.modal import ESC, TIMER, Operator, drive
from tests.support.reading import points, snapshot


def test_work_ends_as_it_would_at_once(window):
    def work():
        first = yield lambda progress: 3
        second = yield lambda progress: first + 4
        return second

    operator = Operator(work())
    assert drive(operator, window) == {"FINISHED"}
    assert operator.reported == [("INFO", "7 guides")]
    assert window.status[-1] is None


def test_a_step_that_says_nothing_is_called_as_the_one_before_it(window):
    def work():
        yield Stage("Drawing", 0.25)
        yield lambda progress: None
        return 1

    assert drive(Operator(work()), window) == {"FINISHED"}
    assert [line.split("    ")[0] for line in window.status[:-1]] == ["Drawing: 25%"]


@pytest.mark.parametrize("event", [ESC, SimpleNamespace(type="MOUSEMOVE", value="NOTHING")])
def test_esc_ends_the_work_and_no_other_key_does(window, event):
    is_here, may_go_on, wrote = threading.Event(), threading.Event(), []

    def compute(progress):
        is_here.set()
        may_go_on.wait(10.0)
        progress("later", 0.5)

    def work():
        yield compute
        wrote.append(True)
        return 1

    operator = Operator(work())
    operator.begin(window)
    assert is_here.wait(10.0)
    assert operator.modal(window, event) == {"RUNNING_MODAL"}
    may_go_on.set()
    running.job().wait()
    outcome = operator.modal(window, TIMER)
    if event is ESC:
        assert outcome == {"CANCELLED"} and not wrote
        assert operator.reported == [("INFO", "Canceled: nothing was changed.")]
    else:
        assert outcome == {"FINISHED"} and wrote


def fail(error):
    def compute(_progress):
        raise error

    return compute


def test_an_error_is_reported_and_a_defect_is_raised(window):
    def work(error):
        yield fail(error)

    operator = Operator(work(HairError("The surface has no faces to grow hair on.")))
    assert drive(operator, window) == {"CANCELLED"}
    assert operator.reported == [("ERROR", "The surface has no faces to grow hair on.")]
    with pytest.raises(ZeroDivisionError):
        drive(Operator(work(ZeroDivisionError())), window)


def test_one_work_at_a_time(window):
    may_go_on = threading.Event()

    def work():
        yield lambda progress: may_go_on.wait(10.0)
        return 1

    first, second = Operator(work()), Operator(work())
    first.begin(window)
    assert second.begin(window) == second.execute(window) == {"CANCELLED"}
    assert all("being computed" in text for _kind, text in second.reported)
    may_go_on.set()
    running.job().wait()
    assert first.modal(window, TIMER) == {"FINISHED"}


@pytest.mark.parametrize("end", ["cancel", "add-on off"])
def test_work_ends_with_its_window_and_with_the_addon(window, end):
    def compute(progress):
        while True:
            progress("on and on", 0.5)

    def work():
        yield compute

    operator = Operator(work())
    operator.begin(window)
    if end == "cancel":
        operator.cancel(window)
    else:
        running.end(window)
        assert operator.modal(window, TIMER) == {"CANCELLED"}


@pytest.fixture
def camera(hair):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location.z = 5.0
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera


@pytest.mark.parametrize(("has_lens", "stages"), [(False, 2), (True, 5)])
def test_a_picture_in_stages_is_that_of_one_go_and_esc_ends_it_in_each(camera, window, has_lens, stages):
    """A picture drawn in stages equals that drawn at once, and Esc ends it in each stage, of shadows or of points of
    the lens.
    """
    bpy.context.scene.camera.data.dof.use_dof = has_lens
    settings = PictureSettings(width=24, height=16, samples_per_side=2)
    made = []

    def work():
        made.append((yield from offscreen.drawing_picture(settings)))
        return 1

    assert drive(Operator(work()), window) == {"FINISHED"}
    assert np.array_equal(made.pop(), offscreen.draw_picture(settings))
    for stage in range(stages):
        operator = Operator(work())
        operator.begin(window)
        for _ in range(stage):
            assert operator.modal(window, TIMER) == {"RUNNING_MODAL"}
        operator.modal(window, ESC)
        assert operator.modal(window, TIMER) == {"CANCELLED"}
        assert operator.reported == [("INFO", "Canceled: nothing was changed.")] and not made


def in_a_thread(work):
    """Do work as a window does: compute in another thread and write in this one."""
    compute = next(work)
    try:
        while True:
            compute = work.send(Job(compute).result())
    except StopIteration as end:
        return end.value


def test_hair_of_a_window_is_that_of_a_script(sphere):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    settings = GuideSettings(guide_count=15, relax_iterations=2), HairSettings(strand_count=50)
    _guides, slow = in_a_thread(pipeline.adding_hair(sphere, *settings, depsgraph))
    _guides, fast = run_now(pipeline.adding_hair(sphere, *settings, depsgraph))
    slow, fast = (next(o for o in bpy.data.objects if o.data == made) for made in (slow, fast))
    assert np.array_equal(points(slow), points(fast))


@pytest.mark.parametrize("what", ["Sphere", "Guides", "Hair"])
def test_deletion_during_an_operation_is_reported_and_leaves_nothing(hair, what):
    """Deletion by a script or another window during an operation is reported and leaves no partial result."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    settings = setting_properties.to_settings(hair.data.vellus.hair, HairSettings)
    work = pipeline.interpolating_hair(bpy.data.objects["Guides"].data, settings, depsgraph, hair.data)
    computed = Job(next(work)).result()
    owner = bpy.data.objects[what]
    bpy.data.objects.remove(owner) if what == "Sphere" else bpy.data.hair_curves.remove(owner.data)
    before = snapshot()
    with pytest.raises(HairError, match="was deleted while"):
        work.send(computed)
    assert snapshot() == before


def test_undo_meanwhile_leaves_no_dead_reference(hair):
    bpy.ops.ed.undo_push(message="made")
    hair.data.vellus.hair.strand_count = 20
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="fewer")
    depsgraph = bpy.context.evaluated_depsgraph_get()
    guides = bpy.data.objects["Guides"].data
    work = pipeline.interpolating_hair(guides, HairSettings(strand_count=30), depsgraph, hair.data)
    computed = Job(next(work)).result()
    bpy.ops.ed.undo()
    work_result = None
    try:
        work.send(computed)
    except StopIteration as end:
        work_result = end.value
    assert len(work_result.curves) == len(bpy.data.hair_curves["Hair"].curves) == 30


def test_stale_hair_waits_for_the_work(hair, monkeypatch):
    done = Job(lambda progress: None)
    done.wait()
    monkeypatch.setattr(running, "_job", done)
    hair.data.vellus.hair.strand_count = 20
    bpy.context.view_layer.update()
    assert len(hair.data.curves) == 500 and hair.data.vellus.is_stale
    monkeypatch.setattr(running, "_job", None)
    handlers.after_depsgraph_update(bpy.context.scene, bpy.context.evaluated_depsgraph_get())
    assert len(hair.data.curves) == 20
