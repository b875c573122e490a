# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C, and a request to end: the command stops at its next step, a second one stops it at once.

Raised in the middle of anything, as Python does by itself, it would be lost in the callbacks that Blender calls.
"""

import signal
import threading

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """Whether somebody has asked a command to stop, from entering this to leaving it."""

    def __init__(self):
        self._number = None
        self._before = {}

    def __enter__(self):
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._ask) for number in _SIGNALS}
        return self

    def __exit__(self, *_error):
        for number, handler in self._before.items():
            # Blender's own handler, which Python knows nothing of, is None: the process is about to end.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)

    def _ask(self, number, _frame):
        is_again = self.is_asked
        self._number = number
        if is_again:
            raise KeyboardInterrupt

    @property
    def is_asked(self):
        """Whether to stop."""
        return self._number is not None

    @property
    def status(self):
        """The exit status of a command that was stopped, as shells have it: 130 after Ctrl-C, 143 after SIGTERM."""
        return 128 + (self._number or signal.SIGINT)
