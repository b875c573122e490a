# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables on disk are read as they were written, and other files are refused."""

import io
import json
import os
import stat
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hair_addon.core.errors import HairError
from hair_addon.core.files import table_exr
from hair_addon.core.shading.tables import dual_scattering, lookup_tables

SETTINGS = lookup_tables.Settings(eta=1.6, sigma_a=(0.1, 0.2, 0.3), tilt=0.0123456789, size=16, caustic="exact")
CHANNELS = ["R", "G", "B"]


@pytest.fixture(scope="module")
def tables():
    return lookup_tables.bake(SETTINGS)


@pytest.fixture
def folder(tmp_path, tables):
    table_exr.write_tables(tmp_path, tables, "1.2.3")
    return tmp_path


@pytest.fixture
def image():
    return np.arange(16 * 8 * 3, dtype=np.float32).reshape(16, 8, 3)


def file_of(channels, **header):
    """Return the bytes of an EXR file as another program might write it."""
    stream = io.BytesIO()
    OpenEXR.File({"type": OpenEXR.scanlineimage, **header}, channels).write(stream)
    return stream.getvalue()


def refused(call, *arguments):
    """Return the message of a refusal, of one or two sentences."""
    with pytest.raises(HairError) as refusal:
        call(*arguments)
    message = str(refusal.value)
    assert message.endswith(".")
    assert "\n" not in message
    return message


def write_table(path, array, channels, header):
    """Write one table of any channels and header, as the add-on writes those of a set."""
    path.write_bytes(table_exr._encode(lookup_tables.to_half(array), channels, header))


def read_table(path, channels, size=None):
    """Return the float32 (H, W, C) array of one table, checked like those of a set, and its header."""
    image = table_exr._Image(path, channels)
    image.demand_size(size)
    return image.pixels().astype(np.float32), image.header


# Files are read as they were written.


@pytest.mark.parametrize(
    "details", [{}, {"axes": "COSINES"}, {"size": 33}, {"sigma_a": (0, 1, 1000)}, {"eta": 2}, {"mode": "energy"}]
)
def test_tables_survive_to_the_last_bit_of_a_half_float(tmp_path, details):
    baked = lookup_tables.bake(replace(SETTINGS, **details))
    table_exr.write_tables(tmp_path, baked, "1.2.3")
    back = table_exr.read_tables(tmp_path)
    assert back.settings == baked.settings
    for name in ("m", "n", "n_trt", "n_res") if "mode" in details else ("m", "n", "n_trt"):
        half = lookup_tables.to_half(getattr(baked, name))
        np.testing.assert_array_equal(getattr(back, name), half.astype(np.float32))
        assert getattr(back, name).dtype == np.float32


@pytest.mark.parametrize("mode", ["classic", "energy"])
def test_dual_tables_survive_and_stand_beside_the_others(tmp_path, mode):
    baked = lookup_tables.bake(replace(SETTINGS, mode=mode))
    dual = dual_scattering.bake(baked)
    table_exr.write_tables(tmp_path, baked, "1.2.3")
    table_exr.write_dual_tables(tmp_path, dual, "1.2.3")
    back = table_exr.read_dual_tables(tmp_path)
    assert back.settings == table_exr.read_tables(tmp_path).settings == baked.settings
    for name in ("theta", "n_g", "n_g_trt"):
        np.testing.assert_array_equal(getattr(back, name), lookup_tables.to_half(getattr(dual, name)))
    _, header = read_table(tmp_path / "dual.exr", CHANNELS, (9, 128))
    assert "a_f, a_b" in header["vellus.yAxis"]


def test_dual_tables_of_another_bake_are_refused(tmp_path):
    for number, eta in enumerate((1.4, 1.5)):
        dual = dual_scattering.bake(lookup_tables.bake(replace(SETTINGS, eta=eta)))
        table_exr.write_dual_tables(tmp_path / str(number), dual, "1")
    os.replace(tmp_path / "0" / "n_g.exr", tmp_path / "1" / "n_g.exr")
    assert "different bakes" in refused(table_exr.read_dual_tables, tmp_path / "1")


