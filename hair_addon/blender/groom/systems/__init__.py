# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair systems of a mesh: names, copies, problems, repairs, deletion."""

from typing import TYPE_CHECKING

from ....core.lazy import submodules

if TYPE_CHECKING:
    from . import copied_hair, diagnostics, edits, hair_systems, mask_suggestions
else:
    __getattr__ = submodules(__name__)
