# SPDX-License-Identifier: GPL-3.0-or-later
"""Named selections of guides, which are saved and selected again."""

from bpy.types import Curves

from ....core.errors import HairError
from ...data.strands import curves, selection_sets
from ...host.notices import name_of
from ...settings import marks, style_items

_MOST_BYTES = 40  # of a name, as Blender limits the names of attributes


def save(guides: Curves, name: str) -> int:
    """Save the selected points of guides as a set; returns their number. Raises `HairError`."""
    _require_editable(guides)
    name = name.strip()
    if not name or len(name.encode()) > _MOST_BYTES:
        most = len(name.encode()[:_MOST_BYTES].decode(errors="ignore")) or _MOST_BYTES
        raise HairError("Give the selection a name of at most {most} letters.", most=most)
    selected = selection_sets.selected(guides)
    if selected is None:
        raise HairError("Select guides, or points of guides, in Sculpt Mode or Edit Mode first.")
    selection_sets.write(guides, name, selected)
    _mark_locks(guides, name)
    return int(selected.sum())


def select(guides: Curves, name: str, mode: str = "SET") -> int:
    """Select the points of a set; returns the number of selected points. Raises `HairError`.

    mode: "SET" replaces the selection, "ADD" extends it, "REMOVE" deselects the points of the set.
    """
    _require_editable(guides)
    chosen = _points_of(guides, name)
    selected = chosen
    if mode != "SET":
        present = selection_sets.present(guides)
        selected = present & ~chosen if mode == "REMOVE" else present | chosen
    if not selected.any():
        raise HairError("No point of the guides would be selected.")
    selection_sets.select(guides, selected)
    return int(selected.sum())


def remove(guides: Curves, name: str) -> None:
    """Remove a set. Raises `HairError`."""
    _require_editable(guides)
    _points_of(guides, name)
    selection_sets.remove(guides, name)
    _mark_locks(guides, name)


def _mark_locks(guides, name):
    """Mark hair that has the centers of its locks at the guides of a set."""
    for hair in curves.followers(guides):
        is_changing = hair.is_editable and not curves.is_combed(hair)
        if is_changing and name in style_items.center_guides_of(hair.vellus):
            marks.mark_geometry(hair.vellus, None)


def _points_of(guides, name):
    found = selection_sets.read(guides, name)
    if found is None:
        raise HairError('"{guides}" has no selection "{name}".', guides=name_of(guides), name=name)
    return found


def _require_editable(guides):
    curves.require_editable(guides)
    if not len(guides.points):
        raise HairError('"{name}" has no guides: generate guides first.', name=name_of(guides))
