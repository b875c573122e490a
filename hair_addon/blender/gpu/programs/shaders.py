# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL files → GPU programs: #include expansion and a cache of compiled programs."""

import os
import re
import tempfile
from contextlib import suppress
from pathlib import Path

import gpu

from ....core import interpolation, styling
from ....core.errors import HairError
from ...host.caches import Cache

FOLDER = Path(__file__).resolve().parents[4] / "shaders"
STRAND_FOLDERS = tuple(Path(package.__file__).parent for package in (interpolation, styling))  # of .strand files

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')


def expand(name, replaced=None, texts=None, first=None):
    """Return (text, lines): the text of a file with every #include expanded once, and each line's (file, number).

    replaced: {file: the file to include instead, or None for nothing}; texts: {file: text} of generated files; first: a
    file that is included before this file, or None.
    """
    text, lines, seen, replaced, texts = [], [], set(), replaced or {}, texts or {}

    def add(file):
        file = replaced.get(file, file)
        if file is None or file in seen:
            return
        seen.add(file)
        for number, line in enumerate((texts.get(file) or _read(file)).splitlines(), start=1):
            include = _INCLUDE.match(line)
            if include:
                add(include.group(1))
            else:
                text.append(line)
                lines.append((file, number))

    if first is not None:
        add(first)
    add(name)
    return "\n".join(text) + "\n", lines


def _read(file):
    folders = STRAND_FOLDERS if file.endswith(".strand") else (FOLDER,)
    path = next((folder / file for folder in folders if (folder / file).is_file()), None)
    if path is None:
        raise HairError(f"The shader file {file} is missing: reinstall Vellus.")
    return path.read_text(encoding="utf-8")


program_cache = Cache()  # (function decorated by `cached`, its arguments) → program
cached = program_cache.keeping  # decorates a function that compiles a program: the program is cached until Python ends


def compile_one(makers):
    """Compile the first program that is not yet compiled; returns whether there was one. Raises `HairError`.

    makers: functions decorated by `cached`, each with its arguments in a tuple.
    """
    for make, arguments in makers:
        known = len(program_cache)
        make(*arguments)
        if len(program_cache) > known:
            return True
    return False


def are_compiled(makers):
    """Whether all programs are compiled; makers: as for `compile_one`."""
    return all(program_cache.get((make.__wrapped__, arguments)) is not None for make, arguments in makers)


COLOR = (("color", "VEC4"),)  # default (output, type) of fragment shaders
error_cache = Cache()  # files of a program, and texts that are generated for it → their compile error


def compile_drawing(info, vertex, fragment, targets=COLOR, replaced=None):
    """Return the program of a vertex and a fragment shader; replaced: as for `expand`, of the fragment shader's
    includes.

    targets: (output, type), ... of the fragment shader. Raises `HairError`.
    """
    vertex_text, vertex_lines = expand(vertex)
    fragment_text, fragment_lines = expand(fragment, replaced)
    info.vertex_source(vertex_text)
    info.fragment_source(fragment_text)
    for slot, (target, kind) in enumerate(targets):
        info.fragment_out(slot, kind, target)
    return _create(info, (vertex, fragment), vertex_lines, fragment_lines)


def compile_compute(info, file, replaced=None, texts=None, first=None):
    """Return the compute program of a file; replaced, texts, first: as for `expand`. Raises `HairError`."""
    text, lines = expand(file, replaced, texts, first)
    info.compute_source(text)
    files = (file,) if first is None else (first, file)
    return _create(info, files, [], lines, tuple((texts or {}).values()))


def _create(info, files, vertex_lines, lines, texts=()):
    """Create a program. Raises `HairError` from the driver's log; a failed program is not compiled again."""
    known = error_cache.get((files, texts))
    if known is not None:
        raise HairError(known)
    try:
        return gpu.shader.create_from_info(info)
    except Exception as error:
        where = complaint(_console_of(gpu.shader.create_from_info, info), vertex_lines, lines) or str(error)
        sentence = f"The shader {files[-1]} does not compile on this graphics driver: {where}"
        raise HairError(error_cache.keep((files, texts), sentence)) from error


def _console_of(failing, *arguments):
    """Return the console output of a failing call, as Blender only prints compiler errors."""
    with tempfile.TemporaryFile() as file:
        consoles = {descriptor: os.dup(descriptor) for descriptor in (1, 2)}
        try:
            for descriptor in consoles:
                os.dup2(file.fileno(), descriptor)
            with suppress(Exception):  # the same error as before
                failing(*arguments)
        finally:
            for descriptor, console in consoles.items():
                os.dup2(console, descriptor)
                os.close(console)
        file.seek(0)
        return file.read().decode(errors="replace")


# "VertShader:" or "vertex:", by the backend; then "python_shader.glsl:12:3: Error: …" with a line of our text.
_STAGE = re.compile(r"ERROR\s+\S+\s+(vert|frag)", re.IGNORECASE)
_COMPLAINT = re.compile(r"python_shader\.glsl:(\d+)(?::\d+)?:\s*(.*)")


def complaint(log, vertex_lines, fragment_lines):
    """Return the first error in a compiler's log as "file:line: message", with the source file's line; None if there
    is none.

    vertex_lines, fragment_lines: from `expand`.
    """
    lines = fragment_lines
    for line in log.splitlines():
        stage, found = _STAGE.search(line), _COMPLAINT.search(line)
        if stage:
            lines = vertex_lines if stage[1].lower() == "vert" else fragment_lines
        if found and 0 < int(found[1]) <= len(lines):
            file, number = lines[int(found[1]) - 1]
            return f"{file}:{number}: {found[2]}"
    return None
