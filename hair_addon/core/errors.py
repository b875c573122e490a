# SPDX-License-Identifier: GPL-3.0-or-later
"""The one exception that is meant for the user's eyes."""


class HairError(Exception):
    """Something the user can mend: one sentence that says what is wrong and what to do."""
