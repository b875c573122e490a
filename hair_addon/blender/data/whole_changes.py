# SPDX-License-Identifier: GPL-3.0-or-later
"""Atomic changes of the open file: after an error or Esc, the file is as before.

A change compares the file with its state at the beginning: new datablocks are removed, and from changed datablocks new
vertex groups, attributes, modifiers, materials, styles and flags.
"""

import contextlib
import functools
import inspect
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, ParamSpec, TypeVar

import bpy
from bpy.types import ID, Curves, Mesh, Object, Scene

from ...core.long_work import Work
from ..host.notices import name_of
from . import thin_hair

P = ParamSpec("P")
T = TypeVar("T")

# Collections of Blender's interface and of libraries, and the one of all datablocks.
_NOT_OURS = {"all_ids", "libraries", "screens", "window_managers", "workspaces"}

_open: list["_Change"] = []  # running changes, the outermost first; empty between calls


def whole(work: Callable[P, Work[T]]) -> Callable[P, Work[T]]:
    """Decorate work in steps so that it is undone completely if it fails or is stopped.

    The work may change the objects and Curves among its arguments, and their surfaces.
    """

    @functools.wraps(work)
    def working(*given: P.args, **options: P.kwargs) -> Work[T]:
        change, steps, answer = _Change([*given, *options.values()]), None, None
        try:
            with change.noting():
                steps = work(*given, **options)
            while True:
                with change.noting():
                    step, ended = _next(steps, answer)
                if step is None:
                    change.end()
                    return ended
                answer = yield step
        except BaseException:  # Esc too
            if steps is not None:
                with change.noting():
                    steps.close()
            change.undo()
            raise

    return working


def whole_if_new(work: Callable[P, Work[T]]) -> Callable[P, Work[T]]:
    """`whole` for work whose argument `target` is None; work with a target runs unguarded, as at each update."""
    guarded, signature = whole(work), inspect.signature(work)

    @functools.wraps(work)
    def chosen(*given: P.args, **options: P.kwargs) -> Work[T]:
        is_new = signature.bind(*given, **options).arguments.get("target") is None
        return (guarded if is_new else work)(*given, **options)

    return chosen


@contextlib.contextmanager
def whole_change(*given: Any) -> Iterator[None]:
    """`whole` for a single context; given: objects and Curves that are changed."""
    change = _Change(given)
    try:
        with change.noting():
            yield
    except BaseException:
        change.undo()
        raise
    change.end()


def keep_copy(curves_object: Object) -> None:
    """Copy an object that is about to be converted in place, so that the running change can restore it if it fails.

    The copy then replaces the object in the file.
    """
    if _open:
        _open[0].keep_copy(curves_object)


def backup_copies() -> set[int]:
    """Session UIDs of the copies of objects and their data by `keep_copy`, which other code must ignore."""
    return {uid for change in _open for uid in change.copies()}


def _next(steps, answer):
    """Return (the next step, None), or (None, the result)."""
    try:
        return steps.send(answer), None
    except StopIteration as end:
        return None, end.value


@dataclass(frozen=True)
class _Copy:
    """Session UIDs of an object's copy, of the copy's data and of the object's data; their names; the collections."""

    uid: int
    data: int
    own_data: int
    name: str
    data_name: str
    collections: tuple[int, ...]