def test_header_says_what_the_file_is(folder):
    for name, channels in (("m", "RGBA"), ("n", "RGBA"), ("n_trt", "RGB")):
        _, header = read_table(folder / f"{name}.exr", list(channels), (16, 16))
        assert header["vellus.table"] == name
        assert header["vellus.version"] == "1.2.3"
        assert json.loads(header["vellus.settings"])["tilt"] == SETTINGS.tilt
        assert header["vellus.settings.eta"] == pytest.approx(1.6)
        assert header["vellus.settings.caustic"] == "exact"
        assert "column k of W" in header["vellus.xAxis"]
        assert "row j of H" in header["vellus.yAxis"]
        assert all(f"{channel}: " in header["vellus.channelMeaning"] for channel in channels)


def test_other_programs_see_half_floats_and_row_zero_on_top(tmp_path, image):
    write_table(tmp_path / "image.exr", image, CHANNELS, {"comments": "a note"})
    file = OpenEXR.File(str(tmp_path / "image.exr"), separate_channels=True)
    assert file.header()["comments"] == "a note"
    for index, channel in enumerate(CHANNELS):
        plane = file.channels()[channel].pixels
        assert plane.dtype == np.float16
        np.testing.assert_array_equal(plane, image[..., index])


def test_values_beyond_half_floats_are_held_to_them(tmp_path):
    write_table(tmp_path / "x.exr", np.array([[[1e9], [-1e9], [1e-7]]]), ["Y"], {})
    array, _ = read_table(tmp_path / "x.exr", ["Y"])
    np.testing.assert_array_equal(array[0, :, 0], [65504.0, -65504.0, 0.0])


def test_channels_come_in_the_order_asked_for(tmp_path, image):
    write_table(tmp_path / "x.exr", image, CHANNELS, {})
    array, _ = read_table(tmp_path / "x.exr", ["B", "R", "G"])
    np.testing.assert_array_equal(array, image[..., [2, 0, 1]])


# Writing is whole or not at all.


def test_a_write_leaves_only_the_tables_with_ordinary_permissions(folder):
    assert sorted(os.listdir(folder)) == ["m.exr", "n.exr", "n_trt.exr"]
    (folder / "plain").write_bytes(b"")
    assert stat.S_IMODE((folder / "m.exr").stat().st_mode) == stat.S_IMODE((folder / "plain").stat().st_mode)


def test_folders_are_made_on_the_way(tmp_path, tables):
    table_exr.write_tables(tmp_path / "a b" / "ü", tables, "1")
    assert table_exr.read_tables(tmp_path / "a b" / "ü").settings == SETTINGS


@pytest.mark.parametrize("place", ["file", "file/below", "null\0character", "x" * 300])
def test_folders_that_cannot_be_are_refused(tmp_path, tables, place):
    (tmp_path / "file").write_text("in the way")
    refused(table_exr.write_tables, tmp_path / place, tables, "1")
    assert os.listdir(tmp_path) == ["file"]


def test_a_folder_in_the_place_of_a_table_is_refused_before_any_table_changes(folder):
    (folder / "n_trt.exr").unlink()
    (folder / "n_trt.exr").mkdir()
    before = (folder / "m.exr").read_bytes()
    refused(table_exr.write_tables, folder, lookup_tables.bake(replace(SETTINGS, eta=1.3)), "1")
    assert (folder / "m.exr").read_bytes() == before
    assert sorted(os.listdir(folder)) == ["m.exr", "n.exr", "n_trt.exr"]


