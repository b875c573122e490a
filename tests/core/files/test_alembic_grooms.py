# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of Alembic files are read with transforms and metadata, and damaged or hostile files are refused."""

import struct

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.files import alembic
from hair_addon.core.files.curve_file import Convention
from tests.support.exchange.alembic_files import ANY_ORDER, BEZIER, BSPLINE, CATMULL_ROM, CUBIC, HERMITE, LINEAR, File


def read(file, path, *children):
    file.write(path, *children)
    return alembic.grooms.read(path)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "curves.abc"


def test_transforms_place_curves_and_scale_their_widths(path, rng):
    """Transforms place curves and scale their widths by operations of every kind, the last one first, with or
    without inheritance.
    """
    file, points = File(), rng.normal(size=(5, 3)).astype(np.float32)
    widths = file.writer.array("width", "float32", np.float32([0.1, 0.2]))
    curves = file.curves("shape", points, [2, 3], extra=[widths])
    other = file.curves("otherShape", points, [2, 3])
    # Translate, turn about x by 90°, about z by 90°, about y by 0°, and about an axis by 120°; scale.
    codes = [1, 4, 6, 5, 2, 0]
    values = [1, 2, 3, 90, 90, 0, 1, 1, 1, 120, 2, 2, 2]
    inner = file.transform("inner", [curves], codes, values)
    free = file.transform("free", [other], [1], [7, 0, 0], inherits=False)
    matrix = np.eye(4)
    matrix[:3, :3] = [[0, 0, 3], [3, 0, 0], [0, 3, 0]]
    matrix[3, :3] = [10, 20, 30]
    found = read(file, path, file.transform("outer", [inner, free], [3], matrix.ravel()))
    assert found.stated == Convention() and found.usual == Convention(0.01, "Y")
    placed, moved = found.sets
    # About (1, 1, 1) by 120°: x → y → z → x. Then about z: x → y; about x: y → z.
    there = 2.0 * points[:, [2, 0, 1]]
    there = np.stack([-there[:, 1], there[:, 0], there[:, 2]], axis=1)
    there = np.stack([there[:, 0], -there[:, 2], there[:, 1]], axis=1) + np.array([1, 2, 3])
    np.testing.assert_allclose(placed.points, there @ matrix[:3, :3] + np.array([10, 20, 30]), atol=1e-5)
    np.testing.assert_allclose(placed.radii, 3.0 * np.repeat([0.1, 0.2], [2, 3]), rtol=1e-6)  # 6 times, half of it
    np.testing.assert_allclose(moved.points, points + np.array([7, 0, 0]), atol=1e-6)
    assert (placed.name, moved.name) == ("inner", "free") and moved.radii is None


def test_curves_and_transforms_move_between_samples(path, rng):
    file = File()
    samples = rng.normal(size=(3, 4, 3)).astype(np.float32)
    places = file.moving("P", "float32", 3, samples, is_array=True)
    curves = file.curves("shape", places, [4])
    moves = file.moving(".vals", "float64", 3, [[0, 0, 0], [0, 0, 1], [0, 0, 5]])
    (found,) = read(file, path, file.transform("group", [curves], [1], moves)).sets
    np.testing.assert_allclose(found.motion.times, np.arange(1, 4) / 24.0)
    for index, lift in enumerate((0.0, 1.0, 5.0)):
        np.testing.assert_allclose(found.motion.points_at(index), samples[index] + np.array([0, 0, lift]), atol=1e-6)
    np.testing.assert_array_equal(found.points, samples[0])
    placed = found.placed(0.01, "Y")
    turned = np.stack([samples[2][:, 0], -(samples[2][:, 2] + 5.0), samples[2][:, 1]], axis=1)
    np.testing.assert_allclose(placed.motion.points_at(2), 0.01 * turned, atol=1e-7)


