# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in steps is the same immediately and in a thread, can be canceled, and passes on errors."""

import threading

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.grooming import groom
from hair_addon.core.grooming.groom import GuideSettings
from hair_addon.core.long_work import Job, Stage, Stopped, part_of, run_now


def test_a_generator_gets_what_was_computed():
    def work():
        doubled = yield lambda progress: 2 * 21
        halved = yield lambda progress: doubled / 2
        return doubled, halved

    assert run_now(work()) == (42, 21)


def test_errors_come_out_where_the_work_was_started():
    def work():
        yield lambda progress: 1 / 0

    with pytest.raises(ZeroDivisionError):
        run_now(work())
    with pytest.raises(ZeroDivisionError):
        Job(next(work())).result()


def test_a_job_says_how_far_it_is_and_stops_when_asked():
    reached, may_go_on = threading.Event(), threading.Event()

    def compute(progress):
        progress("first", 0.25)
        reached.set()
        may_go_on.wait(10.0)
        progress("second", 0.5)

    job = Job(compute)
    assert reached.wait(10.0)
    assert (job.step, job.part, job.is_done) == ("first", 0.25, False)
    job.stop()
    may_go_on.set()
    with pytest.raises(Stopped):
        job.result()
    assert job.is_done and job.step == "first"


def test_a_stage_is_reported_and_may_be_stopped_before_it_begins():
    done = []

    def work():
        yield Stage("Drawing", 0.5)
        done.append("drawn")
        return 3

    assert run_now(work()) == 3 and done == ["drawn"]
    job = Job(next(work()))
    assert (job.step, job.part, job.is_done, job.result()) == ("Drawing", 0.5, True, None)
    job.stop()
    with pytest.raises(Stopped):
        job.result()
    assert done == ["drawn"]


def test_parts_nest():
    told = []
    part_of(part_of(lambda step, part: told.append(part), 0.5, 1.0), 0.0, 0.5)("inner", 1.0)
    assert told == [0.75]


def square(side):
    from hair_addon.core.geometry.mesh import TriMesh

    vertices = np.array([(0, 0, 0), (side, 0, 0), (side, side, 0), (0, side, 0)], np.float32)
    return TriMesh(vertices, np.array([(0, 1, 2), (0, 2, 3)], np.int32))


def test_guides_of_a_thread_are_those_of_one_go(device):
    """Guides of a thread are those of one go, and progress never decreases."""
    settings, told = GuideSettings(guide_count=20, relax_iterations=5), []
    expected = groom.distribute_guides(square(1.0), settings, device=device)

    def compute(progress):
        def both(step, part):
            told.append(part)
            progress(step, part)

        return groom.distribute_guides(square(1.0), settings, device=device, progress=both)

    assert np.array_equal(Job(compute).result().numpy(), expected.numpy())
    assert told == sorted(told) and told[0] == 0.0 and len(told) >= 5 and told[-1] < 1.0


def test_guides_can_be_stopped_in_every_step(device):
    """Guides can be stopped in every step, however late, without a result."""
    settings, steps = GuideSettings(guide_count=10, relax_iterations=3), []
    groom.distribute_guides(square(1.0), settings, device=device, progress=lambda step, part: steps.append(part))
    for last in range(len(steps)):
        left = last

        def stop(_step, _part):
            nonlocal left
            if left == 0:
                raise Stopped
            left -= 1

        with pytest.raises(Stopped):
            groom.distribute_guides(square(1.0), settings, device=device, progress=stop)


def test_errors_are_reported_before_anything_is_compiled():
    from hair_addon.core.geometry.mesh import TriMesh

    def never(_step, _part):
        raise AssertionError

    with pytest.raises(HairError):
        nothing = TriMesh(np.empty((0, 3), np.float32), np.empty((0, 3), np.int32))
        groom.distribute_guides(nothing, GuideSettings(), progress=never)
