# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays in a file are restored bit by bit, other .npz readers can read them, and other files are refused."""

import io
import math
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.errors import HairError
from hair_addon.core.files import array_file

SHAPES = st.lists(st.integers(0, 5), max_size=4)
NAMES = ("x", "of_a_longer_name", "q2", "_")


@st.composite
def array_sets(draw):
    kinds = draw(st.lists(st.sampled_from(array_file.TYPES), min_size=1, max_size=4))
    arrays = {}
    for name, kind in zip(NAMES, kinds, strict=False):
        shape = draw(SHAPES)
        bits = np.random.default_rng(draw(st.integers(0, 99))).bytes(int(kind[2:]) * math.prod(shape))
        array = np.frombuffer(bits, kind).reshape(shape)
        arrays[name] = np.where(np.isfinite(array), array, array.dtype.type(-0.0)).astype(kind)
    return arrays


def bytes_of(arrays):
    return b"".join(map(bytes, array_file.encoded(arrays)))


@given(arrays=array_sets())
def test_arrays_come_back_bit_by_bit_here_and_in_other_programs(arrays):
    data, layout = bytes_of(arrays), array_file.layout_of(arrays)
    assert len(data) == array_file.size_of(layout)
    back = array_file.decoded(data, layout)
    assert array_file.layout_of(back) == layout
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.testzip() is None
    with np.load(io.BytesIO(data)) as found:
        assert list(found) == list(back) == list(arrays)
        for name, array in arrays.items():
            assert back[name].tobytes() == found[name].tobytes() == array.tobytes()
            assert found[name].shape == array.shape


def test_strided_arrays_are_written_in_order(rng):
    array = rng.random((6, 5, 4), dtype=np.float32)
    for view in (array[::2, ::-1], array.T, array.astype(">f4")):
        back = array_file.decoded(bytes_of({"a": view}), array_file.layout_of({"a": view}))["a"]
        np.testing.assert_array_equal(back, view)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("kind", ["<f4", "<f8"])
def test_other_numbers_than_finite_ones_are_neither_written_nor_read(kind, value):
    array = np.array([0.0, value, 1.0], kind)
    with pytest.raises(HairError, match="Non-finite"):
        array_file.encoded({"a": array})
    layout = array_file.layout_of({"a": array})
    forged = b"".join(map(bytes, array_file._file_of(layout, {"a": array.tobytes()})))
    assert np.isnan(array[1]) == np.isnan(np.load(io.BytesIO(forged))["a"][1])  # a file like ours
    assert array_file.decoded(forged, layout) is None


@pytest.mark.parametrize(
    "layout",
    [
        {"a": ("|O", (1,))},
        {"a": (">f4", (1,))},
        {"a": ("<f4", (-1,))},
        {"a": ("<f4", (1,) * 5)},
        {"../a": ("<f4", (1,))},
        {"a" * 33: ("<f4", (1,))},
        {"a": ("<f4", (2**31 - 1,) * 4)},
        {"a": ("<f4", (2**20, 2**20))},
        {"a": ("<f4", (2**30,))},
    ],
)
def test_other_layouts_are_refused_before_a_file_is_opened(tmp_path, layout):
    with pytest.raises(HairError, match=r"cached|4 GB"):
        array_file.read(tmp_path / "there is none", layout)
