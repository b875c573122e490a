# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of studio lights are read as layers, bottom row first; other files are refused with a message."""

import numpy as np
import OpenEXR
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.files import light_images


def write(path, channels):
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    OpenEXR.File(header, channels).write(str(path))
    return path


def test_layers_are_read_from_the_bottom_up(tmp_path, rng):
    pixels = rng.random((6, 4, 5), dtype=np.float32)
    names = ("diffuse.R", "diffuse.G", "diffuse.B", "specular.R", "specular.G", "specular.B")
    layers = light_images.read_layers(write(tmp_path / "matcap.exr", dict(zip(names, pixels, strict=True))))
    assert {*layers} == {"diffuse", "specular"}
    np.testing.assert_array_equal(layers["diffuse"], np.moveaxis(pixels[:3, ::-1], 0, -1))
    np.testing.assert_array_equal(layers["specular"], np.moveaxis(pixels[3:, ::-1], 0, -1))


def test_infinite_light_is_left_out(tmp_path):
    pixels = np.array([[np.inf, np.nan, 2.0]], np.float32)
    plain = light_images.read_layers(write(tmp_path / "world.exr", dict.fromkeys("RGB", pixels)))[""]
    np.testing.assert_array_equal(plain[0, :, 0], [0.0, 0.0, 2.0])


def test_other_files_are_refused(tmp_path):
    (tmp_path / "text.exr").write_text("no image")
    with pytest.raises(HairError, match="cannot be read"):
        light_images.read_layers(tmp_path / "text.exr")
    with pytest.raises(HairError, match="has no colors"):
        light_images.read_layers(write(tmp_path / "depth.exr", {"Z": np.zeros((2, 2), np.float32)}))