def test_splines_are_what_is_drawn(path):
    """Splines are read as drawn: a B-spline begins a third of the way beside its second point, other curves at their
    ends.
    """
    file, line = File(), np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    smooth = np.concatenate([line[:1], line, line[-1:]])
    knots = file.writer.array(".knots", "float32", np.float32([0, 0, 0, 0, 1, 1, 1, 1]))
    orders = file.writer.array(".orders", "uint8", [4])
    sets = read(
        file,
        path,
        file.curves("bspline", line, [4], CUBIC, BSPLINE),
        file.curves("bezier", line, [4], CUBIC, BEZIER),
        file.curves("hermite", [[0, 0, 0], [3, 0, 0], [1, 1, 0], [0, 3, 0]], [4], CUBIC, HERMITE),
        file.curves("smooth", smooth, [6], CUBIC, CATMULL_ROM),
        file.curves("catmull", line, [4], CUBIC, CATMULL_ROM),
        file.curves("nurbs", line, [4], ANY_ORDER, BSPLINE, extra=[knots, orders]),
        file.curves("closed", line, [4], LINEAR, wrap=1),
    ).sets
    ends = {one.name: one.points[[0, -1]] for one in sets}
    np.testing.assert_allclose(ends["bspline"], [[5 / 6, 1 / 6, 0], [5 / 6, 5 / 6, 0]], atol=1e-6)
    for name in ("bezier", "nurbs"):
        np.testing.assert_allclose(ends[name], line[[0, -1]], atol=1e-6)
    np.testing.assert_allclose(ends["catmull"], line[[1, 2]], atol=1e-6)
    np.testing.assert_allclose(ends["hermite"], [[0, 0, 0], [1, 1, 0]], atol=1e-6)
    np.testing.assert_allclose(ends["closed"], line[[0, 0]], atol=1e-6)
    (kept,) = [one for one in sets if one.name == "smooth"]
    np.testing.assert_array_equal(kept.points, line)
    assert kept.is_smooth.all() and not any(one.is_smooth.any() for one in sets if one is not kept)


def test_widths_of_splines_are_interpolated_as_their_points(path):
    file, line = File(), np.float32([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [4, 0, 0]])
    of_points = file.writer.array("width", "float32", np.float32([0, 1, 2, 3, 4]))
    of_ends = file.writer.array("width", "float32", np.float32([1, 2, 3]))
    odd = file.writer.array("width", "float32", np.float32([1, 2, 3, 4]))
    found = read(
        file,
        path,
        file.curves("points", line, [5], CUBIC, BSPLINE, extra=[of_points]),
        file.curves("ends", line, [5], CUBIC, BSPLINE, extra=[of_ends]),
        file.curves("odd", line, [5], CUBIC, BSPLINE, extra=[odd]),
    )
    for one in found.sets[:2]:
        np.testing.assert_allclose(2.0 * one.radii, one.points[:, 0], atol=1e-6)
    assert found.sets[2].radii is None and ["left out" in str(note) for note in found.notes] == [True]


def test_curves_of_one_object_are_told_apart_by_kind_and_group(path, rng):
    file, points = File(), rng.normal(size=(8, 3))
    write = file.writer
    indexed = write.compound(
        "groom_group_id",
        [write.array(".vals", "int32", [5, 9]), write.array(".indices", "int32", [0, 1, 0, 1])],
    )
    parameters = [
        write.array("groom_guide", "int16", [1, 0, 0, 0]),
        indexed,
        write.array("groom_id", "int32", [3, 4, 5, 6]),
        write.array("groom_closest_guides", "int32", np.full((4, 3), 3)),
        write.array("groom_guide_weights", "float32", np.full((4, 3), 1 / 3)),
    ]
    sets = read(file, path, file.curves("shape", points, [2, 2, 2, 2], parameters=parameters)).sets
    told = [(one.is_guide, one.group_id, one.ids.tolist()) for one in sets]
    assert told == [(False, 5, [5]), (False, 9, [4, 6]), (True, 5, [3])]
    np.testing.assert_allclose(sets[1].points, points[[2, 3, 6, 7]], atol=1e-6)
    np.testing.assert_array_equal(sets[1].guide_ids, np.full((2, 3), 3))


def test_groups_have_names_and_curves_have_colors(path, rng):
    """Groups have names, and curves have colors of each curve, of each point or of all; colors of another number are
    left out.
    """
    file, points, rgb = File(), rng.normal(size=(7, 3)), rng.random((7, 3)).astype(np.float32)
    write, counts = file.writer, [3, 2, 2]

    def colors(values):
        return write.array("groom_color", "float32", np.float32(values))

    named = [
        write.array("groom_group_id", "int32", [5, 9, 5]),
        write.strings("groom_group_name", ["Beard", "Brows", "Beard"]),
    ]
    found = read(
        file,
        path,
        file.curves("curves", points, counts, parameters=[*named, colors(rgb[:3])]),
        file.curves("points", points, counts, parameters=[colors(rgb)]),
        file.curves("all", points, counts, parameters=[colors(rgb[:1])]),
        file.curves("odd", points, counts, parameters=[colors(rgb[:4])]),
    )
    beard, brows, of_points, of_all, odd = found.sets
    assert [(one.group_id, one.group_name) for one in (beard, brows)] == [(5, "Beard"), (9, "Brows")]
    np.testing.assert_array_equal(beard.colors, rgb[[0, 0, 0, 2, 2]])
    np.testing.assert_array_equal(brows.colors, rgb[[1, 1]])
    np.testing.assert_array_equal(of_points.colors, rgb)
    np.testing.assert_array_equal(of_all.colors, rgb[[0] * 7])
    assert odd.colors is None and ["colors" in str(note) for note in found.notes] == [True]


