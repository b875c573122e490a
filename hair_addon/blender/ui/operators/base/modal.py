# SPDX-License-Identifier: GPL-3.0-or-later
"""Base of long operators, which may compute in a thread while the window responds.

Called from a script or without a window, they compute immediately. In a window, long computations and the first use,
which may compile kernels, run in a thread with a progress bar; Esc cancels.
"""

import bpy

from .....core.errors import HairError, memory_as_sentence
from .....core.long_work import Job, Stopped, run_now
from ....data import whole_changes
from ....host import memory, running
from ....settings.translations import interface_text, report_text
from .hair_operator import HairOperator

PATIENCE = 0.4  # [s]: longer work gets a progress bar

# Navigation does not affect the computation.
_NAVIGATION = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE"}


class LongOperator(HairOperator):
    """Mixin of operators that implement `work`, `seconds` and `message`."""

    has_run = False  # in this session: its kernels are loaded
    _takes_much = False  # whether the artist has confirmed the memory use of the next run
    _asks = _is_confirming = False
    _status_text = ""  # in the status bar

    def work(self, context):
        """Return the work in steps (core/long_work.py)."""
        raise NotImplementedError

    def _whole_work(self, context):
        """Run `work` and its follow-up, undone completely on failure; returns the report."""

        def working(_changed):
            made = yield from self.work(context)
            self.after(context, made)
            sentence, values = self.message(made)
            return report_text(sentence, **values)

        return whole_changes.whole(working)(getattr(context, "object", None))

    def seconds(self, context):
        """Estimated duration of the work [s]."""
        raise NotImplementedError

    def message(self, made):
        """(sentence, values) of the report for the work's result."""
        raise NotImplementedError

    def stopped(self):
        """Report for canceled work."""
        return report_text("Canceled: nothing was changed.")

    def prefill(self, context):
        """Read settings from the object that is regenerated."""

    def after(self, context, made):
        """Select the result."""

    def invoke(self, context, event):
        """Compute immediately, or start in a thread."""
        self._event, self._asks = event, running.has_window() and not type(self)._takes_much
        LongOperator._takes_much = False
        self.prefill(context)
        try:
            is_quick = type(self).has_run and self.seconds(context) < PATIENCE
        except HairError as error:
            return self.refuse(error)
        return self.execute(context) if bpy.app.background or is_quick else self.begin(context)

    def execute(self, context):
        """Compute immediately."""
        if self._is_confirming:
            LongOperator._takes_much = True
            return self._begin_as_set() & {"FINISHED"} or {"CANCELLED"}
        try:
            if running.job() is not None:
                raise HairError("Hair is being computed: wait until it is done, or press Esc to cancel.")
            with memory.asking(self._asks):
                message = run_now(self._whole_work(context))
            return self._done(message)
        except memory.MuchMemory as much:
            return self._confirm(context, much)
        except HairError as error:
            return self.refuse(error)

    def begin(self, context):
        """Read the input and start computing in a thread."""
        try:
            if running.job() is not None:
                raise HairError("Hair is being computed: wait until it is done, or press Esc to cancel.")
            with memory.asking(self._asks), memory_as_sentence():
                self._work = self._whole_work(context)
                first = next(self._work)
            running.begin(context, Job(first), self._work)
        except memory.MuchMemory as much:
            return self._confirm(context, much)
        except HairError as error:
            return self.refuse(error)
        context.window_manager.modal_handler_add(self)
        self._show(context)
        return {"RUNNING_MODAL"}

    def begin_anew(self):
        """Invoke a copy of this operator after a dialog or a file browser, as Blender does not wait for these."""
        return self._invoke_anew(self.as_keywords())

    def _invoke_anew(self, values):
        category, name = self.bl_idname.split("_OT_")
        run = getattr(getattr(bpy.ops, category.lower()), name)
        return run("INVOKE_DEFAULT", **values)

    def _confirm(self, context, much):
        """Ask for confirmation of the memory use; Blender executes the operator if confirmed."""
        self._is_confirming = True
        title = interface_text("Use {percent}% of the Free Memory?", percent=much.percent)
        message = interface_text("These strands take {needed} GB.", needed=much.needed)
        return context.window_manager.invoke_confirm(self, self._event, title=title, message=message, icon="WARNING")

    def _begin_as_set(self):
        """Invoke a copy of this operator with the properties that are set."""
        names = [name for name in self.as_keywords() if self.properties.is_property_set(name)]
        return self._invoke_anew({name: getattr(self, name) for name in names})

    def modal(self, context, event):
        """Wait for the thread; write when it is done."""
        job = running.job()
        if job is None:  # the add-on was disabled
            return self._end(context, {"CANCELLED"})
        if event.type == "ESC" and event.value == "PRESS":
            job.stop()
        if event.type == "TIMER":
            if job.is_done:
                return self._advance(context, job)
            self._show(context)
        return {"PASS_THROUGH"} if event.type in _NAVIGATION else {"RUNNING_MODAL"}

    def cancel(self, context):
        """Stop when the window is closed or another file is opened."""
        self._end(context, {"CANCELLED"})

    def _advance(self, context, job):
        try:
            with memory_as_sentence():
                following = self._work.send(job.result())
            running.begin(context, Job(following), self._work)
            self._show(context)
            return {"RUNNING_MODAL"}
        except StopIteration as end:
            return self._end(context, self._done(end.value))
        except Stopped:
            self.report({"INFO"}, self.stopped())
            return self._end(context, {"CANCELLED"})
        except HairError as error:
            return self._end(context, self.refuse(error))
        except BaseException:  # a bug must not block the window forever
            self._end(context, {"CANCELLED"})
            raise

    def _done(self, message):
        type(self).has_run = True
        self.report({"INFO"}, message)
        return {"FINISHED"}

    def _end(self, context, outcome):
        running.end(context)
        _redraw(context)
        return outcome

    def _show(self, context):
        job = running.job()
        step = interface_text("Canceling" if job.is_stopping else job.step)
        message = interface_text("{step}: {percent}%    Press Esc to cancel", step=step, percent=round(100 * job.part))
        # A redraw of hair may take as long as the computation: redraw only on changes.
        if message != self._status_text:
            self._status_text = message
            context.workspace.status_text_set(message)
            _redraw(context)


def _redraw(context):
    for area in context.screen.areas:
        if area.type == "VIEW_3D":
            area.tag_redraw()
