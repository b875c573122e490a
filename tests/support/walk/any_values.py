# SPDX-License-Identifier: GPL-3.0-or-later
"""All operators and settings of the add-on with random values, from Blender's registered classes.

New classes are included automatically.
"""

import math

import bpy

# Operators that take minutes by default, or play endlessly.
LEFT_OUT = {"play_dynamics"}

# Limits of counts, so that steps stay fast.
_MOST = {
    "guide_count": 20,
    "strand_count": 60,
    "guide_density": 2e-4,
    "strand_density": 1e-3,
    "point_count": 20,
    "relax_iterations": 3,
    "card_count": 6,
    "segment_count": 8,
}
_MOST |= {
    "level_count": 3,
    "picture_count": 2,
    "texture_size": 64,
    "tube_count": 8,
    "side_count": 6,
    "iterations": 20,
    "size": 64,
}
_MOST |= {
    "width": 24,
    "height": 24,
    "samples_per_side": 1,
    "every": 5,
    "substeps": 6,
    "preroll": 3,
    "levels": 2,
    "seconds": 0.1,
}
_MOST |= {"sample_count": 2, "neighbour_limit": 8, "thickness": 20.0}
NEEDED = {*_MOST, "filepath", "directory", "folder"}  # always given: the defaults are too large, or outside the folder
_LEAST = {"size": 0.1, "lock": 0.1, "strand_count": 1, "guide_count": 1}
_ODD = (math.nan, math.inf, -math.inf, 1e30, -1.0, 0.0)


def operators():
    """Return the names of all operators to call."""
    return sorted({*dir(bpy.ops.vellus)} - LEFT_OUT)


def properties(name):
    """Return the properties of an operator that users set."""
    declared = getattr(bpy.ops.vellus, name).get_rna_type().properties
    return [p for p in declared if p.identifier not in {"rna_type", "shown_sizes"} and p.type != "POINTER"]


def groups(owner):
    """Return all property groups of the add-on in a datablock, including nested ones and items of lists."""
    found, pending = [], [owner.vellus] if hasattr(owner, "vellus") else []
    while pending:
        group = pending.pop()
        found.append(group)
        for declared in (p for p in group.bl_rna.properties if p.identifier != "rna_type"):
            if declared.type in ("POINTER", "COLLECTION"):
                held = getattr(group, declared.identifier)
                held = [held] if declared.type == "POINTER" else held
                pending += [one for one in held if isinstance(one, bpy.types.PropertyGroup)]
    return found


def plain(group, declared):
    """Return the value of a property as text."""
    read = getattr(group, declared.identifier)
    return repr(read[:] if getattr(declared, "is_array", False) else read)


def settings(group):
    """Return the properties of a group that users set."""
    hidden = {"rna_type", "name", "kind"}
    declared = [p for p in group.bl_rna.properties if p.identifier not in hidden and not p.is_readonly]
    return [p for p in declared if p.type not in {"POINTER", "COLLECTION"} and not p.is_hidden]


def value(declared, source, folder, odd=0.0):
    """Return a random value of a property; source: a `random.Random`; folder: of files; odd: rate of odd numbers."""
    name = declared.identifier
    if declared.type == "COLLECTION":  # up to three items, as operators take them
        of_items = [item for item in declared.fixed_type.properties if item.identifier not in {"rna_type", "name"}]
        return [
            {"name": ""} | {item.identifier: value(item, source, folder, odd) for item in of_items}
            for _ in range(source.randint(0, 3))
        ]
    if declared.type == "STRING":
        return _text(name, source, folder)
    if declared.type == "BOOLEAN":
        if declared.is_array:
            return [source.random() < 0.5 for _ in range(declared.array_length)]
        return source.random() < 0.5
    if declared.type == "ENUM":
        items = [item.identifier for item in declared.enum_items]
        if declared.is_enum_flag:
            return {item for item in items if source.random() < 0.5}
        return source.choice(items) if items else declared.default
    if declared.is_array:
        return [_number(declared, source, odd) for _ in range(declared.array_length)]
    return _number(declared, source, odd)


def _number(declared, source, odd):
    name = declared.identifier
    if declared.type == "FLOAT" and source.random() < odd:
        return source.choice(_ODD)
    least = _LEAST.get(name, 0) if declared.type == "INT" or name in ("size", "lock") else declared.hard_min
    low = max(least, declared.hard_min) if name in _LEAST else declared.hard_min
    high = min(declared.hard_max, _MOST.get(name, declared.soft_max))
    low, high = min(low, high), max(low, high)
    if declared.type == "INT":
        return source.choice([int(low), int(high), source.randint(int(low), int(high))])
    low, high = max(low, -1e4), min(high, 1e4)
    return source.choice([low, high, low + (high - low) * source.random() ** 3])


def _text(name, source, folder):
    if name.endswith(("filepath", "directory", "folder")):
        endings = ["", ".png", ".json", ".abc", ".usdc", ".npz", ".asset.blend"]
        return str(folder / f"{source.choice('ab')}{source.choice(endings)}") if source.random() < 0.9 else ""
    there = ["", "missing", "half", "Painted", "Flow", *(o.name for o in bpy.data.objects)]
    there += [a.name for m in bpy.data.meshes for a in (*m.attributes, *m.color_attributes)]
    return source.choice(there)
