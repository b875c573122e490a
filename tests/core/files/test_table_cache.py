# SPDX-License-Identifier: GPL-3.0-or-later
"""Cached tables match the request, or are baked again."""

import os

import numpy as np
import pytest

from hair_addon.core.files import table_cache
from hair_addon.core.shading.tables import lookup_tables

SETTINGS = lookup_tables.Settings(mode="energy", size=16)


@pytest.fixture
def bakes(monkeypatch):
    """Return a list of the settings of every bake, in order."""
    baked, bake = [], lookup_tables.bake
    monkeypatch.setattr(lookup_tables, "bake", lambda settings, device: (baked.append(settings), bake(settings))[1])
    return baked


def sets_in(folder):
    return [path for path in folder.iterdir() if path.name.startswith("tables-")]


def test_tables_are_baked_once(tmp_path, bakes):
    first = table_cache.tables(tmp_path, SETTINGS, "1")
    second = table_cache.tables(tmp_path, SETTINGS, "1")
    assert bakes == [SETTINGS]
    np.testing.assert_array_equal(second.n, lookup_tables.to_half(first.n))
    assert second.settings == SETTINGS


@pytest.mark.parametrize("other", [{"eta": 1.5500001}, {"mode": "classic"}, {"sigma_a": (0.1, 0.2, 0.3)}])
def test_other_settings_are_another_set(tmp_path, bakes, other):
    settings = lookup_tables.Settings(**({"mode": "energy", "size": 16} | other))
    table_cache.tables(tmp_path, SETTINGS, "1")
    assert table_cache.tables(tmp_path, settings, "1").settings == settings
    assert table_cache.tables(tmp_path, SETTINGS, "1").settings == SETTINGS
    assert len(bakes) == 2


def test_another_version_bakes_for_itself(tmp_path, bakes):
    for version in ("1", "2", "1", "2"):
        table_cache.tables(tmp_path, SETTINGS, version)
    assert len(bakes) == 2


@pytest.mark.parametrize("damage", ["truncated", "missing", "foreign", "edited", "of other settings"])
def test_what_is_damaged_is_made_again(tmp_path, bakes, damage):
    expected = table_cache.tables(tmp_path, SETTINGS, "1")
    (place,) = sets_in(tmp_path)
    path = place / "n.exr"
    data = path.read_bytes()
    if damage == "truncated":
        path.write_bytes(data[: len(data) // 2])
    elif damage == "missing":
        path.unlink()
    elif damage == "foreign":
        path.write_bytes(b"not an image")
    elif damage == "edited":
        path.write_bytes(data[:-40] + bytes(40))
    else:
        table_cache.tables(tmp_path, lookup_tables.Settings(mode="energy", size=16, eta=1.4), "1")
        (other,) = (found for found in sets_in(tmp_path) if found != place)
        for name in os.listdir(other):
            (place / name).write_bytes((other / name).read_bytes())
    bakes.clear()
    again = table_cache.tables(tmp_path, SETTINGS, "1")
    assert bakes == [SETTINGS]
    np.testing.assert_array_equal(again.n, expected.n)
    table_cache.tables(tmp_path, SETTINGS, "1")
    assert bakes == [SETTINGS]


def test_only_so_many_are_kept_and_the_last_used_stay(tmp_path, bakes):
    (tmp_path / "letter.txt").write_text("not a table")
    (tmp_path / "tables-of-mine").mkdir()
    settings = [lookup_tables.Settings(size=16, eta=1.3 + 0.1 * index) for index in range(4)]
    for each in settings[:3]:
        table_cache.tables(tmp_path, each, "1", capacity=3)
    table_cache.tables(tmp_path, settings[0], "1", capacity=3)
    table_cache.tables(tmp_path, settings[3], "1", capacity=3)  # takes the place of the second
    assert len(sets_in(tmp_path)) == 4  # with the folder that is not ours
    bakes.clear()
    for index in (0, 2, 3):
        table_cache.tables(tmp_path, settings[index], "1", capacity=3)
    assert bakes == []
    assert (tmp_path / "letter.txt").exists() and (tmp_path / "tables-of-mine").exists()


def test_a_folder_that_cannot_be_written_costs_no_more_than_a_bake(tmp_path, bakes):
    (tmp_path / "file").write_text("in the way")
    for _ in range(2):
        assert table_cache.tables(tmp_path / "file", SETTINGS, "1").settings == SETTINGS
    assert len(bakes) == 2