def test_instances_show_curves_again(path):
    file, line = File(), [[0, 0, 0], [1, 0, 0]]
    source = file.transform("hair", [file.curves("hairShape", line, [2])], [1], [0, 0, 1])
    outer = file.transform("first", [source], [1], [0, 5, 0])
    instance = file.writer.object("again", {"isInstance": "1"}, [file.text(".instanceSource", "/first/hair")])
    found = read(file, path, outer, file.transform("second", [instance], [1], [7, 0, 0])).sets
    np.testing.assert_allclose(found[0].points[0], [0, 5, 1])
    np.testing.assert_allclose(found[1].points[0], [7, 0, 1])


# ------------------------------------------------------------------------------------------ damaged and hostile


@pytest.mark.parametrize(
    ("content", "reported"),
    [
        (b"", "is not an Alembic file"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "HDF5"),
        (b"Ogawa\xff\x00\x01" + bytes(8), "damaged"),
        (b"Ogawa\x00\x00\x01" + bytes(8), "not written to its end"),
        (b"Ogawa\xff\x00\x01" + struct.pack("<Q", 16) + struct.pack("<Q", 2**60), "damaged"),
    ],
)
def test_what_is_no_archive_is_refused_in_a_sentence(path, content, reported):
    path.write_bytes(content)
    with pytest.raises(HairError, match=reported):
        alembic.grooms.read(path)


def small_file():
    """Return the bytes of a small archive with everything that is read."""
    file = File()
    write, line = file.writer, np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    parameters = [
        write.array("groom_guide", "int16", [1]),
        write.strings("groom_group_name", ["fringe"]),
        write.compound("groom_id", [write.array(".vals", "int32", [5]), write.array(".indices", "int32", [0])]),
    ]
    points = file.moving("P", "float32", 3, [line, line + 1], is_array=True)
    knots = [write.array(".knots", "float32", [0, 0, 0, 0, 1, 1, 1, 1]), write.array(".orders", "uint8", [4])]
    shapes = [
        file.curves("bspline", points, [4], CUBIC, BSPLINE, extra=[write.array("width", "float32", [1.0])]),
        file.curves("nurbs", line, [4], ANY_ORDER, BSPLINE, extra=knots, parameters=parameters),
        write.object("again", {}, [file.text(".instanceSource", "/group/nurbs")]),
    ]
    moves = file.moving(".vals", "float64", 3, [[0, 0, 0], [0, 0, 1]])
    write.close([file.transform("group", shapes, [1], moves)])
    return file.bytes.getvalue()


def test_mutants_of_a_file_give_curves_or_a_sentence(path, rng):
    """Files with changed bytes, numbers or ends give curves or one sentence, with a finite number of values."""
    whole = small_file()
    path.write_bytes(whole)
    assert [len(one) for one in alembic.grooms.read(path).sets] == [1, 1, 1]
    refused = 0
    for _ in range(250):
        mutant = bytearray(whole)
        for _ in range(rng.integers(1, 4)):
            place = int(rng.integers(0, len(whole) - 8))
            if rng.random() < 0.5:
                mutant[place] = int(rng.integers(0, 256))
            else:
                place = place // 8 * 8
                number = int(rng.choice([0, 1, 2**31, 2**40, 2**63 - 1, 2**63 + 16, int(rng.integers(0, len(whole)))]))
                mutant[place : place + 8] = struct.pack("<Q", number)
        path.write_bytes(mutant[: int(rng.integers(8, len(whole)))] if rng.random() < 0.2 else mutant)
        try:
            for one in alembic.grooms.read(path).sets:
                assert len(one.points) == one.counts.sum() < 10_000
                if one.motion is not None:
                    assert len(one.motion.points_at(1)) == len(one.points)
        except HairError:
            refused += 1
    assert 80 < refused < 245


def test_a_small_file_cannot_fill_the_memory(path):
    """A small file cannot fill the memory by a hundred objects that share one sample."""
    file, points = File(), np.zeros((20_000, 3), np.float32)
    shared = [file.curves(f"c{n}", points, [20_000]) for n in range(100)]
    with pytest.raises(HairError, match="damaged"):
        read(file, path, *shared)
