# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of Hypothesis: the same examples in each run, and no time limits, as processors are shared.

Imported by conftest.py of its tests.
"""

import hypothesis

hypothesis.settings.register_profile(
    "repeatable", derandomize=True, deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("repeatable")
