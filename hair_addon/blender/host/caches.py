# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache: values that can be dropped at any time, and are recomputed on demand.

blender/live/invalidation.py lists every cache of the add-on; blender/live/events.py invalidates them.
"""

from functools import wraps
from threading import RLock


class Cache:
    """Values by key; no value is None.

    capacity: the maximum number of values; the least recently used value is dropped first. None for no limit.
    """

    def __init__(self, capacity=None):
        self._values, self._capacity, self._least = {}, capacity, capacity
        self._lock = RLock()  # a render runs in a thread beside viewports

    def __len__(self):
        return len(self._values)

    def get(self, key, make=None):
        """Return the value of a key. A missing value is computed by make() and stored; None without `make`."""
        with self._lock:
            value = self._values.get(key)
            if value is not None:
                return value if self._capacity is None else self.keep(key, value)
        return None if make is None else self.keep(key, make())

    def keep(self, key, value):
        """Set the value of a key, and return it."""
        with self._lock:
            self._values.pop(key, None)
            self._values[key] = value
            while self._capacity is not None and len(self._values) > self._capacity:
                del self._values[next(iter(self._values))]
        return value

    def make_room(self, count):
        """Make room for `count` values that are in use, beyond the initial capacity.

        Of values that are read in turn and do not all fit, each would be dropped before it is read again.
        """
        self._capacity = self._least + count

    def keeping(self, make):
        """Decorate a function: store its result for each set of arguments."""

        @wraps(make)
        def cached(*arguments, **options):
            return self.get((make, arguments, *options.items()), lambda: make(*arguments, **options))

        return cached

    def values(self):
        """Return all values, the least recently used first."""
        with self._lock:
            return list(self._values.values())

    def invalidate(self, key):
        """Drop the value of a key, as its inputs have changed."""
        with self._lock:
            self._values.pop(key, None)

    def clear(self):
        """Drop all values."""
        with self._lock:
            self._values.clear()
