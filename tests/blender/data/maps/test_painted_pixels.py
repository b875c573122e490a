# SPDX-License-Identifier: GPL-3.0-or-later
"""Only changed rows of painted images are converted, with the same result as converting the whole image."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.maps import image_pixels
from hair_addon.core.maps import pixels


def converted_rows(monkeypatch):
    """Return a list of the rows that are converted from now on."""
    counts = []
    for name in ("colors", "masks"):
        convert = getattr(pixels, name)

        def counting(values, *given, _convert=convert, **options):
            counts.append(len(values))
            return _convert(values, *given, **options)

        monkeypatch.setattr(pixels, name, counting)
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
    image = bpy.data.images.new("Painted", 24, 40, alpha=True, float_buffer=is_float)
    values = rng.random((40, 24, 4), np.float32)
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
    image.pixels.foreach_set(rng.random(16 * 16 * 4, np.float32))
    before = image_pixels.read(image, True)[None]
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(rng.random(16 * 16 * 4, np.float32))
    found = image_pixels.read(image, True)[None]
    assert not np.array_equal(found, before)
    np.testing.assert_array_equal(found, fresh(image, True))
    image.scale(8, 8)
    found = image_pixels.read(image, True)[None]
    assert found.shape == (8, 8, 4)
    np.testing.assert_array_equal(found, fresh(image, True))
