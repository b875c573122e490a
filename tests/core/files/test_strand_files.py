# SPDX-License-Identifier: GPL-3.0-or-later
"""Strand files of other programs are read with exact positions and diameters, and damaged files are one sentence."""

import io
import struct

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.files import array_grooms
from hair_addon.core.files.curve_file import Convention
from hair_addon.core.files.strands import chains, counted_points, hair, obj_lines, ply_strands, tressfx
from hair_addon.core.files.strands.contents import Damaged
from tests.support.exchange import strand_files

LINES = strand_files.lines()
EVEN = strand_files.lines(points=8)
TEXT = np.float32(np.concatenate(LINES))
WIDTHS = np.linspace(1e-5, 3e-4, len(TEXT), dtype=np.float32)
COUNTS = [len(one) for one in LINES]

READERS = {
    "HAIR": (hair.read, lambda: strand_files.hair(LINES, WIDTHS), WIDTHS),
    "HAIR without widths": (hair.read, lambda: strand_files.hair(LINES), None),
    "HairSalon": (counted_points.read_data, lambda: strand_files.data(LINES), None),
    "CT2Hair": (counted_points.read_bin, lambda: strand_files.bin_file(LINES), None),
    "xyz in .bin": (counted_points.read_bin, lambda: strand_files.data(LINES), None),
    "PLY": (ply_strands.read, lambda: strand_files.ply(LINES, WIDTHS), WIDTHS),
    "big-endian PLY": (ply_strands.read, lambda: strand_files.ply(LINES, WIDTHS, "big"), WIDTHS),
    "PLY as text": (ply_strands.read, lambda: strand_files.ply_text(LINES), np.full(len(TEXT), 0.5, np.float32)),
    "PLY with lists": (ply_strands.read, lambda: strand_files.ply_lists(LINES), None),
    "PLY with edges": (ply_strands.read, lambda: strand_files.ply_edges(LINES), None),
    "PLY with shuffled edges": (
        ply_strands.read,
        lambda: strand_files.ply_edges(LINES, np.random.default_rng(1)),
        None,
    ),
    "OBJ": (obj_lines.read, lambda: strand_files.obj(LINES), None),
    "OBJ with edges": (obj_lines.read, lambda: strand_files.obj(LINES, is_edges=True), None),
    "arrays": (array_grooms.read, lambda: strand_files.npz(LINES, widths=WIDTHS), WIDTHS),
}


@pytest.mark.parametrize("name", READERS)
def test_strands_are_read_to_the_bit(tmp_path, name):
    """Positions and counts equal those written; radii are half of the diameters."""
    read, data, widths = READERS[name]
    path = tmp_path / "Hair.any"
    path.write_bytes(data())
    file = read(path)
    (found,) = file.sets
    assert found.name == "Hair" and found.counts.tolist() == COUNTS and file.stated == Convention()
    np.testing.assert_array_equal(found.points.astype(np.float32), TEXT)
    assert (found.radii is None) == (widths is None)
    if widths is not None:
        np.testing.assert_array_equal(2.0 * found.radii, widths)


def test_tressfx_brings_positions_and_uv_coordinates(tmp_path):
    uvs = np.random.default_rng(2).random((len(EVEN), 2), np.float32)
    (tmp_path / "a.tfx").write_bytes(strand_files.tfx(EVEN, uvs))
    (found,) = tressfx.read(tmp_path / "a.tfx").sets
    np.testing.assert_array_equal(found.points, np.concatenate(EVEN))
    np.testing.assert_array_equal(found.root_uvs, uvs)
    assert found.counts.tolist() == [8] * 6 and found.radii is None


@pytest.mark.parametrize(("default", "radius"), [(1.0, None), (0.0, None), (0.5, 0.25), (float("nan"), None)])
def test_the_default_thickness_of_a_hair_file_counts_if_somebody_chose_it(tmp_path, default, radius):
    """The default thickness of a .hair file counts unless it is 1, which its library writes for files without
    thickness.
    """
    (tmp_path / "a.hair").write_bytes(strand_files.hair(LINES, default=default))
    (found,) = hair.read(tmp_path / "a.hair").sets
    assert (found.radii is None) if radius is None else (found.radii == radius).all()


