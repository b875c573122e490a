# SPDX-License-Identifier: GPL-3.0-or-later
"""Outputs of grooms outside the scene, for digests.py: arrays, tables, settings, commands and the interface."""

import inspect
import os
import re
import subprocess
import sys

import bpy
import numpy as np

from hair_addon import api
from tests.support.comparison.grooms import HEAD, ROOT, activate, film, grown, update


def plain_arrays(found, _folder):
    """Strands on arrays, without a scene."""
    side = np.linspace(-0.1, 0.1, 9, dtype=np.float32)
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    places = np.stack([x, y, 0.03 * np.sin(20.0 * x)], axis=1).astype(np.float32)
    corner = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    triangles = np.concatenate(
        [np.stack([corner, corner + 1, corner + 9], 1), np.stack([corner + 1, corner + 10, corner + 9], 1)]
    )
    mesh = places, triangles.astype(np.int32)
    guides = api.distribute_guides(mesh, guide_count=40, curvature=1.0, seed=4)
    hair = api.interpolate_hair(guides, mesh=mesh, strand_count=500, seed=2)
    lines = [places[i] + np.linspace([0, 0, 0], [0.01, 0, 0.05], 3 + i % 4) for i in range(0, 81, 5)]
    drawn = api.use_as_guides(lines, mesh)
    for name, strands in (("guides", guides), ("strands", hair), ("drawn guides", drawn)):
        found.add(f"{name}/points", api.points(strands))
        found.add(f"{name}/roots", strands.roots.triangle)
        found.add(f"{name}/coordinates", strands.roots.barycentric)


def tables_and_settings(found, folder):
    """Files of tables of both modes and axes, and of settings that are read back."""
    for mode, axes in (("classic", "ANGLES"), ("classic", "COSINES"), ("energy", "ANGLES"), ("energy", "COSINES")):
        for path in api.bake_tables(folder / f"{mode} {axes}", size=32, mode=mode, axes=axes):
            found.add_file(f"{mode}, {axes}/{path.name}", path)
    bpy.ops.mesh.primitive_cube_add()
    _guides, hair = grown(bpy.context.object, {"guide_count": 20}, {"strand_count": 50})
    presets = bpy.ops.vellus.apply_preset.get_rna_type().properties["preset"].enum_items.keys()
    for preset in presets:
        api.shade(hair, preset)
        update()
        found.add_properties(f"preset {preset}/properties", hair.data.vellus.appearance)
        found.add_tree(f"preset {preset}/material", hair.data.materials[0].node_tree)
        found.add(f"preset {preset}/tables", repr(api.table_settings(api.settings_of(hair))))
    activate(hair)
    bpy.ops.vellus.bake_tables(directory=str(folder / "of hair"), size=32)
    for path in sorted((folder / "of hair").iterdir()):
        found.add_file(f"of hair/{path.name}", path)
    hair.data.vellus.table_folder = ""  # the folder differs in each run
    api.save_settings(folder / "settings.json", api.settings_of(hair))
    found.add_file("settings.json", folder / "settings.json")
    bpy.ops.vellus.save_groom_settings(filepath=str(folder / "operator.json"))
    found.add_file("operator.json", folder / "operator.json")
    api.apply_settings(hair, api.load_settings(folder / "settings.json"))
    update()
    found.add_strands("strands of saved settings", hair)


def rendered(found, folder):
    """Frames of a saved scene, rendered by the command line."""
    bpy.ops.mesh.primitive_cube_add()
    grown(bpy.context.object, {"guide_count": 20}, {"strand_count": 100, "radius": 0.01})
    film()
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
    words = "render scene.blend --out ##.exr --frames 1-2 --width 48 --height 36 --samples 4 --json"
    status, reported = run_command(words, folder)
    found.add("said", [status, *reported])
    for path in sorted(folder.glob("*.exr")):
        found.add_pixels(path.name, path)


