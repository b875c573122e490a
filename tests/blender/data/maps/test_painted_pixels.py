# SPDX-License-Identifier: GPL-3.0-or-later
"""Only changed texels of painted images, and strands at these, are read again, with the same result as reading all."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.maps import image_pixels, sources, strand_maps
from hair_addon.blender.host.caches import Cache
from hair_addon.blender.settings import map_items
from hair_addon.core.maps import pixels
from hair_addon.core.maps.map_settings import MapSettings


def converted_rows(monkeypatch):
    """Return a list of the rows that are converted from now on."""
    counts = []
    for name in ("colors", "masks"):
        convert = getattr(pixels, name)

        def counting(values, *given, _convert=convert, **options):
            counts.append(len(values))
            return _convert(values, *given, **options)

        monkeypatch.setattr(pixels, name, counting)
    convert_box = pixels.convert_box

    def counting_box(values, box, *given, **options):
        counts.append(box[0].stop - box[0].start)
        convert_box(values, box, *given, **options)

    monkeypatch.setattr(pixels, "convert_box", counting_box)
    return counts


def fresh(image, is_color):
    image_pixels.converted_cache.clear()
    return image_pixels.read(image, is_color)[None]


@pytest.mark.parametrize("is_color", [True, False])
@pytest.mark.parametrize("is_float", [False, True])
def test_strokes_convert_their_rows_alone(hair, rng, monkeypatch, is_color, is_float):
    """A stroke over five rows converts five rows; earlier results keep their values, and all rows equal a new
    conversion.
    """
    image = bpy.data.images.new("Painted", 64, 40, alpha=True, float_buffer=is_float)
    values = rng.random((40, 64, 4), np.float32)
    image.pixels.foreach_set(values.ravel())
    before = image_pixels.read(image, is_color)[None]
    kept = before.copy()
    counts = converted_rows(monkeypatch)
    assert image_pixels.read(image, is_color)[None] is before
    assert counts == []
    values[7:12, 3:9] = (0.0, 1.0, 0.5, 0.25)
    image.pixels.foreach_set(values.ravel())
    after = image_pixels.read(image, is_color)[None]
    assert counts == [5]
    np.testing.assert_array_equal(before, kept)
    assert not np.array_equal(after, before)
    np.testing.assert_array_equal(after, fresh(image, is_color))


def test_other_color_spaces_and_sizes_convert_all(hair, rng):
    """An image whose color space or size changes is converted as a whole."""
    image = bpy.data.images.new("Painted", 16, 16, alpha=True)
    values = rng.random(16 * 16 * 4, np.float32)
    image.pixels.foreach_set(values)
    before = image_pixels.read(image, True)[None]
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(values)
    found = image_pixels.read(image, True)[None]
    assert not np.array_equal(found, before)
    np.testing.assert_array_equal(found, fresh(image, True))
    image.scale(8, 8)
    found = image_pixels.read(image, True)[None]
    assert found.shape == (8, 8, 4)
    np.testing.assert_array_equal(found, fresh(image, True))


def test_strokes_reuse_arrays_that_nobody_holds(hair, rng):
    """Strokes are read into two arrays in turn, but not into arrays that are still in use."""
    image = bpy.data.images.new("Painted", 24, 40, alpha=True)
    held, kept, places = [], [], []
    for turn in range(8):
        values = np.array(image.pixels[:], np.float32).reshape(40, 24, 4)
        values[5 * turn : 5 * turn + 7, 2 * turn : 2 * turn + 4] = rng.random(4)
        image.pixels.foreach_set(values.ravel())
        found = image_pixels.read(image, True)[None]
        np.testing.assert_array_equal(
            found, pixels.colors(image_pixels._raw(image), **image_pixels.conversion_of(image))
        )
        places.append(found.ctypes.data)
        if turn in (3, 4):
            held.append(found)
            kept.append(found.copy())
        del found
    assert places[2] == places[0] != places[1] == places[3]
    np.testing.assert_array_equal(held, kept)


WAYS = [
    {"look.color": {}},
    {"look.color": {"is_inverted": True, "amount": 0.7}, "look.roughness": {"low": 0.5, "high": 2.0}},
    {
        "look.color": {"ramp": "0:0.5/0.1/0.05 1:0.05/0.1/0.5"},
        "look.radial_roughness": {"low": 0.3, "is_inverted": True},
    },
]

CACHES = [
    (image_pixels, "converted_cache"),
    (sources, "level_cache"),
    (sources, "mean_cache"),
    (strand_maps, "look_cache"),
]


@pytest.mark.parametrize("maps", WAYS)
def test_strokes_change_their_strands_as_a_new_reading_does(hair, rng, monkeypatch, maps):
    """After each stroke, also at borders of the image, all strands have bit for bit the looks of a new reading."""
    image = bpy.data.images.new("Painted", 128, 96, alpha=True)
    values = rng.random((96, 128, 4), np.float32)
    image.pixels.foreach_set(values.ravel())
    hair.data.vellus.appearance.parametrization = "COLOR"
    for setting, changes in maps.items():
        map_items.keep(hair.data.vellus, MapSettings(setting=setting, source=image.name, **changes))
    counts, compute = [], strand_maps.strand_looks
    monkeypatch.setattr(strand_maps, "strand_looks", lambda *given: counts.append(len(given[2])) or compute(*given))
    count = len(strand_maps.looks_of(hair.data)[0])
    boxes = [(0, 0, 9, 9), (90, 120, 6, 8), (40, 60, 1, 1), (30, 0, 11, 128), (0, 0, 96, 128), (50, 20, 13, 7)]
    for row, column, height, width in boxes:
        values[row : row + height, column : column + width] = rng.random(4)
        image.pixels.foreach_set(values.ravel())
        counts.clear()
        looks = strand_maps.looks_of(hair.data)[0]
        assert counts[0] == count if height == 96 else counts[0] < 0.4 * count
        with monkeypatch.context() as anew:
            for module, name in CACHES:
                anew.setattr(module, name, Cache())
            assert looks.is_same(strand_maps.looks_of(hair.data)[0])


def test_hair_without_strands_has_no_looks(hair):
    """Hair without strands has empty looks, also when they are read again."""
    map_items.keep(hair.data.vellus, MapSettings(setting="look.roughness", kind="STRAND"))
    strands = sources.stored_strands(hair.data)
    none = replace(strands, roots=None, identities=strands.identities[:0], randoms=strands.randoms[:0])
    for _reading in range(2):
        looks, errors = strand_maps.looks_of(hair.data, none)
        assert len(looks) == 0 and errors == []