def test_a_full_disk_leaves_the_old_tables_and_no_remains(folder, monkeypatch):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}

    def write_half(path, data):
        with open(path, "wb") as file:
            file.write(data[: len(data) // 2])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", write_half)
    message = refused(table_exr.write_tables, folder, lookup_tables.bake(replace(SETTINGS, eta=1.3)), "1")
    assert "No space left" in message
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


# Nothing else is read.


def test_missing_files_and_folders_are_refused(folder):
    refused(table_exr.read_tables, folder / "nowhere")
    refused(read_table, folder, CHANNELS)
    refused(read_table, "null\0character", CHANNELS)
    (folder / "n.exr").unlink()
    assert "n.exr" in refused(table_exr.read_tables, folder)


def test_tables_of_the_other_mode_are_not_mixed_in(folder, tmp_path_factory):
    """A folder that has held tables of both modes is read as one bake or refused, and never mixed."""
    other = tmp_path_factory.mktemp("other")
    table_exr.write_tables(other, lookup_tables.bake(replace(SETTINGS, mode="energy")), "1.2.3")
    for name in ("m", "n_trt", "n_res"):
        os.replace(other / f"{name}.exr", folder / f"{name}.exr")
    assert "different bakes" in refused(table_exr.read_tables, folder)
    os.replace(other / "n.exr", folder / "n.exr")
    assert table_exr.read_tables(folder).settings.mode == "energy"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_a_pipe_without_a_writer_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.exr")
    assert "not a file" in refused(read_table, tmp_path / "pipe.exr", CHANNELS)


@pytest.mark.parametrize(
    "content", [b"", b"\x76\x2f", b"\x89PNG\r\n\x1a\n" + bytes(100), b"\x76\x2f\x31\x01", b"# text"]
)
def test_foreign_files_are_refused(tmp_path, content):
    (tmp_path / "x.exr").write_bytes(content)
    refused(read_table, tmp_path / "x.exr", CHANNELS)


def test_large_files_are_refused_unread(tmp_path):
    with open(tmp_path / "x.exr", "wb") as file:
        file.write(b"\x76\x2f\x31\x01")
        file.truncate(65 * 2**20)  # sparse: takes no room
    assert "64 MB" in refused(read_table, tmp_path / "x.exr", CHANNELS)


@pytest.mark.parametrize("name", ["m", "n", "n_trt"])
def test_truncated_files_are_refused_at_every_length(folder, name):
    path = folder / f"{name}.exr"
    data = path.read_bytes()
    for length in [*range(0, len(data), 97), len(data) - 1]:
        path.write_bytes(data[:length])
        refused(table_exr.read_tables, folder)


def test_giant_claims_are_refused(tmp_path, image):
    data = bytearray(file_of({channel: image[..., 0].astype(np.float16) for channel in CHANNELS}))
    window = data.find(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    for corner in ([0, 0, 10**9, 10**9], [0, 0, 4000, 4000], [-(2**31), -(2**31), 2**31 - 1, 2**31 - 1], [9, 9, 0, 0]):
        data[window : window + 16] = np.array(corner, "<i4").tobytes()
        (tmp_path / "x.exr").write_bytes(data)
        refused(read_table, tmp_path / "x.exr", CHANNELS)


def test_reading_leaves_other_users_of_openexr_their_limits(folder):
    before = OpenEXR.getMaxImageSize(), OpenEXR.getMaxTileSize()
    table_exr.read_tables(folder)
    (folder / "m.exr").write_bytes(b"\x76\x2f\x31\x01")
    refused(table_exr.read_tables, folder)
    assert (OpenEXR.getMaxImageSize(), OpenEXR.getMaxTileSize()) == before


def test_other_sizes_are_refused(tmp_path, folder, image):
    write_table(tmp_path / "x.exr", image, CHANNELS, {})
    assert "8 x 16" in refused(read_table, tmp_path / "x.exr", CHANNELS, (16, 16))
    assert read_table(tmp_path / "x.exr", CHANNELS, (16, 8))[0].shape == (16, 8, 3)


def test_other_channels_are_refused(tmp_path, folder):
    assert "A, B, G, R" in refused(read_table, folder / "n.exr", CHANNELS)
    refused(read_table, folder / "n_trt.exr", list("RGBA"))
    refused(read_table, folder / "n_trt.exr", ["R", "G", "Y"])


def test_other_kinds_of_image_are_refused(tmp_path, image):
    plane = image[..., 0].astype(np.float16)
    path = tmp_path / "x.exr"
    path.write_bytes(file_of({"Y": plane.astype(np.float32)}))
    assert "half" in refused(read_table, path, ["Y"])
    path.write_bytes(file_of({"Y": np.where(plane > 5, np.float16(np.inf), plane)}))
    assert "finite" in refused(read_table, path, ["Y"])
    path.write_bytes(file_of({"Y": np.where(plane > 5, np.float16(np.nan), plane)}))
    assert "finite" in refused(read_table, path, ["Y"])
    path.write_bytes(file_of({"Y": plane}, type=OpenEXR.tiledimage, tiles=OpenEXR.TileDescription()))
    assert "tiles" in refused(read_table, path, ["Y"])
    stream = io.BytesIO()
    part = {"type": OpenEXR.scanlineimage}
    OpenEXR.File([OpenEXR.Part(part, {"Y": plane}), OpenEXR.Part(part, {"Y": plane})]).write(stream)
    path.write_bytes(stream.getvalue())
    assert "2 images" in refused(read_table, path, ["Y"])


def test_plain_images_are_not_tables(folder, image):
    write_table(folder / "n_trt.exr", image, CHANNELS, {})
    assert "not the table n_trt" in refused(table_exr.read_tables, folder)


def test_tables_of_another_bake_beside_these_are_refused(folder, tmp_path_factory):
    other = tmp_path_factory.mktemp("other")
    table_exr.write_tables(other, lookup_tables.bake(replace(SETTINGS, eta=1.3)), "1.2.3")
    os.replace(other / "n.exr", folder / "n.exr")
    assert "different bakes" in refused(table_exr.read_tables, folder)


def rewrite(path, **changes):
    """Change only header attributes of a table."""
    file = OpenEXR.File(str(path), separate_channels=True)
    planes = {name: channel.pixels for name, channel in file.channels().items()}
    kept = {name: value for name, value in file.header().items() if name.startswith("vellus.")}
    path.write_bytes(file_of(planes, **kept | {f"vellus.{name}": value for name, value in changes.items()}))


@pytest.mark.parametrize(
    "text",
    ["", "[]", "1", "{", "[" * 9000, '{"eta": 1.55}', "{" + " " * 20_000 + "}"],
    ids=lambda text: text[:8],
)
def test_headers_without_settings_are_refused(folder, text):
    for name in ("m", "n", "n_trt"):
        rewrite(folder / f"{name}.exr", settings=text)
    refused(table_exr.read_tables, folder)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("eta", 0.5),
        ("eta", "1.55"),
        ("eta", None),
        ("eta", float("nan")),
        ("eta", 10**400),
        ("size", 10**400),
        ("size", 16.5),
        ("size", 32),
        ("size", True),
        ("sigma_a", [0.1, 0.2]),
        ("sigma_a", [0.1, 0.2, -1.0]),
        ("sigma_a", [0.1, [0.2], 0.3]),
        ("caustic", "neither"),
        ("another", 1),
    ],
    ids=lambda part: str(part)[:12],
)
def test_headers_with_impossible_settings_are_refused(folder, key, value):
    text = json.dumps({**asdict(SETTINGS), key: value})
    for name in ("m", "n", "n_trt"):
        rewrite(folder / f"{name}.exr", settings=text)
    refused(table_exr.read_tables, folder)


def test_a_rewritten_table_is_read_only_while_it_is_the_one_that_was_baked(folder):
    rewrite(folder / "n.exr", version="9")
    assert table_exr.read_tables(folder).settings == SETTINGS
    rewrite(folder / "n.exr", format=1)
    assert "this version" in refused(table_exr.read_tables, folder)


def test_edited_texels_are_refused(folder):
    path = folder / "n_trt.exr"
    array, header = read_table(path, CHANNELS)
    array[3, 3, 0] += 1.0
    write_table(path, array, CHANNELS, {k: v for k, v in header.items() if k.startswith("vellus.")})
    assert "changed" in refused(table_exr.read_tables, folder)


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(data=st.data())
def test_damaged_bytes_give_the_right_tables_or_a_refusal(folder, tables, data):
    path = folder / "n.exr"
    original = path.read_bytes()
    damaged = bytearray(original)
    for _ in range(data.draw(st.integers(1, 3))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(damaged)
    try:
        back = table_exr.read_tables(folder)
    except HairError:
        pass
    else:
        np.testing.assert_array_equal(back.n, lookup_tables.to_half(tables.n).astype(np.float32))
    finally:
        path.write_bytes(original)
