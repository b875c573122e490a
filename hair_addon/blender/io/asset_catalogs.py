# SPDX-License-Identifier: GPL-3.0-or-later
"""Catalogs of an asset library: lines of blender_assets.cats.txt, UUID:path:name."""

import uuid
from dataclasses import dataclass
from pathlib import Path

from ...core.errors import HairError, cause_of

FILE = "blender_assets.cats.txt"
_HEAD = "# This is an Asset Catalog Definition file for Blender.\n#\n# Other lines are UUID:path:name.\n\nVERSION 1\n\n"


@dataclass(frozen=True)
class Catalog:
    """UUID of a catalog and path of the library's list.

    text: the list with the catalog added; None if the list already has it.
    """

    identifier: str
    path: Path
    text: str | None


def read(folder: Path, catalog: str) -> Catalog:
    """Return a `Catalog` such as "Hair/Short" of a library's folder. Raises `HairError`."""
    catalog = "/".join(part.strip() for part in catalog.replace(":", "-").split("/") if part.strip())
    if not catalog or any(ord(character) < 32 for character in catalog):
        raise HairError("The catalog has no name: type one, or clear the field.")
    path = folder / FILE
    try:
        text = path.read_text(encoding="utf-8") if path.is_file() else _HEAD
    except (OSError, UnicodeDecodeError) as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=cause_of(error)) from error
    for line in text.splitlines():
        found = line.split(":")
        if len(found) >= 2 and found[1] == catalog and _is_uuid(found[0]):  # Blender ignores other lines
            return Catalog(found[0], path, None)
    made = str(uuid.uuid4())
    line = f"{made}:{catalog}:{catalog.replace('/', '-')}\n"
    return Catalog(made, path, text + ("" if text.endswith("\n") else "\n") + line)


def _is_uuid(text):
    try:
        return str(uuid.UUID(text)) == text.lower()
    except ValueError:
        return False
