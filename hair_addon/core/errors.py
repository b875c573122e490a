# SPDX-License-Identifier: GPL-3.0-or-later
"""The one exception that is meant for the user's eyes."""


class HairError(Exception):
    """Something the user can mend: one sentence that says what is wrong and what to do.

    Values may be kept apart, HairError("{name} has no faces.", name=…), so that the sentence can be translated.
    """

    def __init__(self, sentence, **values):
        super().__init__(sentence.format(**values) if values else sentence)
        self.sentence, self.values = sentence, values
