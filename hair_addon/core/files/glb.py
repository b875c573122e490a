# SPDX-License-Identifier: GPL-3.0-or-later
"""The container of binary glTF files, .glb."""

import json
import struct
from pathlib import Path
from typing import Any

_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")


def read(path: Path) -> tuple[dict[str, Any], bytes]:
    """Return (the JSON of a file as a dictionary, its other chunks as bytes)."""
    content = path.read_bytes()
    length, _kind = _CHUNK.unpack_from(content, _HEADER.size)
    start = _HEADER.size + _CHUNK.size
    return json.loads(content[start : start + length]), content[start + length :]


def write(path: Path, described: dict[str, Any], chunks: bytes) -> None:
    """Write a file of JSON and other chunks."""
    text = json.dumps(described, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    body = _CHUNK.pack(len(text), b"JSON") + text + chunks
    path.write_bytes(_HEADER.pack(b"glTF", 2, _HEADER.size + len(body)) + body)


def add_extension(described: dict[str, Any], name: str, values: dict[str, Any]) -> None:
    """Add an extension to the JSON of a file."""
    described["extensionsUsed"] = [*{**dict.fromkeys(described.get("extensionsUsed", [])), name: None}]
    described.setdefault("extensions", {})[name] = values
