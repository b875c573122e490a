# SPDX-License-Identifier: GPL-3.0-or-later
"""Place hair of the same surfaces and settings once, as placing takes longer than styles and has its own tests."""

import pytest

from tests.support import remembered


@pytest.fixture(scope="session", autouse=True)
def functions_remember():
    """Remember results, also for hair that fixtures of modules grow."""
    with pytest.MonkeyPatch.context() as patch:
        remembered.remember(patch)
        yield