LAYOUTS = {
    "positions": ({"positions": np.stack(EVEN)}, EVEN),
    "any name": ({"my_array": np.stack(EVEN), "other": np.zeros((4, 4))}, EVEN),
    "64 bits": ({"points": np.stack(EVEN).astype(np.float64)}, EVEN),
    "16 bits": ({"points": np.stack(EVEN).astype(np.float16)}, [one.astype(np.float16) for one in EVEN]),
    "columns first": ({"points": np.asfortranarray(np.stack(EVEN))}, EVEN),
    "counts": ({"points": TEXT, "anything": np.array(COUNTS)}, LINES),
    "offsets": ({"points": TEXT, "offsets": np.cumsum([0, *COUNTS])}, LINES),
    "starts": ({"points": TEXT, "first": np.cumsum([0, *COUNTS[:-1]], dtype=np.uint32)}, LINES),
    "the one called strands": ({"tangents": np.stack(EVEN) * 0, "strands": np.stack(EVEN)}, EVEN),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_arrays_of_any_layout_are_read(tmp_path, name):
    arrays, lines = LAYOUTS[name]
    np.savez(tmp_path / "a.npz", **arrays)
    (found,) = array_grooms.read(tmp_path / "a.npz").sets
    assert found.counts.tolist() == [len(one) for one in lines]
    np.testing.assert_array_equal(found.points, np.concatenate(lines))


@pytest.mark.parametrize(
    ("name", "values", "factor"),
    [
        ("radius", np.float32([0.5]), 1.0),
        ("width", np.full(6, 0.5, np.float32), 0.5),
        ("thickness", np.full((6, 8), 0.5), 0.5),
    ],
)
def test_widths_of_arrays_have_any_shape(tmp_path, name, values, factor):
    np.savez(tmp_path / "a.npz", strands=np.stack(EVEN), **{name: values})
    (found,) = array_grooms.read(tmp_path / "a.npz").sets
    assert found.radii.shape == (48,) and (found.radii == 0.5 * factor).all()


def test_arrays_that_may_both_be_strands_are_an_error_that_names_them(tmp_path):
    np.savez(tmp_path / "a.npz", one=np.stack(EVEN), two=np.stack(EVEN))
    with pytest.raises(HairError, match="one, two"):
        array_grooms.read(tmp_path / "a.npz")


def test_edges_in_any_order_form_their_lines():
    """Edges in any order form their lines: each begins at its end with the smaller index, and a loop repeats its
    first point.
    """
    edges = np.array([(3, 2), (5, 6), (1, 2), (6, 4), (4, 5), (9, 8)])
    indices, counts = chains.polylines(edges, 10)
    assert indices.tolist() == [1, 2, 3, 8, 9, 4, 6, 5, 4] or indices.tolist() == [1, 2, 3, 8, 9, 4, 5, 6, 4]
    assert counts.tolist() == [3, 2, 4]
    for wrong in ([(0, 1), (0, 2), (0, 3)], [(0, 10)], [(-1, 2)]):
        with pytest.raises(Damaged):
            chains.polylines(np.array(wrong), 10)


def test_objects_of_an_obj_are_sets(tmp_path):
    text = b"o A\nv 0 0 0\nv 1 0 0\nl -2 -1\no B\nv 2 0 0 1 0 0\nv 3 0 0\nl 3/7 4/8\nf 1 2 3\n"
    (tmp_path / "a.obj").write_bytes(text)
    sets = obj_lines.read(tmp_path / "a.obj").sets
    assert [one.name for one in sets] == ["A", "B"]
    np.testing.assert_array_equal(np.concatenate([one.points[:, 0] for one in sets]), [0, 1, 2, 3])


HUGE = struct.pack("<I", 2**31 - 1)
DAMAGED = {
    "empty": (hair.read, b""),
    "cut HAIR": (hair.read, strand_files.hair(LINES)[:-5]),
    "huge HAIR": (hair.read, strand_files.hair(LINES)[:8] + HUGE + strand_files.hair(LINES)[12:]),
    "HAIR of many strands": (hair.read, strand_files.hair(LINES)[:4] + HUGE + strand_files.hair(LINES)[8:]),
    "HAIR without points": (hair.read, strand_files.hair(LINES)[:12] + struct.pack("<I", 1) + bytes(112)),
    "cut HairSalon": (counted_points.read_data, strand_files.data(LINES)[:-5]),
    "huge HairSalon": (counted_points.read_data, HUGE + strand_files.data(LINES)[4:]),
    "huge strand": (counted_points.read_data, strand_files.data(LINES)[:4] + HUGE + strand_files.data(LINES)[8:]),
    "negative": (counted_points.read_bin, struct.pack("<2i", 1, -1)),
    "cut CT2Hair": (counted_points.read_bin, strand_files.bin_file(LINES)[:-5]),
    "cut TressFX": (tressfx.read, strand_files.tfx(EVEN)[:-5]),
    "huge TressFX": (tressfx.read, strand_files.tfx(EVEN)[:4] + HUGE + HUGE + strand_files.tfx(EVEN)[12:]),
    "cut PLY": (ply_strands.read, strand_files.ply(LINES)[:-5]),
    "huge PLY": (ply_strands.read, strand_files.ply(LINES).replace(b"vertex ", b"vertex 99999999")),
    "PLY of points": (ply_strands.read, strand_files.ply(LINES).replace(b"nsegs", b"label")),
    "cut text": (ply_strands.read, strand_files.ply_text(LINES)[:-40]),
    "no number": (ply_strands.read, strand_files.ply_text(LINES).replace(b"0.25", b"0,25")),
    "OBJ without lines": (obj_lines.read, b"v 0 0 0\nf 1 1 1\n"),
    "OBJ of other points": (obj_lines.read, b"v 0 0 0\nl 1 2\n"),
    "OBJ of huge numbers": (obj_lines.read, b"v 0 0 0\nl 1 " + b"9" * 50 + b"\n"),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_file_is_one_sentence(tmp_path, name):
    """A damaged file is one sentence, without memory for excessive counts and without any other exception."""
    read, data = DAMAGED[name]
    path = tmp_path / "a.any"
    path.write_bytes(data)
    with pytest.raises(HairError) as error:
        read(path)
    text = str(error.value)
    assert (
        str(path) in text and text.endswith(".") and text.count(".") == text.count(str(path)) * str(path).count(".") + 1
    )


def test_numbers_that_are_not_finite_arrive_for_the_code_that_reports_them(tmp_path):
    bad = [LINES[0].copy(), *LINES[1:]]
    bad[0][1] = np.nan
    (tmp_path / "a.hair").write_bytes(strand_files.hair(bad))
    (found,) = hair.read(tmp_path / "a.hair").sets
    assert np.isnan(found.points[1]).all() and np.isfinite(found.points[2:]).all()


def test_a_damaged_archive_is_one_sentence(tmp_path):
    stream = io.BytesIO()
    np.savez(stream, points=np.zeros((3, 3), np.float32))
    (tmp_path / "a.npz").write_bytes(stream.getvalue())
    with pytest.raises(HairError, match="no curves"):
        array_grooms.read(tmp_path / "a.npz")
