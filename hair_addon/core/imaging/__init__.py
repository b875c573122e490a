# SPDX-License-Identifier: GPL-3.0-or-later
"""Images: pixel sampling, cameras, environment lighting, detection of truncated files."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        ambient_cube,
        blackbody,
        cryptomatte,
        environment,
        flip,
        lamps,
        panorama,
        picture_checks,
        pixel_sampling,
        texture_means,
        thin_lens,
    )
else:
    __getattr__ = submodules(__name__)