def interface(found, _folder):
    """Names, tooltips and properties of registered classes, and functions for scripts."""
    ours = [name for name in dir(bpy.types) if name.upper().startswith("VELLUS")]
    found.add("names", ours)
    for name in ours:
        cls = getattr(bpy.types, name)
        told = ("bl_idname", "bl_label", "bl_description", "bl_space_type", "bl_region_type", "bl_category", "bl_order")
        details = [str(getattr(cls, part, None)) for part in (*told, "bl_parent_id", "__doc__")]
        found.add(f"{name}/class", [*details, sorted(getattr(cls, "bl_options", ()))])
        own = [p for p in cls.bl_rna.properties if p.identifier != "rna_type" and not p.identifier.startswith("bl_")]
        found.add(f"{name}/properties", [described(p) for p in own])
    for name in ("Curves", "Scene", "ViewLayer"):
        found.add(f"{name}.vellus", described(getattr(bpy.types, name).bl_rna.properties["vellus"]))
    found.add("operators", dir(bpy.ops.vellus))
    functions = {name: getattr(api, name) for name in sorted(api.__all__)}
    found.add("api", {name: list(inspect.signature(function).parameters) for name, function in functions.items()})


def described(details):
    """Return a property as declared by its class, with type and limits."""
    parts = ("identifier", "name", "description", "type", "subtype", "unit", "default", "hard_min", "hard_max")
    parts += ("soft_min", "soft_max", "precision", "array_length", "translation_context", "is_hidden", "is_animatable")
    found = {part: getattr(details, part) for part in parts if hasattr(details, part)}
    if getattr(details, "is_array", False):
        found["default"] = list(details.default_array)
    if details.type == "ENUM":
        found["default"] = sorted(details.default_flag) if details.is_enum_flag else details.default
        found["items"] = [(item.identifier, item.name, item.description) for item in details.enum_items_static]
    if details.type in ("POINTER", "COLLECTION"):
        found["fixed type"] = details.fixed_type.identifier
    return found


# Commands, in separate processes: (name, arguments, files that they write).
_COMMANDS = (
    ("groom arrays", "groom head.obj --up Y --out head.npz --guides 60 --strands 700 --seed 3 --json", ["head.npz"]),
    (
        "groom usd",
        "groom head.obj --up Y --out head.usda --guides 30 --strands 90 --preset BLOND --json",
        ["head.usda"],
    ),
    ("groom blend", "groom head.obj --up Y --out head.blend --guides 30 --strands 90 --json", []),
    (
        "groom followed",
        "groom head.obj --up Y --guides-from head.npz --strands 80 --out followed.npz",
        ["followed.npz"],
    ),
    ("info blend", "info head.blend --json", []),
    ("info arrays", "info head.npz", []),
    ("bake tables", "bake-tables --out tables --size 24 --mode classic --json", ["tables/m.exr", "tables/n.exr"]),
    ("settings", "settings --melanin 0.3 --strands 5 --out settings.json", ["settings.json"]),
    ("schema", "settings --schema", []),
    ("refusal", "groom missing.obj --out head.npz", []),
)


OUTPUTS = (plain_arrays, tables_and_settings, rendered, interface)


def run_commands(folder):
    """Run all commands in turn; returns [(name, exit status, output of both streams, {file: bytes})]."""
    (folder / HEAD.name).write_bytes(HEAD.read_bytes())
    ran = []
    for name, words, files in _COMMANDS:
        status, reported = run_command(words, folder)
        ran.append((name, status, reported, {file: (folder / file).read_bytes() for file in files}))
    return ran


def run_command(words, folder):
    """Run a command in a folder; returns (exit status, output of both streams).

    Times, file sizes and the name of the folder are removed from the output.
    """
    command = [sys.executable, "-m", "hair_addon", *words.split()]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    reported = [re.sub(r'"(seconds|bytes)": [0-9.e-]+', r'"\1": 0', text) for text in (done.stdout, done.stderr)]
    reported = [re.sub(r"\b[0-9.]+ s\b", "0 s", text) for text in reported]
    return done.returncode, [text.replace(str(folder), "") for text in reported]


def add_commands(found, ran):
    """Add digests of what `run_commands` returned."""
    for name, status, reported, files in ran:
        found.add(f"{name}/said", [status, *reported])
        for file, data in files.items():
            # The order in which Blender's USD exporter writes siblings varies between runs.
            found.add(f"{name}/{file}", sorted(data.decode().splitlines()) if file.endswith(".usda") else data)
