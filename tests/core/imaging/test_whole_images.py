# SPDX-License-Identifier: GPL-3.0-or-later
"""Image files that end early are distinguished from complete files."""

import struct
import zlib

import pytest

from hair_addon.core.imaging.whole_images import is_whole, is_whole_ies


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png():
    header = struct.pack(">IIBBBBB", 4, 4, 8, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(20))) + chunk(b"IEND", b"")
    )


def jpeg():
    thumbnail = b"Exif" + b"\xff\xd8\xff\xd9"
    segments = [(0xE1, thumbnail), (0xDB, bytes(65)), (0xDA, bytes(10))]
    head = b"".join(bytes((0xFF, kind)) + struct.pack(">H", len(data) + 2) + data for kind, data in segments)
    return b"\xff\xd8" + head + bytes(range(200)) + b"\xff\xd9"


def tiff(order):
    strips = [bytes(40), bytes(30)]
    tags = [(273, 4, 2, 200), (279, 3, 2, struct.unpack(order + "I", struct.pack(order + "HH", 40, 30))[0])]
    head = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(order + "I", 8)
    entries = b"".join(struct.pack(order + "HHII", *tag) for tag in tags)
    directory = struct.pack(order + "H", len(tags)) + entries + bytes(4)
    return (head + directory).ljust(200, b"\0") + struct.pack(order + "II", 208, 248) + b"".join(strips)


def exr(names, flags=0):
    """Return an OpenEXR file of one line or tile, in as many parts as the flags announce, for channels of one pixel."""
    channels = b"".join(name + b"\0" + struct.pack("<4i", 2, 0, 1, 1) for name in names) + b"\0"
    attributes = [(b"channels", b"chlist", channels), (b"tiles", b"tiledesc", struct.pack("<IIB", 1, 1, 0))]
    part_count = 2 if flags & 0x1000 else 1
    if part_count == 2:
        attributes.append((b"type", b"string", b"tiledimage" if flags & 0x200 else b"scanlineimage"))
    head = b"".join(
        name + b"\0" + kind + b"\0" + struct.pack("<I", len(value)) + value for name, kind, value in attributes
    )
    heads = b"\x76\x2f\x31\x01" + struct.pack("<I", 2 | flags & ~(0x200 if part_count == 2 else 0))
    heads += (head + b"\0") * part_count + b"\0" * (part_count - 1)
    pixels, start = bytes(4 * len(names)), len(heads) + 8 * part_count
    chunks, offsets = b"", b""
    for part in range(part_count):
        offsets += struct.pack("<Q", start + len(chunks))
        chunks += struct.pack("<i", part) * (part_count - 1) + bytes(16 if flags & 0x200 else 4)
        chunks += struct.pack("<i", len(pixels)) + pixels
    return heads + offsets + chunks


FILES = {
    "png": png(),
    "jpeg": jpeg(),
    "tiff": tiff("<"),
    "tiff, big-endian": tiff(">"),
    "exr, layers": exr([b"A.R", b"A.G"]),
    "exr, tiled layers": exr([b"A.R", b"A.G"], 0x200),
    "exr, parts": exr([b"R"], 0x1000),
    "exr, tiled parts": exr([b"R"], 0x1200),
}


@pytest.mark.parametrize("name", FILES)
def test_no_part_of_a_file_is_whole(name):
    data = FILES[name]
    assert is_whole(data) and is_whole(data + b"more")
    assert not any(is_whole(data[:length]) for length in range(4, len(data)))


def test_a_jpeg_may_have_bytes_between_its_segments():
    data = FILES["jpeg"]
    end = 4 + int.from_bytes(data[4:6], "big")
    for more in (b"\0", b"\xff\xff", b"\xff\0", b"\xff\x01", bytes(7)):
        for place in (2, end):
            found = data[:place] + more + data[place:]
            assert is_whole(found) and not is_whole(found[:-1])


def test_a_flipped_bit_of_a_png_is_found():
    data = bytearray(png())
    data[45] ^= 1
    assert is_whole(bytes(data)) is None  # left to a decoder


def test_huge_numbers_of_a_tiff_are_not_followed():
    data = bytearray(tiff("<"))
    data[14:18] = b"\xff" * 4  # number of strips
    assert is_whole(bytes(data)) is False


def test_formats_without_an_end_are_left_to_a_decoder():
    assert is_whole(b"RIFF") is None
    assert is_whole(exr([b"B", b"G", b"R"])) is None and is_whole(exr([b"A.R"], 0x800)) is None


def test_an_ies_file_has_all_its_values():
    profile = b"IESNA:LM-63-2002\nTILT=NONE\n1 -1 1.0 2 1 1 2 0 0 0\n1.0 1.0 0\n0 90\n0\n1000 5"
    assert is_whole_ies(profile)
    assert not any(is_whole_ies(profile[:length]) for length in range(len(profile) - 1))
    for end in (b"\x1a", b"\0", b"\r\n\x1a", b"\nEND OF FILE\n"):  # of programs for DOS, and comments
        assert is_whole_ies(profile + end) and not is_whole_ies(profile[:-2] + end)
    for counts in (b"9 1 1", b"-1 -1 1", b"0 9 1", b"nan 1 1", b"1e30 1 1"):
        assert not is_whole_ies(profile.replace(b"2 1 1", counts))
