# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the bytes of an image file are complete, without decoding its pixels.

Sources: PNG (ISO/IEC 15948), JPEG (ITU-T T.81, annex B), TIFF (revision 6.0), OpenEXR (file layout 2.0), IES
(ANSI/IESNA LM-63).
"""

import math
import zlib

_PNG, _JPEG, _TIFF, _EXR = b"\x89PNG\r\n\x1a\n", b"\xff\xd8", (b"II*\0", b"MM\0*"), b"\x76\x2f\x31\x01"

_SCAN = 0xDA  # marker of a JPEG file
# Tags of a TIFF file: offsets and byte counts of its strips, and of its tiles. Types of their values → bytes.
_PARTS = (273, 279), (324, 325)
_BYTES = {3: 2, 4: 4}
# Flags of an OpenEXR file, and of its chunks {whether of tiles: bytes between the part's number and the size}.
_HAS_TILES, _IS_DEEP, _HAS_PARTS = 0x200, 0x800, 0x1000
_BEFORE_SIZE = {False: 4, True: 16}

_HEAD_OF_IES = 13  # numbers before the angles
_SPACES_OF_IES = bytes.maketrans(b",\x1a\0", b"   ")  # commas, and what old programs write at the end


def has_structure(head: bytes) -> bool:
    """Whether the first bytes of a file are those of a format that `is_whole` checks."""
    return head.startswith((_PNG, _JPEG, *_TIFF, _EXR))


def is_whole(data: bytes) -> bool | None:
    """Whether the data of an image file are complete; None if only decoding shows it.

    Blender reads JPEG and TIFF files that end early, with gray or black instead of the rest.
    """
    if data.startswith(_PNG):
        return _is_whole_png(data) or None  # readers accept some wrong checksums
    if data.startswith(_JPEG):
        return _is_whole_jpeg(data)
    if data.startswith(_EXR):
        return _is_whole_exr(data)
    return _is_whole_tiff(data) if data.startswith(_TIFF) else None


def is_whole_ies(data: bytes) -> bool:
    """Whether an IES file has all candela values that its header announces."""
    _head, found, rest = data.partition(b"TILT=")
    tilt, _line, numbers = rest.partition(b"\n")
    if not found or tilt.strip() != b"NONE":
        return bool(found and numbers.strip())
    numbers = numbers.translate(_SPACES_OF_IES).split()
    try:
        vertical, horizontal = (int(float(number)) for number in numbers[3:5])
        count = _HEAD_OF_IES + vertical + horizontal + vertical * horizontal
        # Text may follow the values.
        values = [float(number) for number in numbers[: max(count, 0)]]
    except (ValueError, OverflowError):
        return False
    return min(vertical, horizontal) > 0 and len(values) == count


def _is_whole_png(data):
    """Whether all chunks up to the last have their checksums."""
    place, view = len(_PNG), memoryview(data)
    while place + 12 <= len(data):
        end = place + 12 + int.from_bytes(data[place : place + 4], "big")
        checked = view[place + 4 : end - 4]
        if end > len(data) or zlib.crc32(checked) != int.from_bytes(data[end - 4 : end], "big"):
            return False
        if checked[:4] == b"IEND":
            return True
        place = end
    return False


def _is_whole_jpeg(data):
    """Whether the end of the picture follows its first scan: a thumbnail before it has an end too."""
    place = data.find(b"\xff", len(_JPEG))
    while 0 <= place <= len(data) - 4:
        kind = data[place + 1]
        if kind == _SCAN:
            return data.find(b"\xff\xd9", place) >= 0
        # Decoders skip bytes between segments.
        has_length = kind not in (0, 1, 0xFF) and not 0xD0 <= kind <= 0xD9
        place += 2 + int.from_bytes(data[place + 2 : place + 4], "big") if has_length else 1
        place = data.find(b"\xff", place)
    return False


def _is_whole_exr(data):
    """Whether all chunks of an OpenEXR file with layers or parts are within the data, as decoders of single pictures
    refuse such files; None for other files.
    """
    flags = _little(data, 4, 4)
    try:
        parts, place = _parts_of_exr(data, bool(flags & _HAS_PARTS))
        names = _names_in(parts[0]["channels"])
    except (ValueError, KeyError, IndexError):
        return False
    if flags & _IS_DEEP or not (flags & _HAS_PARTS or any(b"." in name for name in names)):
        return None
    first, last = len(data), 0  # chunks; their offsets end where the first chunk begins
    while place < first:
        offset = _little(data, place, 8)
        if not place + 8 <= offset < len(data):
            return False
        first, last, place = min(first, offset), max(last, offset), place + 8
    has_tiles = bool(flags & _HAS_TILES)
    if flags & _HAS_PARTS:
        number, last = _little(data, last, 4), last + 4
        has_tiles = number < len(parts) and parts[number].get("type") == b"tiledimage"
    size = last + _BEFORE_SIZE[has_tiles]
    return last > 0 and size + 4 + _little(data, size, 4) <= len(data)


def _parts_of_exr(data, has_parts):
    """Return ([{attribute: value}] of the parts of an OpenEXR file, place after them).

    Raises `ValueError` if the data end before.
    """
    parts, place = [{}], 8
    while True:
        end = data.index(b"\0", place)
        name, place = data[place:end].decode("latin-1"), end + 1
        if name:
            place = data.index(b"\0", place) + 1  # after the type
            size = _little(data, place, 4)
            parts[-1][name] = data[place + 4 : place + 4 + size]
            place += 4 + size
        elif not has_parts:
            return parts, place
        elif not parts[-1]:
            return parts[:-1], place
        else:
            parts.append({})


def _names_in(channels):
    """Return the names of a list of channels of an OpenEXR file."""
    names, place = [], 0
    while channels[place]:
        end = channels.index(b"\0", place)
        names.append(channels[place:end])
        place = end + 17
    return names


def _little(data, place, size):
    return int.from_bytes(data[place : place + size], "little")


def _is_whole_tiff(data):
    """Whether the strips or tiles of the first picture are within the data; None without their sizes."""
    order = "little" if data.startswith(b"II") else "big"

    def number(place, size):
        return int.from_bytes(data[place : place + size], order)

    directory = number(4, 4)
    end = directory + 2 + 12 * number(directory, 2)
    if not directory or directory + 2 > len(data) or end > len(data):
        return False
    tags = {number(place, 2): place for place in range(directory + 2, end, 12)}
    for places, counts in _PARTS:
        if places in tags and counts in tags:
            starts, sizes = (_values(number, tags[tag], len(data)) for tag in (places, counts))
            return all(start + size <= len(data) for start, size in zip(starts, sizes, strict=False))
    return None


def _values(number, entry, end):
    """Return the values of a TIFF entry at a place; infinity if they are not within the data, which end at `end`.

    number(place, size): reads one.
    """
    size, count = _BYTES.get(number(entry + 2, 2), 4), number(entry + 4, 4)
    first = entry + 8 if size * count <= 4 else number(entry + 8, 4)
    if first + size * count > end:
        return [math.inf]
    return [number(place, size) for place in range(first, first + size * count, size)]
