# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of Hypothesis: no deadlines, as processors are shared. Imported by conftest.py of its tests."""

import hypothesis

hypothesis.settings.register_profile("untimed", deadline=None)
hypothesis.settings.load_profile("untimed")
