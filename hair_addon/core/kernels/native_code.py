# SPDX-License-Identifier: GPL-3.0-or-later
"""C++ and CUDA that Warp compiles into kernels, read from files beside the modules that declare the functions.

Warp writes a native function's signature from its Python declaration, so a file holds the body alone; its head lists
the parameters. A body for the processor ends in `.cpp`, one for the GPU in `.cu`, what bodies share in `.h`.
"""

import re
from collections.abc import Mapping
from pathlib import Path

_INCLUDE = re.compile(r'^[ ]*#include "([\w.]+)"$', re.MULTILINE)
_FUNCTION = re.compile(r"^(\w+) (\w+)\(([^)]*)\)\n\{$", re.MULTILINE)


def body(module_file: str, name: str, texts: Mapping[str, str] | None = None, /, **constants: int | float) -> str:
    """Return the source of a function's body for `wp.func_native`.

    module_file: the `__file__` of the module that declares it; name: of the file beside it. constants (int or float)
    stand before it under their names, as `constexpr`. `#include "x.h"` is replaced by that file, of the module's folder
    or of this one, or by a text of `texts`; a .strand file once, its functions as lambdas (strand_language.h).
    """
    folders = Path(module_file).parent, Path(__file__).parent
    texts, seen = texts or {}, set()

    def read(name):
        if name.endswith(".strand"):
            if name in seen:
                return ""
            seen.add(name)
        path = next((path for path in (folder / name for folder in folders) if path.is_file()), folders[0] / name)
        text = texts[name] if name in texts else path.read_text(encoding="utf-8")
        if name.endswith(".strand"):
            text = re.sub(r"^}$", "};", _FUNCTION.sub(_lambda, text), flags=re.MULTILINE)
        return _INCLUDE.sub(lambda include: read(include[1]), text)

    return "\n".join([*(_declaration(*constant) for constant in constants.items()), read(name)])


def _lambda(function):
    """C++ of the head of a function that is written as in GLSL."""
    kind, name, parameters = function.groups()
    there = ", ".join(_parameter(parameter.strip()) for parameter in parameters.split(",") if parameter.strip())
    return f"const auto {name} = [&]({there}) ALWAYS_INLINE -> {kind} {{"


def _parameter(text):
    array = re.fullmatch(r"(\w+) (\w+)\[\w+\]", text)
    if array:
        return f"const {array[1]}* {array[2]}"
    return re.sub(r"^vector ", "const vector& ", re.sub(r"^(?:inout|out) (\w+) ", r"\1& ", text))


def _declaration(name, value):
    """C++ of a constant: `constexpr int LANES = 8;`."""
    return f"constexpr int {name} = {value};" if isinstance(value, int) else f"constexpr float {name} = {value!r}f;"
