# SPDX-License-Identifier: GPL-3.0-or-later
"""The base of operators that may take long: computed at once where that is quick, or else while the window lives on.

Called from a script or without a window they are always computed at once. In a window what would take long, and what
is used for the first time, for which kernels may have to be compiled, runs in a thread: with a progress bar, and Esc.
"""

import bpy

from ...core.errors import HairError
from ...core.long_work import Job, Stopped, run_now
from .. import running
from ..translations import interface_text, report_text
from .base import HairOperator

PATIENCE = 0.4  # [s]: what takes longer gets a progress bar

# Looking around changes nothing that is being computed.
_NAVIGATION = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE"}


class LongOperator(HairOperator):
    """Mixed into an operator that says what its `work` is, its `seconds`, and its `message`."""

    has_run = False  # in this session: its kernels are there

    def work(self, context):
        """The work in steps (core/long_work.py)."""
        raise NotImplementedError

    def seconds(self, context):
        """How long the work will take, estimated."""
        raise NotImplementedError

    def message(self, made):
        """(sentence, values) that tell what was made of what the work returned."""
        raise NotImplementedError

    def prefill(self, context):
        """Take settings from what is made again."""

    def after(self, context, made):
        """What is selected when it is made."""

    def invoke(self, context, _event):
        """Compute at once, or begin to."""
        self.prefill(context)
        try:
            is_quick = type(self).has_run and self.seconds(context) < PATIENCE
        except HairError as error:
            return self.refuse(error)
        return self.execute(context) if bpy.app.background or is_quick else self.begin(context)

    def execute(self, context):
        """Compute at once."""
        try:
            if running.job() is not None:
                raise HairError("Hair is being computed: wait until it is done, or press Esc to stop it.")
            return self._done(context, run_now(self.work(context)))
        except HairError as error:
            return self.refuse(error)

    def begin(self, context):
        """Read what is needed now and compute in a thread."""
        try:
            if running.job() is not None:
                raise HairError("Hair is being computed: wait until it is done, or press Esc to stop it.")
            self._work = self.work(context)
            running.begin(context, Job(next(self._work)))
        except HairError as error:
            return self.refuse(error)
        context.window_manager.modal_handler_add(self)
        self._show(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Wait for the thread; write when it is done."""
        job = running.job()
        if job is None:  # the add-on was switched off
            return self._end(context, {"CANCELLED"})
        if event.type == "ESC" and event.value == "PRESS":
            job.stop()
        if event.type == "TIMER":
            if job.is_done:
                return self._advance(context, job)
            self._show(context)
        return {"PASS_THROUGH"} if event.type in _NAVIGATION else {"RUNNING_MODAL"}

    def cancel(self, context):
        """The window was closed, or another file is being opened."""
        self._end(context, {"CANCELLED"})

    def _advance(self, context, job):
        try:
            running.begin(context, Job(self._work.send(job.result())))
            self._show(context)
            return {"RUNNING_MODAL"}
        except StopIteration as end:
            return self._end(context, self._done(context, end.value))
        except Stopped:
            self.report({"INFO"}, report_text("Stopped: nothing was changed."))
            return self._end(context, {"CANCELLED"})
        except HairError as error:
            return self._end(context, self.refuse(error))
        except BaseException:  # a defect of ours must not leave a window that waits for ever
            self._end(context, {"CANCELLED"})
            raise

    def _done(self, context, made):
        type(self).has_run = True
        self.after(context, made)
        sentence, values = self.message(made)
        self.report({"INFO"}, report_text(sentence, **values))
        return {"FINISHED"}

    def _end(self, context, outcome):
        running.end(context)
        context.workspace.status_text_set(None)
        _redraw(context)
        return outcome

    def _show(self, context):
        job = running.job()
        step = interface_text("Stopping" if job.is_stopping else job.step)
        said = interface_text("{step}: {percent} %    Esc: stop", step=step, percent=round(100 * job.part))
        context.workspace.status_text_set(said)
        _redraw(context)


def _redraw(context):
    for area in context.screen.areas:
        if area.type == "VIEW_3D":
            area.tag_redraw()
