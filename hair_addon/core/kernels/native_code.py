# SPDX-License-Identifier: GPL-3.0-or-later
"""C++ and CUDA source of Warp's native functions, read from files beside the modules that declare them.

Warp generates a native function's signature from its Python declaration, so a file contains only the body; a comment
at its top lists the parameters. Bodies end in `.cpp` and are compiled for CPU and GPU, shared headers in `.h`.
"""

import re
from collections.abc import Mapping
from pathlib import Path

_INCLUDE = re.compile(r'^[ ]*#include "([\w.]+)"$', re.MULTILINE)
_FUNCTION = re.compile(r"^(\w+) (\w+)\(([^)]*)\)\n\{$", re.MULTILINE)


def body(module_file: str, name: str, texts: Mapping[str, str] | None = None, /, **constants: int | float) -> str:
    """Return the source of a function's body for `wp.func_native`.

    module_file: `__file__` of the declaring module; name: of the file beside it; constants: prepended as `constexpr`.
    `#include "x.h"` is replaced by an entry of `texts`, or by the file in the module's folder or in this one. A .strand
    file is included once, with its functions converted to lambdas (strand_language.h).
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
    """Convert the head of a GLSL function to a C++ lambda."""
    kind, name, parameters = function.groups()
    converted = ", ".join(_parameter(parameter.strip()) for parameter in parameters.split(",") if parameter.strip())
    return f"const auto {name} = [&]({converted}) ALWAYS_INLINE -> {kind} {{"


def _parameter(text):
    array = re.fullmatch(r"(\w+) (\w+)\[\w+\]", text)
    if array:
        return f"const {array[1]}* {array[2]}"
    return re.sub(r"^vector ", "const vector& ", re.sub(r"^(?:inout|out) (\w+) ", r"\1& ", text))


def _declaration(name, value):
    """Return the C++ declaration of a constant, such as `constexpr int LANES = 8;`."""
    return f"constexpr int {name} = {value};" if isinstance(value, int) else f"constexpr float {name} = {value!r}f;"
