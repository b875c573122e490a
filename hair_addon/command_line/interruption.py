# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C and SIGTERM: the command stops at its next step; a second signal stops it at once.

Python's own KeyboardInterrupt can be raised anywhere, and would be lost in Blender's callbacks.
"""

import signal
import threading

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """Context manager that records requests to stop the command."""

    def __init__(self):
        self._number = None
        self._before = {}

    def __enter__(self):
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._ask) for number in _SIGNALS}
        return self

    def __exit__(self, *_error):
        for number, handler in self._before.items():
            # Blender's own handler, not set by Python, is None: the process is about to exit.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)

    def _ask(self, number, _frame):
        is_again = self.is_asked
        self._number = number
        if is_again:
            raise KeyboardInterrupt

    @property
    def is_asked(self):
        """Whether a stop was requested."""
        return self._number is not None

    @property
    def status(self):
        """The exit status of a stopped command, as in shells: 130 after Ctrl-C, 143 after SIGTERM."""
        return 128 + (self._number or signal.SIGINT)
