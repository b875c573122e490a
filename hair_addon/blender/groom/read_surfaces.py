# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading of the surface that guides and hair grow on: the present one, or the one that hair is bound to."""

from bpy.types import Curves, Depsgraph, Object

from ...core.errors import HairError
from ..data import scene
from ..data.strands import curves, curves_objects, partings
from ..data.surfaces import Surface
from ..settings import map_items, style_items
from . import bindings
from .bindings import BoundHair


def read(surface_object: Object | None, depsgraph: Depsgraph, target: Curves | None = None) -> Surface:
    """Return the `Surface` that guides and hair grow on, the `sized_cage` of an editable mesh object.

    If it equals the surface that `target` is bound to, that one is returned, as its normals and areas are cached. The
    surface of hair of a library is only used to deform the hair. Raises `HairError`.
    """
    if target is None or not curves.follows_library(target):
        require_mesh(surface_object)
        curves_objects.store_rest_positions(surface_object)
    surface, bound = scene.read_surface(surface_object, depsgraph).sized_cage, target and bindings.of(target)
    if bound is not None and (bound.surface.is_same(surface) or _is_as_bound(bound, surface, target)):
        surface = bound.surface
    return surface


def _is_as_bound(bound: BoundHair, surface: Surface, target: Curves) -> bool:
    """Whether only the level of subdivision has changed since hair was bound, and hair reads no masks or maps of faces.

    Strands then keep that level, as viewports have other levels than renders.
    """
    state = target.vellus
    reads_faces = partings.is_wanted(state.hair) or style_items.have_masks(state) or map_items.read_faces(state)
    return not reads_faces and bound.surface.is_same_cage(surface)


def require_mesh(surface_object: Object | None) -> None:
    """Raise `HairError` unless hair may grow on an object."""
    if surface_object is None or surface_object.type != "MESH":
        raise HairError("Hair needs a mesh object to grow on: select one.")
    curves.require_overridable(surface_object)
