# SPDX-License-Identifier: GPL-3.0-or-later
"""Modal operators without a window: simulated events."""

from types import SimpleNamespace

from hair_addon.blender.host import running
from hair_addon.blender.ui.operators.base.modal import LongOperator

TIMER = SimpleNamespace(type="TIMER", value="NOTHING")
ESC = SimpleNamespace(type="ESC", value="PRESS")


class Operator(LongOperator):
    """Mock of a registered operator, which only Blender can create."""

    def __init__(self, work):
        self._given, self.reported = work, []

    def work(self, _context):
        return self._given

    def message(self, made):
        return "{count} guides", {"count": made}

    def report(self, kinds, text):
        self.reported.append((*kinds, text))


def drive(operator, window):
    """Send timer events until the operator ends."""
    outcome = operator.begin(window)
    while outcome == {"RUNNING_MODAL"}:
        if running.job().is_done or operator.reported:
            outcome = operator.modal(window, TIMER)
    return outcome
