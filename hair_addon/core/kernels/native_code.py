# SPDX-License-Identifier: GPL-3.0-or-later
"""C++ and CUDA that Warp compiles into kernels, read from files beside the modules that declare the functions.

Warp writes a native function's signature from its Python declaration, so a file holds the body alone; its head lists
the parameters. A body for the processor ends in `.cpp`, one for the GPU in `.cu`, what bodies share in `.h`.
"""

import re
from pathlib import Path

_INCLUDE = re.compile(r'^#include "(\w+\.h)"$', re.MULTILINE)


def body(module_file: str, name: str, **constants: int | float) -> str:
    """Return the source of a function's body for `wp.func_native`.

    module_file: the `__file__` of the module that declares it; name: of the file beside it. constants (int or float)
    stand before it under their names, as `constexpr`. `#include "x.h"` is replaced by that file, of the module's folder
    or of this one.
    """
    folders = Path(module_file).parent, Path(__file__).parent

    def read(name):
        path = next((path for path in (folder / name for folder in folders) if path.is_file()), folders[0] / name)
        return _INCLUDE.sub(lambda include: read(include[1]), path.read_text(encoding="utf-8"))

    return "\n".join([*(_declaration(*constant) for constant in constants.items()), read(name)])


def _declaration(name, value):
    """C++ of a constant: `constexpr int LANES = 8;`."""
    return f"constexpr int {name} = {value};" if isinstance(value, int) else f"constexpr float {name} = {value!r}f;"