class _Change:
    """The state before a change, without references to datablocks, as an undo may happen between two steps."""

    def __init__(self, given: Iterable[Any]) -> None:
        self._there = {*_datablocks()}
        self._made: set[int] = set()  # session UIDs
        self._copies: dict[int, _Copy] = {}  # by session UID of the object
        self._owners = {owner.session_uid: _state_of(owner) for owner in _owners(given)}
        self._without_rest = {o.session_uid for o in bpy.data.objects if not o.add_rest_position_attribute}
        scene, layer = bpy.context.scene, bpy.context.view_layer
        active = None if layer is None else layer.objects.active
        self._active = (0, "OBJECT") if active is None else (active.session_uid, active.mode)
        self._selected = set() if layer is None else {o.session_uid for o in layer.objects.selected if o is not None}
        self._thin = None if scene is None else (scene.session_uid, *thin_hair.state_of(scene))

    @contextlib.contextmanager
    def noting(self):
        """Note the datablocks that are created in a context."""
        before = _datablocks().keys()
        _open.append(self)
        try:
            yield
        finally:
            _open.remove(self)
            self._made |= _datablocks().keys() - before

    def keep_copy(self, curves_object):
        if curves_object.session_uid in self._copies:
            return
        copy = curves_object.copy()
        copy.data = curves_object.data.copy()
        names = name_of(curves_object), name_of(curves_object.data)
        collections = tuple(one.session_uid for one in curves_object.users_collection)
        saved = _Copy(copy.session_uid, copy.data.session_uid, curves_object.data.session_uid, *names, collections)
        self._copies[curves_object.session_uid] = saved

    def copies(self):
        """Return the session UIDs of the copies that may still be needed, and of their data."""
        return {uid for saved in self._copies.values() for uid in (saved.uid, saved.data)}

    def end(self):
        """Finish the change, which only an enclosing change can still undo."""
        if _open:
            _open[-1]._owners = self._owners | _open[-1]._owners
        present = _datablocks()
        for saved in self._copies.values():
            if saved.uid in present:
                _remove_object(present[saved.uid])
        self._copies.clear()

    def undo(self):
        """Restore the state before the change."""
        layer = bpy.context.view_layer
        active = None if layer is None else layer.objects.active
        if active is not None and (active.session_uid, active.mode) != self._active and active.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        present = _datablocks()
        for uid, state in self._owners.items():
            if uid in present:
                _restore(present[uid], state)
        for one in bpy.data.objects:
            if one.session_uid in self._without_rest and one.add_rest_position_attribute:
                one.add_rest_position_attribute = False
        if self._thin is not None and self._thin[0] in present:
            thin_hair.restore(present[self._thin[0]], *self._thin[1:])
        for uid, saved in self._copies.items():
            if uid in self._there and saved.uid in present:
                _put_back(present, uid, saved)
                self._made -= {saved.uid, saved.data}
        _remove(self._made - {uid for outer in _open for uid in outer.copies()})
        present = _datablocks()
        for uid, saved in self._copies.items():
            if uid in self._there and saved.uid in present:
                present[saved.uid].name, present[saved.uid].data.name = saved.name, saved.data_name
        if layer is not None:
            layer.update()  # otherwise the layer still lists removed objects as None
            self._select(layer)

    def _select(self, layer):
        selected = self._selected | {self._copies[uid].uid for uid in self._selected & self._copies.keys()}
        for one in layer.objects:
            if one.select_get(view_layer=layer) != (one.session_uid in selected):
                one.select_set(one.session_uid in selected, view_layer=layer)
        uid, mode = self._active
        uid = self._copies[uid].uid if uid in self._copies else uid
        active = next((one for one in layer.objects if one.session_uid == uid), None)
        if layer.objects.active != active:
            layer.objects.active = active
        if active is not None and active.mode != mode:
            bpy.ops.object.mode_set(mode=mode)


def _datablocks():
    """Return {session UID: datablock} of the open file."""
    collections = (p.identifier for p in bpy.data.bl_rna.properties if p.type == "COLLECTION")
    kinds = (getattr(bpy.data, kind) for kind in collections if kind not in _NOT_OURS)
    return {one.session_uid: one for kind in kinds for one in kind}


def _owners(given):
    """Return the objects and Curves among arguments, with their data, guides and surfaces."""
    listed = [one for value in given for one in (value if isinstance(value, list | tuple) else [value])]
    found: list[ID] = []
    waiting = [one for one in listed if isinstance(one, Object | Curves)]
    while waiting:
        one = waiting.pop()
        if one is None or one in found:
            continue
        found.append(one)
        if isinstance(one, Object):
            waiting += [one.data] if isinstance(one.data, Curves | Mesh) else []
        elif isinstance(one, Curves):
            waiting += [one.surface, one.vellus.guide_curves, *(o for o in bpy.data.objects if o.data == one)]
    return found


