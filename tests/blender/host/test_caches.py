# SPDX-License-Identifier: GPL-3.0-or-later
"""Values in caches are computed once, evicted, and computed again."""

import sys
from concurrent.futures import ThreadPoolExecutor

from hair_addon.blender.host.caches import Cache


def test_a_value_is_made_once_until_it_is_invalid():
    cache, made = Cache(), []

    def ask(key):
        return cache.get(key, lambda: made.append(key) or len(made))

    assert [ask("a"), ask("b"), ask("a")] == [1, 2, 1]
    cache.invalidate("a")
    assert cache.get("a") is None
    assert [ask("a"), ask("b")] == [3, 2]
    cache.clear()
    assert len(cache) == 0
    assert ask("b") == 4


def test_what_fails_to_be_made_is_not_kept():
    cache = Cache()

    def fail():
        raise ValueError

    for _ in range(2):
        try:
            cache.get("a", fail)
        except ValueError:
            assert len(cache) == 0


def test_a_function_is_called_once_with_the_same_arguments():
    cache, called = Cache(), []

    @cache.keeping
    def one(*given):
        """Say so."""
        called.append(given)
        return len(called)

    @cache.keeping
    def other(*given):
        called.append(given)
        return len(called)

    assert [one(), one("a"), other("a"), one("a"), one(), other("a")] == [1, 2, 3, 2, 1, 3]
    assert one.__doc__ == "Say so."
    cache.clear()
    assert one("a") == 4


def test_what_was_used_longest_ago_gives_way():
    cache = Cache(capacity=2)
    cache.keep("a", 1), cache.keep("b", 2)
    cache.get("a")
    cache.keep("c", 3)
    assert [cache.get(key) for key in "abc"] == [1, None, 3]
    cache.keep("a", 4)
    cache.keep("d", 5)
    assert cache.values() == [4, 5]


def test_values_in_use_have_room_until_fewer_are_in_use():
    cache = Cache(capacity=1)
    cache.make_room(3)
    for key in "abcd":
        cache.keep(key, key)
    assert cache.values() == ["a", "b", "c", "d"]
    cache.make_room(1)
    cache.keep("e", "e")
    assert cache.values() == ["d", "e"]


def test_another_value_takes_the_place_of_the_one_before():
    cache = Cache()
    cache.keep("a", 1)
    assert cache.keep("a", 2) == 2
    assert cache.values() == [2]


def test_threads_share_a_full_cache():
    """A render in a thread and viewports use the same caches: a value is not missed while another thread reads it."""
    cache, switching = Cache(capacity=8), sys.getswitchinterval()

    def use(own):
        for turn in range(20_000):
            assert cache.get((own, turn), lambda: own + 1) == own + 1
            assert cache.get("shared") == "value"

    cache.keep("shared", "value")
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(3) as threads:
            assert list(threads.map(use, range(3))) == [None] * 3
    finally:
        sys.setswitchinterval(switching)
    assert len(cache) == 8
