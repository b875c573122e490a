# SPDX-License-Identifier: GPL-3.0-or-later
"""Shaders that are Warp's functions in GLSL: `python tools/translate_kernels.py` writes them.

They are files, as drawing does not load Warp. A test compares them with their source.
"""

import inspect
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from hair_addon.core.kernels import glsl_text  # noqa: E402 (after the path)
from hair_addon.core.shading.fibre import scattering_kernel  # noqa: E402
from hair_addon.core.shading.light_paths import light_sources  # noqa: E402

# File of shaders/ → functions in it, with all that they call.
SHADERS = {
    "fibre/scattering_kernel.glsl": (
        scattering_kernel.lobe_of,
        scattering_kernel.shifted_lobe,
        scattering_kernel.gaussian,
    ),
    "light/lamp_falloff.glsl": (light_sources.spot_falloff, light_sources.area_falloff),
}


def text_of(name: str) -> str:
    """Return the text of a file of shaders/."""
    file = inspect.getsourcefile(SHADERS[name][0].func)
    source = Path(file).relative_to(ROOT / "hair_addon").as_posix()
    head = (
        "// SPDX-License-Identifier: GPL-3.0-or-later",
        f"// Translated from {source} by tools/translate_kernels.py.",
        "",
    )
    return "\n".join([*head, ""]) + glsl_text.function_text(*SHADERS[name])


if __name__ == "__main__":
    for name in SHADERS:
        (ROOT / "shaders" / name).write_text(text_of(name), encoding="utf-8")
