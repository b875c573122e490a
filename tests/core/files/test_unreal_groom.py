# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms for Unreal have properties with the names, types, scopes and extents of the specification, and are read
back.
"""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.files import alembic, groom_curves
from hair_addon.core.files.alembic import unreal_groom
from hair_addon.core.files.curve_file import Convention
from hair_addon.core.files.groom_curves import GroomCurves
from tests.support.exchange import alembic_reader

# Alembic for Grooms, version 1.5, and our radial roughness: name → (type, extent, scope).
SPECIFICATION = {
    "groom_version_major": ("int16_t", 1, "constant"),
    "groom_version_minor": ("int16_t", 1, "constant"),
    "groom_tool": ("string", 1, "constant"),
    "groom_properties": ("string", 1, "constant"),
    "groom_guide": ("int16_t", 1, "constant"),
    "groom_group_id": ("int32_t", 1, "constant"),
    "groom_group_name": ("string", 1, "constant"),
    "groom_root_uv": ("float32_t", 2, "uniform"),
    "groom_id": ("int32_t", 1, "uniform"),
    "groom_width": ("float32_t", 1, "vertex"),
    "groom_color": ("float32_t", 3, "vertex"),
    "groom_roughness": ("float32_t", 1, "vertex"),
    "groom_radial_roughness": ("float32_t", 1, "uniform"),
    "groom_closest_guides": ("int32_t", 3, "uniform"),
    "groom_guide_weights": ("float32_t", 3, "uniform"),
}


def groom(rng, strand_count=40, guide_count=6, point_count=5):
    """Return (guides, strands, {name: array}) of a group."""
    ids, weights = groom_curves.closest_guides(
        rng.integers(-1, guide_count, (strand_count, 4)), rng.random((strand_count, 4)), 100
    )
    arrays = {
        "guides": rng.random((guide_count, point_count, 3), np.float32),
        "strands": rng.random((strand_count, point_count, 3), np.float32),
        "widths": rng.random((strand_count, point_count), np.float32),
        "colors": rng.random((strand_count, point_count, 3), np.float32),
        "roughness": rng.random((strand_count, point_count), np.float32),
        "radial": rng.random(strand_count, np.float32),
        "uvs": rng.random((strand_count, 2), np.float32),
    }
    guides = GroomCurves(
        3,
        "Long",
        True,
        np.full(guide_count, point_count, np.int32),
        100,
        lambda chosen: np.full((chosen.stop - chosen.start) * point_count, 0.02, np.float32),
        rng.random((guide_count, 2), np.float32),
    )
    strands = GroomCurves(
        3,
        "Long",
        False,
        np.full(strand_count, point_count, np.int32),
        100 + guide_count,
        lambda chosen: arrays["widths"][chosen].ravel(),
        arrays["uvs"],
        ids,
        weights,
        lambda chosen: arrays["colors"][chosen].reshape(-1, 3),
        lambda chosen: arrays["roughness"][chosen].ravel(),
        arrays["radial"],
    )
    return guides, strands, arrays


def write(path, added, rate=None, first_frame=0):
    """Write [(curves, samples)], and return the notes."""
    with unreal_groom.writing(path, "Vellus 1.0", '{"length": 0.3}', rate, first_frame) as writer:
        numbers = [writer.add(curves, len(samples) > 1) for curves, samples in added]
        for number, (_curves, samples) in zip(numbers, added, strict=True):
            for points in samples:
                writer.write_points(number, lambda chosen, of=points: of[chosen].reshape(-1, 3))
    return writer.notes()


def geometry(archive, path):
    return alembic_reader.objects(archive)[path].properties[".geom"].children


def parameters(archive):
    """Return {(path, name): Property} of all geometry parameters."""
    found = {}
    for path, made in alembic_reader.objects(archive).items():
        (schema,) = made.properties.values()
        children = schema.children.get(".arbGeomParams")
        found |= {(path, name): p for name, p in (children.children if children else {}).items()}
    return found


@pytest.fixture
def written(rng, tmp_path):
    """Return (archive, arrays, guides, strands)."""
    guides, strands, arrays = groom(rng)
    assert write(tmp_path / "groom.abc", [(guides, [arrays["guides"]]), (strands, [arrays["strands"]])]) == []
    return alembic_reader.read(tmp_path / "groom.abc"), arrays, guides, strands


def test_every_parameter_is_as_specified(written):
    archive, *_ = written
    found = parameters(archive)
    assert {name for _path, name in found} == set(SPECIFICATION)
    for (_path, name), found_property in found.items():
        kind, extent, scope = SPECIFICATION[name]
        assert found_property.form == "array", name
        assert (found_property.kind, found_property.extent, found_property.scope) == (kind, extent, scope), name
        assert found_property.metadata["isGeomParam"] == "true" and found_property.metadata["podName"] == kind
        assert int(found_property.metadata["podExtent"]) == extent and found_property.metadata["arrayExtent"] == "1"


def test_a_parameter_has_as_many_values_as_its_scope_says(written):
    archive, _arrays, guides, strands = written
    for path, curves in (("/groom/Long_guides/Long_guidesShape", guides), ("/groom/Long/LongShape", strands)):
        counts = {"constant": 1, "uniform": curves.curve_count, "vertex": curves.counts.sum()}
        for (place, name), found in parameters(archive).items():
            if place == path:
                assert len(found.only) == counts[found.scope], name


def test_every_array_comes_back(written):
    archive, arrays, guides, strands = written
    found = {name: p.only for (path, name), p in parameters(archive).items() if path == "/groom/Long/LongShape"}
    np.testing.assert_array_equal(found["groom_width"], arrays["widths"].ravel())
    np.testing.assert_array_equal(found["groom_color"], arrays["colors"].reshape(-1, 3))
    np.testing.assert_array_equal(found["groom_roughness"], arrays["roughness"].ravel())
    np.testing.assert_array_equal(found["groom_radial_roughness"], arrays["radial"])
    np.testing.assert_array_equal(found["groom_root_uv"], arrays["uvs"])
    np.testing.assert_array_equal(found["groom_id"], strands.ids)
    np.testing.assert_array_equal(found["groom_closest_guides"], strands.guide_ids)
    np.testing.assert_array_equal(found["groom_guide_weights"], strands.guide_weights)
    assert found["groom_group_name"] == ["Long"] and found["groom_group_id"][0] == 3 and found["groom_guide"][0] == 0
    for path, curves, points in (
        ("/groom/Long_guides/Long_guidesShape", guides, arrays["guides"]),
        ("/groom/Long/LongShape", strands, arrays["strands"]),
    ):
        shape = geometry(archive, path)
        np.testing.assert_array_equal(shape["P"].only, points.reshape(-1, 3))
        np.testing.assert_array_equal(shape["nVertices"].only, curves.counts)
        np.testing.assert_array_equal(shape["curveBasisAndType"].only[0], (1, 0, 0, 0))  # linear, open
        np.testing.assert_allclose(
            shape[".selfBnds"].only[0], [*points.min(axis=(0, 1)), *points.max(axis=(0, 1))], rtol=1e-6
        )
    root = {name: p.only[0] for (path, name), p in parameters(archive).items() if path == "/groom"}
    assert (root["groom_version_major"], root["groom_version_minor"]) == (1, 5)
    assert root["groom_tool"] == "Vellus 1.0" and root["groom_properties"] == '{"length": 0.3}'


def test_our_reader_returns_what_was_written(written, tmp_path):
    """Our reader returns guides and strands with group, IDs, weights, widths, UV coordinates and colors, bit by bit."""
    _archive, arrays, guides, strands = written
    found = alembic.grooms.read(tmp_path / "groom.abc")
    read = {one.is_guide: one for one in found.sets}
    assert found.stated == Convention(0.01, "Z") and not found.notes and len(read) == 2
    for one, points in ((guides, arrays["guides"]), (strands, arrays["strands"])):
        its = read[one.is_guide]
        assert (its.group_id, its.group_name) == (3, "Long")
        np.testing.assert_array_equal(its.points.astype(np.float32), points.reshape(-1, 3))
        np.testing.assert_array_equal(its.counts, one.counts)
        np.testing.assert_array_equal(its.ids, one.ids)
        np.testing.assert_array_equal(its.root_uvs, one.root_uvs)
    its = read[False]
    np.testing.assert_array_equal(its.radii, np.float32(0.5) * arrays["widths"].ravel())
    np.testing.assert_array_equal(its.colors, arrays["colors"].reshape(-1, 3))
    np.testing.assert_array_equal(its.guide_ids, strands.guide_ids)
    np.testing.assert_array_equal(its.guide_weights, strands.guide_weights)
    assert read[True].colors is None


def test_guides_that_strands_name_are_there(written):
    archive, _arrays, guides, strands = written
    found = parameters(archive)
    of_guides = found["/groom/Long_guides/Long_guidesShape", "groom_id"].only
    of_strands = found["/groom/Long/LongShape", "groom_id"].only
    assert np.isin(found["/groom/Long/LongShape", "groom_closest_guides"].only, of_guides).all()
    assert len(np.unique([*of_guides, *of_strands])) == guides.curve_count + strands.curve_count


def test_guides_move_while_strands_stay(rng, tmp_path):
    guides, strands, arrays = groom(rng)
    samples = [arrays["guides"] + np.float32(frame) for frame in range(4)]
    added = [(guides, samples), (strands, [arrays["strands"]])]
    write(tmp_path / "groom.abc", added, rate=25.0, first_frame=11)
    archive = alembic_reader.read(tmp_path / "groom.abc")
    moving = geometry(archive, "/groom/Long_guides/Long_guidesShape")["P"]
    for found, points in zip(moving.samples, samples, strict=True):
        np.testing.assert_array_equal(found, points.reshape(-1, 3))
    np.testing.assert_allclose(moving.times, [11 / 25, 12 / 25, 13 / 25, 14 / 25])
    assert len(geometry(archive, "/groom/Long/LongShape")["P"].samples) == 1
    assert archive.samplings[1][0] == 4


def test_memory_does_not_grow_with_the_number_of_strands(rng, tmp_path, monkeypatch):
    monkeypatch.setattr(groom_curves, "AT_ONCE", 1000)
    _guides, strands, _arrays = groom(rng)
    part = rng.random((1000 * 41, 3), np.float32)
    peaks = []
    for parts in (4, 40):
        large = replace(
            strands,
            counts=np.full(1000 * parts, 41, np.int32),
            widths=lambda _chosen: part[:, 0],
            colors=lambda _chosen: part,
            roughness=lambda _chosen: part[:, 1],
            root_uvs=None,
            guide_ids=None,
            guide_weights=None,
        )
        tracemalloc.start()
        with unreal_groom.writing(tmp_path / "groom.abc", "", "") as writer:
            writer.write_points(writer.add(large), lambda _chosen: part)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    per_strand = (peaks[1] - peaks[0]) / 36_000
    assert per_strand < 12.0, f"{per_strand} bytes a strand"  # its identity and its number of points
    assert alembic_reader.read(tmp_path / "groom.abc").objects.keys() == {"groom"}


def test_points_that_are_not_finite_are_refused(rng, tmp_path):
    for wrong in (np.nan, np.inf, -np.inf):
        guides, _strands, arrays = groom(rng)
        arrays["guides"][4, 2, 1] = wrong
        with pytest.raises(HairError, match='"Long" has non-finite coordinates'):
            write(tmp_path / "groom.abc", [(guides, [arrays["guides"]])])


def test_what_an_importer_does_is_reported(rng, tmp_path):
    guides, strands, arrays = groom(rng)
    arrays["strands"][[3, 7]] = arrays["strands"][[3, 7], :1]
    alone = np.ascontiguousarray(strands.guide_weights)
    alone[5] = 0.0
    bare = replace(strands, root_uvs=None, guide_weights=alone)
    notes = write(tmp_path / "groom.abc", [(guides, [arrays["guides"]]), (bare, [arrays["strands"]])])
    reported = [str(note) for note in notes]
    assert len(reported) == 3 and "2 strands have no length" in reported[0] and "no UV coordinates" in reported[1]
    assert "follow no guide" in reported[2]
