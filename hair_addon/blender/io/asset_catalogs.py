# SPDX-License-Identifier: GPL-3.0-or-later
"""Catalogs of an asset library: lines of blender_assets.cats.txt, UUID:path:name."""

import uuid
from pathlib import Path

from ...core.errors import HairError, cause_of
from ...core.files.whole_file import whole_file

FILE = "blender_assets.cats.txt"
_HEAD = "# This is an Asset Catalog Definition file for Blender.\n#\n# Other lines are UUID:path:name.\n\nVERSION 1\n\n"


def identifier(folder: Path, catalog: str) -> str:
    """The UUID of a catalog such as "Hair/Short" in a library's folder, which gets it if it lacks it; its other lines
    stay. Raises `HairError`.
    """
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
        if len(found) >= 2 and found[1] == catalog and _is_uuid(found[0]):  # Blender leaves out other lines
            return found[0]
    made = str(uuid.uuid4())
    line = f"{made}:{catalog}:{catalog.replace('/', '-')}\n"
    with whole_file(path) as partial:
        partial.write_text(text + ("" if text.endswith("\n") else "\n") + line, encoding="utf-8")
    return made


def _is_uuid(text):
    try:
        return str(uuid.UUID(text)) == text.lower()
    except ValueError:
        return False
