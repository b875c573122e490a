# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of Hypothesis: the same examples in each run, and no time limits, as processors are shared.

Imported by conftest.py of its tests.
"""

import hypothesis
from hypothesis.internal.conjecture import providers

hypothesis.settings.register_profile(
    "repeatable", derandomize=True, deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("repeatable")

# Examples would also contain constants of the modules that the process has loaded, which differ between processes.
# Parsing all modules for them takes five seconds in a new clone.
providers._get_local_constants = lambda: providers._local_constants