def _state_of(owner):
    """Return the parts of a datablock that `_restore` compares."""
    if isinstance(owner, Object):
        return {
            "vertex_groups": [name_of(group) for group in owner.vertex_groups],
            "modifiers": {name_of(m): (m.show_viewport, m.show_render) for m in owner.modifiers},
            "active_group": owner.vertex_groups.active_index,
            "hidden": (_is_hidden(owner), owner.hide_render),
        }
    state: dict[str, Any] = {
        "attributes": {name_of(one) for one in owner.attributes},
        "materials": len(owner.materials),
    }
    if isinstance(owner, Mesh):
        return state | {"active_uv": owner.uv_layers.active_index}
    guides = owner.vellus.guide_curves
    styles = [name_of(item) for item in owner.vellus.styles]
    return state | {
        "guides": None if guides is None else guides.session_uid,
        "styles": styles,
        "active_style": owner.vellus.active_style,
    }


def _is_hidden(one):
    """Whether an object is hidden by its eye in the view layer; False if it is in none."""
    return bpy.context.view_layer is not None and one.hide_get()


def _is_in_layer(one):
    """Whether an object is in the view layer; compared one by one, as names may be unreadable."""
    layer = bpy.context.view_layer
    return layer is not None and any(other == one for other in layer.objects)


def _restore(owner, state):
    """Remove new parts of a datablock. Unchanged values are not written, so that nothing is evaluated again."""
    if isinstance(owner, Object):
        for collection, names in ((owner.vertex_groups, "vertex_groups"), (owner.modifiers, "modifiers")):
            for one in [one for one in collection if name_of(one) not in state[names]]:
                collection.remove(one)
        for modifier in owner.modifiers:
            shown = state["modifiers"][name_of(modifier)]
            if (modifier.show_viewport, modifier.show_render) != shown:
                modifier.show_viewport, modifier.show_render = shown
        if owner.vertex_groups.active_index != state["active_group"]:
            owner.vertex_groups.active_index = state["active_group"]
        if (_is_hidden(owner), owner.hide_render) != state["hidden"]:
            hidden, owner.hide_render = state["hidden"]
            if _is_in_layer(owner):
                owner.hide_set(hidden)
        return
    for name in [name_of(one) for one in owner.attributes if name_of(one) not in state["attributes"]]:
        owner.attributes.remove(owner.attributes[name])
    while len(owner.materials) > state["materials"]:
        owner.materials.pop()
    if isinstance(owner, Mesh):
        if owner.uv_layers.active_index != state["active_uv"]:
            owner.uv_layers.active_index = state["active_uv"]
        return
    styles, guides = owner.vellus.styles, owner.vellus.guide_curves
    for place in reversed([index for index, item in enumerate(styles) if name_of(item) not in state["styles"]]):
        styles.remove(place)
    if owner.vellus.active_style != state["active_style"]:
        owner.vellus.active_style = state["active_style"]
    if (None if guides is None else guides.session_uid) != state["guides"]:
        found = (one for one in bpy.data.hair_curves if one.session_uid == state["guides"])
        owner.vellus.guide_curves = next(found, None)


def _put_back(present, uid, saved):
    """Replace an object by its copy, also if the object was deleted."""
    changed, copy, own_data = present.get(uid), present[saved.uid], present.get(saved.own_data)
    is_converted = changed is not None and own_data is not None and changed.data != own_data
    if changed is not None:
        changed.user_remap(copy)
        _remove_object(changed)
    masters = {one.collection.session_uid: one.collection for one in bpy.data.scenes}
    for collection in (masters.get(uid, present.get(uid)) for uid in saved.collections):
        if collection is not None and all(one != copy for one in collection.objects):
            collection.objects.link(copy)
    if is_converted:  # Blender does not change the data that it converts
        of_copy, copy.data = copy.data, own_data
        bpy.data.batch_remove([of_copy])


def _remove_object(one):
    data = one.data
    bpy.data.objects.remove(one)
    if data is not None and not data.users:
        bpy.data.batch_remove([data])


def _remove(made):
    """Remove datablocks, except those that other datablocks use now."""
    present = _datablocks()
    bpy.data.batch_remove([one for uid, one in present.items() if uid in made and isinstance(one, Object)])
    present = _datablocks()
    left = {one for uid, one in present.items() if uid in made}
    users = bpy.data.user_map(subset=left)
    placed = (bpy.types.Collection, Scene)
    used = {one for one in left if not isinstance(one, placed) and any(user not in left for user in users[one])}
    bpy.data.batch_remove(left - used)
