# SPDX-License-Identifier: GPL-3.0-or-later
"""Update of keys and drivers when styles, layers of guides or maps are moved, removed or renamed.

Blender keys a style's setting by its index, as vellus.styles[0].curl.radius, and does not update the index.
"""

import re

import bpy

_PATH = r'vellus\.{owner}\[(?:(\d{{1,6}})|"((?:[^"\\]|\\.)*)")\](.*)'


class Rearrangement:
    """A change of a hair's styles: old `names`, their new indices `places` (None: removed), and `new_names`.

    owner: name of the list, "styles", "layers" or "maps".
    """

    def __init__(self, names, places, new_names, owner="styles"):
        self.start = f"vellus.{owner}["
        self._pattern = re.compile(_PATH.format(owner=owner), re.DOTALL)
        self._names, self._places, self._new_names = list(names), list(places), list(new_names)

    @property
    def is_empty(self):
        """Whether all styles kept place and name."""
        unmoved = [place is not None and place == before for before, place in enumerate(self._places)]
        return all(unmoved) and self._names == self._new_names[: len(self._names)]

    def path(self, path):
        """Return the new data path: unchanged if it is not of a style, None if its style was removed."""
        match = self._pattern.fullmatch(path)
        place = None if match is None else self._place_of(match)
        if place is None:
            return path
        to = self._places[place]
        if to is None:
            return None
        key = to if match[1] else f'"{bpy.utils.escape_identifier(self._new_names[to])}"'
        return f"{self.start}{key}]{match[3]}"

    def path_of_target(self, path):
        """Like `path` for a driver's target: the path of a removed style becomes invalid, as in Blender."""
        now = self.path(path)
        if now is not None:
            return now
        match = self._pattern.fullmatch(path)
        return f'{self.start}"{bpy.utils.escape_identifier(self._names[self._place_of(match)])}"]{match[3]}'

    def _place_of(self, match):
        """Return the old index of the style in a matched path, None if there is none."""
        if match[1]:
            return int(match[1]) if int(match[1]) < len(self._names) else None
        name = bpy.utils.unescape_identifier(match[2])
        return self._names.index(name) if name in self._names else None


def follow(curves, rearrangement):
    """Update the keys and drivers of Curves, and drivers that read their settings."""
    if rearrangement.is_empty:
        return
    animation = curves.animation_data
    if animation is not None:
        _follow_actions(curves, animation, rearrangement)
        _follow_curves(animation.drivers, rearrangement)
    for other in _all_animation():
        for curve in other.drivers:
            for target in (target for variable in curve.driver.variables for target in variable.targets):
                if target.id == curves and target.data_path.startswith(rearrangement.start):
                    target.data_path = rearrangement.path_of_target(target.data_path)


def _follow_curves(fcurves, rearrangement):
    for curve in list(fcurves):
        now = rearrangement.path(curve.data_path)
        if now is None:
            fcurves.remove(curve)
        elif now != curve.data_path:
            curve.data_path = now


def _follow_actions(curves, animation, rearrangement):
    """Update the active action, NLA strips, and unassigned actions with slots of these Curves."""
    done, identifiers = {}, {animation.last_slot_identifier}
    for user in (animation, *_strips(animation)):
        action, slot = user.action, user.action_slot
        if action is None or slot is None:
            continue
        identifiers.add(slot.identifier)
        key = action.session_uid, slot.handle
        if key not in done:
            done[key] = _follow_action(curves, action, slot, rearrangement)
        if done[key] != action:
            user.action = done[key]
            user.action_slot = next(s for s in user.action.slots if s.handle == slot.handle)
    for action in bpy.data.actions:
        for slot in action.slots:
            if slot.identifier in identifiers - {""} and not slot.users() and action.is_editable:
                _follow_action(curves, action, slot, rearrangement)


def _follow_action(curves, action, slot, rearrangement):
    """Return the action with updated paths: a copy if other datablocks use it or it is linked."""
    handle = slot.handle
    paths = [curve.data_path for bag in _channelbags(action, handle) for curve in bag.fcurves]
    if all(rearrangement.path(path) == path for path in paths):
        return action
    if not action.is_editable or any(user != curves for user in slot.users()):
        action = action.copy()
    for bag in _channelbags(action, handle):
        _follow_curves(bag.fcurves, rearrangement)
    return action


def keyed_paths(curves):
    """Return the data paths of Curves that are keyed, in NLA strips, or driven."""
    animation = curves.animation_data
    if animation is None:
        return set()
    moving = [fcurve.data_path for fcurve in animation.drivers]
    for user in (animation, *_strips(animation)):
        if user.action is not None and user.action_slot is not None:
            bags = _channelbags(user.action, user.action_slot.handle)
            moving += [fcurve.data_path for bag in bags for fcurve in bag.fcurves]
    return set(moving)


def _channelbags(action, handle):
    strips = (strip for layer in action.layers for strip in layer.strips)
    return [bag for strip in strips for bag in strip.channelbags if bag.slot_handle == handle]


def _strips(animation):
    """Yield all NLA strips, including those in meta strips."""
    waiting = [strip for track in animation.nla_tracks for strip in track.strips]
    while waiting:
        strip = waiting.pop()
        waiting += strip.strips
        yield strip


def _all_animation():
    """Yield the animation data of all datablocks, including embedded node trees."""
    for block in bpy.data.all_ids:
        for owner in (block, getattr(block, "node_tree", None)):
            animation = getattr(owner, "animation_data", None)
            if animation is not None:
                yield animation
