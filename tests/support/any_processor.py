# SPDX-License-Identifier: GPL-3.0-or-later
"""Digests of hair on one processor, and checks that strands do not depend on each other: `any_processor.py [FOLDER
…]`.

Prints a line of JSON for each folder of compiled kernels; without one, for kernels that Warp compiles. Needs neither
Blender nor pytest, so that it also runs on an emulated processor, for example in QEMU's user mode:

    qemu-x86_64 -cpu IvyBridge .venv/bin/python tests/support/any_processor.py FOLDER
"""

import hashlib
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
import warp as wp

from hair_addon.core.grooming import following, groom
from hair_addon.core.kernels import compiled_kernels, kernel_cache
from hair_addon.core.styling import clump, curl, frizz
from tests.support.meshes import HEAD, read_obj
from tests.support.strands import strand_groups
from tests.support.strands.styled import Groom


def laws():
    """Return {group: sizes at which a strand differs from the same strand in another group}; all empty if correct."""
    names = "TWO CLUMPS", "STACK", "STACK, masked", "simulated"
    return {name: list(strand_groups.all_groups()[name].different()) for name in names}


def digests():
    """Return {name: SHA-256} of groups, and of a groom from the head's mesh to styled strands."""
    made = {name: found.all() for name, found in strand_groups.all_groups().items()}
    mesh = read_obj(HEAD)
    hair = Groom(mesh, groom.GuideSettings(guide_count=60, curvature=1.0), groom.HairSettings(strand_count=400), "cpu")
    made["guides"] = hair.guides.numpy()
    made["roots"] = hair.binding.roots.barycentric
    made["weights"] = following.weights_now(hair.binding, hair.guides).weights.numpy()
    made["strands"] = hair.plain
    made["styled"] = hair.styled(clump.Settings(size=0.05, levels=1), curl.Settings(), frizz.Settings())
    return {name: digest(values) for name, values in made.items()}


def digest(values):
    """Return the SHA-256 of an array's bits."""
    return hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()[:16]


def use(folder):
    """Load kernels from a folder."""
    compiled_kernels.FOLDER = Path(folder)
    kernel_cache._loaded.clear()
    for module in wp._src.context.user_modules.values():
        module.unload()


def not_from(folder):
    """Return a list that records the names of modules loaded from elsewhere from now on."""
    use(folder)
    load, names = compiled_kernels.load, []

    def noting(module, device):
        is_there = load(module, device)
        if not is_there:
            names.append(compiled_kernels.short_name(module))
        return is_there

    compiled_kernels.load = noting
    return names


def main():
    """Run the command line."""
    wp.config.log_level = wp.LOG_WARNING
    load = compiled_kernels.load
    for folder in sys.argv[1:] or [""]:
        compiled_kernels.load = load
        compiled_here = not_from(folder) if folder else []
        print(json.dumps({"laws": laws(), "digests": digests(), "compiled here": compiled_here}), flush=True)


if __name__ == "__main__":
    main()
