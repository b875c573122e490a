# SPDX-License-Identifier: GPL-3.0-or-later
"""All strings of the interface: of registered classes and of sources."""

import ast
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import bpy

from hair_addon import blender
from tests.support.syntax import nodes_of

ADDON = Path(blender.__file__).resolve().parents[1]

# Functions whose first argument, or progress step, is shown to the user.
_SHOWING = {
    "interface_text",
    "report_text",
    "HairError",
    "poll_message_set",
    "progress",
    "relaxing",
    "Stage",
    "Warning",
}

_WITHOUT_LABEL = (bpy.types.PropertyGroup, bpy.types.AddonPreferences, bpy.types.UIList, bpy.types.AssetShelf)


def strings_of_classes():
    """Return {string: location} of labels, tooltips and choices of all registered classes."""
    found = {}
    for cls in blender.CLASSES:
        where = cls.__name__
        if not issubclass(cls, _WITHOUT_LABEL):
            found[cls.bl_label] = found[cls.__doc__] = where
        for entry in properties_of(cls):
            if entry.is_hidden or entry.name == entry.identifier:  # the latter has no explicit name
                continue
            for shown in (entry, *(entry.enum_items if entry.type == "ENUM" else ())):
                found[shown.name] = found[shown.description] = f"{where}.{entry.identifier}"
    found.pop("", None)
    return found


def properties_of(cls):
    """Return the RNA properties that a class itself declares."""
    rna = cls.bl_rna
    if issubclass(cls, bpy.types.Operator):
        category, name = cls.bl_idname.split(".")
        rna = getattr(getattr(bpy.ops, category), name).get_rna_type()
    own = getattr(cls, "__annotations__", {})
    # A property of Blender's own base, such as the name of an item, precedes the one that replaces it.
    return list({entry.identifier: entry for entry in rna.properties if entry.identifier in own}.values())


def strings_of_sources():
    """Return {string: location} of literals that are reported, drawn as labels or raised."""
    found = {}
    for path in sorted((ADDON / "blender").rglob("*.py")) + sorted((ADDON / "core").rglob("*.py")):
        found |= {text: f"{path.relative_to(ADDON)}:{line}" for text, line in _read()[path].shown}
    found.pop("", None)
    return found


def parts_of_errors():
    """Return the fixed parts of all messages of `HairError`, including those of f-strings."""
    return {text for read in _read().values() for text in read.errors}


@dataclass(frozen=True)
class _Read:
    shown: list  # of (string, line)
    errors: list


@cache
def _read():
    """Return {path: `_Read`} of all sources, which take seconds to parse."""
    found = {}
    for path in ADDON.rglob("*.py"):
        read = found[path] = _Read([], [])
        for node in nodes_of(ast.parse(path.read_text(encoding="utf-8"))):
            read.shown.extend((text, node.lineno) for text in _shown(node))
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "HairError" and node.args:
                read.errors.extend(_literals(ast.walk(node.args[0])))
    return found


def _shown(node):
    if isinstance(node, ast.Call):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        texts = [keyword.value for keyword in node.keywords if keyword.arg == "text"]
        if name in _SHOWING:
            texts += node.args[:1]
        return _literals(texts)
    if isinstance(node, ast.Return) and isinstance(node.value, ast.Tuple) and _ends_in_dict(node.value):
        return _literals(node.value.elts[:1])  # an operator's message
    return []


def _ends_in_dict(values):
    return bool(values.elts) and isinstance(values.elts[-1], ast.Dict)


def _literals(nodes):
    return [node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
