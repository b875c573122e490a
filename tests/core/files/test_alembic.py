# SPDX-License-Identifier: GPL-3.0-or-later
"""An independent reader finds what was written to Alembic files, with any number of parts and samples."""

import io

import numpy as np
import pytest

from hair_addon.core.files.alembic.writer import TYPES, AlembicWriter, Property
from tests.support.exchange import alembic_reader

KINDS = sorted(set(TYPES) - {"string"})


class Archive:
    """An archive of one object, whose properties are read back."""

    def __init__(self):
        self.bytes = io.BytesIO()
        self.writer = AlembicWriter(self.bytes, "Test")

    def read(self, properties, tmp_path):
        made = self.writer.object("object", {"schema": "Any"}, properties)
        self.writer.close([made])
        path = tmp_path / "archive.abc"
        path.write_bytes(self.bytes.getvalue())
        self.archive = alembic_reader.read(path)
        return self.archive.objects["object"].properties


def values(rng, kind, shape):
    dtype = np.dtype(TYPES[kind][2])
    if dtype.kind == "f":
        return rng.standard_normal(shape).astype(dtype)
    return rng.integers(0, 2 if kind == "bool" else 100, shape).astype(dtype)


@pytest.mark.parametrize("kind", KINDS)
def test_arrays_and_scalars_of_every_type_come_back(rng, tmp_path, kind):
    archive, one, many = Archive(), values(rng, kind, 5), values(rng, kind, (7, 3))
    written = [
        archive.writer.array("one", kind, one, {"a": "b", "c": ""}),
        archive.writer.array("many", kind, many),
        archive.writer.array("single", kind, one[:1]),
        archive.writer.array("none", kind, one[:0]),
        archive.writer.scalar("vector", kind, many[0]),
    ]
    found = archive.read(written, tmp_path)
    np.testing.assert_array_equal(found["one"].only, one)
    np.testing.assert_array_equal(found["many"].only, many)
    np.testing.assert_array_equal(found["single"].only, one[:1])
    np.testing.assert_array_equal(found["vector"].only[0], many[0])
    assert len(found["none"].only) == 0
    assert found["one"].metadata == {"a": "b"} and not found["many"].metadata
    assert {p.kind for p in found.values()} == {TYPES[kind][1]}
    assert [p.extent for p in found.values()] == [1, 3, 1, 1, 3]
    assert [p.form for p in found.values()] == ["array"] * 4 + ["scalar"]


def test_strings_come_back(tmp_path):
    archive, texts = Archive(), ["", "hair", "Schläfe", "a b\n"]
    written = [archive.writer.strings("many", texts), archive.writer.strings("one", ["x" * 300])]
    found = archive.read(written, tmp_path)
    assert found["many"].only == texts and found["one"].only == ["x" * 300]


def test_parts_make_one_sample(rng, tmp_path):
    archive, points = Archive(), values(rng, "float32", (100, 3))
    made = Property("points", "float32", 3, "", is_array=True)
    archive.writer.add_sample(made, (points[start : start + 7] for start in range(0, 100, 7)))
    np.testing.assert_array_equal(archive.read([made], tmp_path)["points"].only, points)


@pytest.mark.parametrize("count", [1, 2, 255, 256, 300])
def test_samples_have_their_times(rng, tmp_path, count):
    archive, samples = Archive(), values(rng, "float32", (count, 4))
    sampling = archive.writer.add_sampling(0.5, 10.0)
    made = Property("moving", "float32", 1, "", is_array=True, sampling=sampling)
    for sample in samples:
        archive.writer.add_sample(made, [sample])
    found = archive.read([made], tmp_path)["moving"]
    np.testing.assert_array_equal(found.samples, samples)
    np.testing.assert_allclose(found.times, 10.0 + 0.5 * np.arange(count))
    assert [most for most, *_ in archive.archive.samplings] == [0, count]


def test_samples_of_different_lengths_come_back(rng, tmp_path):
    archive = Archive()
    made = Property("growing", "int32", 1, "", is_array=True)
    samples = [np.arange(count, dtype=np.int32) for count in (0, 1, 5)]
    for sample in samples:
        archive.writer.add_sample(made, [sample])
    found = archive.read([made], tmp_path)["growing"].samples
    assert [list(sample) for sample in found] == [list(sample) for sample in samples]


def test_equal_samples_are_kept_once(rng, tmp_path):
    sizes = []
    for second in (0.0, 1.0):
        archive, first = Archive(), values(rng, "float64", 10_000)
        found = archive.read(
            [archive.writer.array("a", "float64", first), archive.writer.array("b", "float64", first + second)],
            tmp_path,
        )
        np.testing.assert_array_equal(found["a"].only, first)
        np.testing.assert_array_equal(found["b"].only, first + second)
        sizes.append(len(archive.bytes.getvalue()))
    assert sizes[1] - sizes[0] == 8 + 16 + 80_000


def test_long_names_and_more_metadata_than_the_table_holds(tmp_path):
    archive = Archive()
    written = [archive.writer.scalar(f"p{n}", "int32", n, {"number": str(n)}) for n in range(400)]
    written.append(archive.writer.scalar("n" * 70_000, "bool", True, {"long": "m" * 70_000}))
    found = archive.read(written, tmp_path)
    assert all(found[f"p{n}"].metadata == {"number": str(n)} for n in range(400))
    assert found["n" * 70_000].metadata == {"long": "m" * 70_000}


def test_compounds_and_objects_nest(tmp_path):
    stream = io.BytesIO()
    writer = AlembicWriter(stream, "Test")
    inner = writer.compound("inner", [writer.scalar("x", "int32", 3)], {"a": "b"})
    outer = writer.compound("outer", [inner, writer.compound("empty", [])])
    child = writer.object("child", {"schema": "Child"}, [outer])
    writer.close([writer.object("parent", {}, [], [child, writer.object("other", {}, [])])])
    path = tmp_path / "archive.abc"
    path.write_bytes(stream.getvalue())
    archive = alembic_reader.read(path)
    assert set(alembic_reader.objects(archive)) == {"/parent", "/parent/child", "/parent/other"}
    found = archive.objects["parent"].children["child"]
    assert found.metadata == {"schema": "Child"}
    assert found.properties["outer"].children["inner"].children["x"].only[0] == 3
    assert found.properties["outer"].children["inner"].metadata == {"a": "b"}
    assert archive.metadata["_ai_Application"] == "Test"


def test_an_archive_that_was_not_closed_is_not_complete():
    stream = io.BytesIO()
    AlembicWriter(stream, "Test").scalar("x", "int32", 3)
    assert stream.getvalue()[5] == 0
