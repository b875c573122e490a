# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair of the same surfaces and settings is placed once: placing is tested beside, and takes longer than styles do."""

import pytest

from tests.support import remembered


@pytest.fixture(scope="session", autouse=True)
def functions_remember():
    """For hair that fixtures of modules grow, too."""
    with pytest.MonkeyPatch.context() as patch:
        remembered.remember(patch)
        yield
