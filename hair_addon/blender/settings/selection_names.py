# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of the saved selections of guides: boolean attributes of points."""

from ..host.notices import name_of

PREFIX = "selection_"


def names_of(datablock):
    """Return the sorted names of the saved selections of guides."""
    found = [name_of(one) for one in datablock.attributes if (one.data_type, one.domain) == ("BOOLEAN", "POINT")]
    return sorted(name.removeprefix(PREFIX) for name in found if name.startswith(PREFIX))
