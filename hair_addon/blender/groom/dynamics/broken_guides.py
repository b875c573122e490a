# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides that become unstable in the simulation and are reset to their combed shape: the frame with most of them."""

from dataclasses import dataclass

from bpy.types import Curves

from ....core.errors import HairError
from ....core.files.frame_manifest import Manifest
from ...host.notices import name_of
from . import frame_folders

_NOTE = "broken"  # of a manifest


@dataclass(frozen=True, order=True)
class Broken:
    """The largest number of guides that broke in one frame."""

    count: int
    frame: int

    @property
    def notes(self) -> tuple[tuple[str, str], ...]:
        """Notes for a manifest; empty if no guide broke."""
        return ((_NOTE, f"{self.count} {self.frame}"),) if self.count else ()

    def message_of(self, guides: Curves) -> HairError:
        """Return the message for the user."""
        return HairError(
            '{count} of {total} guides of "{name}" broke in frame {frame} and were reset: increase Substeps.',
            count=self.count,
            total=len(guides.curves),
            name=name_of(guides),
            frame=self.frame,
        )


NONE = Broken(0, 0)


def noted(manifest: Manifest | None) -> Broken:
    """Return the `Broken` stored in a manifest."""
    for name, reason in () if manifest is None else manifest.notes:
        words = reason.split()
        if name == _NOTE and len(words) == 2 and all(word.lstrip("-").isdecimal() for word in words):
            return Broken(int(words[0]), int(words[1]))
    return NONE


def baked(guides: Curves) -> Broken:
    """Return the `Broken` of the baked frames of guides. Reads no file: panels call this on every redraw."""
    cached = frame_folders.folder_cache.get(guides.session_uid)
    return noted(None if cached is None or cached[1] is None else cached[1].manifest)
