# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer of grooms to other meshes; all settings of a hair."""

from typing import TYPE_CHECKING

from ....core.lazy import submodules

if TYPE_CHECKING:
    from . import (
        carried_masks,
        groom_settings,
        library_groom,
        system_transfer,
        transferred_names,
    )
else:
    __getattr__ = submodules(__name__)
