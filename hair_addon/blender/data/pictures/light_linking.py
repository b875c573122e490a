# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking: the objects that a light illuminates, and the objects that cast its shadows."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Links:
    """Session UIDs of objects that a rule includes and excludes; without included objects it applies to all others."""

    included: frozenset
    excluded: frozenset

    def has(self, owner):
        """Whether the rule applies to an object; owner: session UIDs of its instancer, or 0, and of the object.

        An instance follows its instancer if the rule contains the instancer, as in Cycles.
        """
        known = self.included | self.excluded
        uid = next((uid for uid in owner if uid in known), None)
        return uid not in self.excluded and (not self.included or uid in self.included)


ALL = Links(frozenset(), frozenset())


def read_links(light_object):
    """Return (`Links` of the objects that an original light illuminates, `Links` of the objects that cast its
    shadows).
    """
    linking = light_object.light_linking
    return _links(linking.receiver_collection), _links(linking.blocker_collection)


def _links(collection):
    if collection is None:
        return ALL
    states = {}  # the last state applies: objects after collections
    for child, item in zip(collection.children, collection.collection_children, strict=True):
        states |= dict.fromkeys((o.session_uid for o in child.all_objects), item.light_linking.link_state)
    for linked, item in zip(collection.objects, collection.collection_objects, strict=True):
        states[linked.session_uid] = item.light_linking.link_state
    return Links(*(frozenset(uid for uid, state in states.items() if state == one) for one in ("INCLUDE", "EXCLUDE")))
