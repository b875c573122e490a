# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged files for readers in native code, which may crash: USD, OpenEXR, Blender's importers.

    python -m tests.support.mutants.native COUNT SEED [--only ending, or name of a reader] [--share K/N] [--seconds S]

COUNT is per reader. Share K of N, from 0 on, is the part of one of N processes that together read all mutants; its
seconds are the total for all its readers.

Each reader has its own process, restarted after a crash. The command line also runs some readers in separate processes
(`command_line/import_mesh.py`); only these may crash or hang.
"""

import math
import os
import random
import selectors
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from tests.support.mutants.shares import given, numbers

ROOT = Path(__file__).resolve().parents[3]
PATIENCE = 60.0  # [s] without output of a process
_MEMORY = 4 * 2**30  # [bytes] in addition to the memory of the process

CURVES, TABLES = "curves", "tables"
MESHES = (".ply", ".usdc", ".usda", ".usdz", ".abc", ".obj", ".stl", ".glb", ".gltf", ".fbx")
NAMES = (CURVES, TABLES, *MESHES)


def _samples(name, folder):
    """Return paths of intact files of a kind; the first is the one to read."""
    import bpy

    if name == TABLES:
        from hair_addon.core.files import table_exr
        from hair_addon.core.shading.tables import lookup_tables

        return table_exr.write_tables(folder, lookup_tables.bake(lookup_tables.Settings(size=16)), "1.0.0")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if name == CURVES:
        curves = bpy.data.hair_curves.new("Hair")
        curves.add_curves([4, 5, 6])
        curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", [1e-3] * 15)
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("Hair", curves))
        for number, point in enumerate(curves.points):
            point.position = (number % 5, number // 5, 0.1 * number)
    else:
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
        bpy.context.object.data.materials.append(bpy.data.materials.new("Skin"))
    path = folder / (f"a{name}" if name in MESHES else "a.usdc")
    write = {
        ".obj": bpy.ops.wm.obj_export,
        ".ply": bpy.ops.wm.ply_export,
        ".stl": bpy.ops.wm.stl_export,
        ".abc": lambda filepath: bpy.ops.wm.alembic_export(filepath=filepath, as_background_job=False),
        ".glb": bpy.ops.export_scene.gltf,
        ".fbx": bpy.ops.export_scene.fbx,
        ".gltf": lambda filepath: bpy.ops.export_scene.gltf(filepath=filepath, export_format="GLTF_SEPARATE"),
    }.get(path.suffix, bpy.ops.wm.usd_export)
    write(filepath=str(path))
    return [path, *(other for other in sorted(folder.iterdir()) if other != path)]


def _reader(name, path):
    """Return (read function, check of its result against that of the intact file)."""
    import bpy

    from hair_addon.blender.io import mesh_files
    from hair_addon.blender.io.usd import usd_curves
    from hair_addon.core.files import table_exr

    def same_tables(found, whole):
        assert found.settings == whole.settings and found.n.tobytes() == whole.n.tobytes()

    def valid_scene(_found, _whole):
        bpy.context.view_layer.update()
        for one in (o for o in bpy.data.objects if o.type == "MESH"):
            mesh = one.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
            assert not len(mesh.loops) or max(loop.vertex_index for loop in mesh.loops) < len(mesh.vertices)

    if name == CURVES:
        from tests.support.mutants.readers import are_curves

        return lambda: usd_curves.read(path), are_curves
    if name == TABLES:
        return lambda: table_exr.read_tables(path.parent), same_tables
    return lambda: mesh_files.open_file(path), valid_scene


def _child(name, first, last):
    """Read mutants and report on standard output: the number before each, and its result after it."""
    import resource

    out = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    sys.stdout = open(os.devnull, "w")
    from hair_addon.core.errors import HairError
    from tests.support.mutants.changes import mutated

    with tempfile.TemporaryDirectory() as folder:
        paths = _samples(name, Path(folder))
        wholes = [path.read_bytes() for path in paths]
        read, check = _reader(name, paths[0])
        whole = read()
        check(whole, whole)
        own = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (own + _MEMORY, own + _MEMORY))
        for number in range(first, last):
            print(f"at {number}", file=out, flush=True)
            source = random.Random(number)
            place = source.randrange(len(paths)) if source.random() < 0.3 else 0
            is_text = paths[place].suffix in {".usda", ".obj", ".gltf", ".mtl"}
            paths[place].write_bytes(mutated(wholes[place], source, is_text))
            try:
                check(read(), whole)
                reported = "read"
            except HairError as error:
                reported = (
                    "refused" if str(error).endswith(".") and "\n" not in str(error) else f"no sentence: {error!s:.90}"
                )
            except AssertionError as error:
                reported = f"accepted: {error!s:.90}"
            except Exception as error:
                reported = f"{type(error).__name__}: {error!s:.90}"
            print(" ".join(reported.split()), file=out, flush=True)
            paths[place].write_bytes(wholes[place])


def faults(name, count, seed, share=(0, 1), seconds=math.inf):
    """Return (Counter of results, [faults]) of one reader's mutants."""
    end = time.monotonic() + seconds
    may_end = name == CURVES or (name in MESHES and _may_crash_blender(name))
    told, found = Counter(), []
    asked = numbers(count, seed, share)
    number, last = asked.start, asked.stop
    while number < last and time.monotonic() < end:
        words = [sys.executable, "-m", "tests.support.mutants.native", "child", name, str(number), str(last)]
        before, details = number, {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
        with subprocess.Popen(words, cwd=ROOT, **details) as process:
            seen = _watch(process, end)
        for line in seen.lines:
            kind, _, rest = line.partition(" ")
            if kind == "at":
                number = int(rest)
                continue
            told[line if line in ("read", "refused") else "wrong"] += 1
            if line not in ("read", "refused"):
                found.append(f"{name} {number}: {line}")
        if process.returncode == 0 or seen.is_stopped:
            break
        ended = "no end" if seen.is_late else f"ended with {process.returncode}"
        told[ended] += 1
        if number == before and not seen.lines:
            found.append(f"{name}: {ended} before the first")
            break
        if not may_end:
            found.append(f"{name} {number}: {ended}")
        number += 1
    return told, found


class _Watched:
    def __init__(self):
        self.lines, self.is_late, self.is_stopped = [], False, False


def _watch(process, end):
    """Yield the output of a process; kills it after a long silence or at the time limit."""
    seen, rest = _Watched(), b""
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        while True:
            seen.is_stopped = time.monotonic() > end
            seen.is_late = not seen.is_stopped and not selector.select(PATIENCE)
            if seen.is_stopped or seen.is_late:
                process.kill()
                break
            part = os.read(process.stdout.fileno(), 65_536)
            if not part:
                break
            rest += part
    process.wait()
    seen.lines = rest.decode(errors="replace").splitlines()
    return seen


def _may_crash_blender(ending):
    from hair_addon.blender.io import mesh_files

    return mesh_files.may_crash_blender(f"a{ending}")


def main(words=None):
    """Print the results and faults of each reader's mutants."""
    asked = given(words)
    names = [asked.only] if asked.only else NAMES
    wrong, end = 0, time.monotonic() + asked.seconds
    for place, name in enumerate(names):
        seconds = (end - time.monotonic()) / (len(names) - place)
        told, found = faults(name, asked.count, asked.seed, asked.share, seconds)
        print(f"{name}: {dict(told)}", *found, sep="\n  ", flush=True)
        wrong += len(found)
    print(f"wrong: {wrong}")
    return 1 if wrong else 0


if __name__ == "__main__":
    if sys.argv[1] == "child":
        _child(sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
    else:
        sys.exit(main())
