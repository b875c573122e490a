# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache: values that may be dropped at any time, and are made again when they are asked for.

blender/live/invalidation.py lists every cache of the add-on; blender/live/events.py says what makes them stale.
"""

from functools import wraps


class Cache:
    """Values by key, of which none is None.

    capacity: the maximum number of values; the least recently used is dropped first. None for no limit.
    """

    def __init__(self, capacity=None):
        self._values, self._capacity = {}, capacity

    def __len__(self):
        return len(self._values)

    def get(self, key, make=None):
        """The value of a key. Where there is none: what make() returns, which is kept; None without `make`."""
        value = self._values.get(key)
        if value is None:
            return None if make is None else self.keep(key, make())
        return value if self._capacity is None else self.keep(key, value)

    def keep(self, key, value):
        """Keep the value of a key in place of the one before; returns it."""
        self._values.pop(key, None)
        self._values[key] = value
        while self._capacity is not None and len(self._values) > self._capacity:
            del self._values[next(iter(self._values))]
        return value

    def keeping(self, make):
        """Decorate a function: it is called once with the same arguments, and what it returns is kept."""

        @wraps(make)
        def kept(*arguments, **options):
            return self.get((make, arguments, *options.items()), lambda: make(*arguments, **options))

        return kept

    def values(self):
        """All values, the one used longest ago first."""
        return list(self._values.values())

    def invalidate(self, key):
        """Drop the value of a key: what it was made of has changed."""
        self._values.pop(key, None)

    def clear(self):
        """Drop all values."""
        self._values.clear()
