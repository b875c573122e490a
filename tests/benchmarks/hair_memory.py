# SPDX-License-Identifier: GPL-3.0-or-later
"""Peak memory of growing hair by one of the methods [bytes], printed last: `hair_memory.py WAY STRANDS`."""

import sys
from pathlib import Path

import bpy

import hair_addon
from tests.benchmarks.hair_peers import Asset, LeanGraph, Ours, head_with_guides


def resident(kind):
    """Return the bytes of VmRSS, or of VmHWM, the peak since its last reset."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(f"{kind}:"))


def grow(way, head, guides, strand_count):
    """Return hair grown by one of the methods, and its `Way`."""
    if way == "ours":
        return Ours.grown(guides, strand_count)
    if way == "lean":
        return LeanGraph.grown(guides, head, strand_count)
    return Asset.grown(guides, head, strand_count, is_poly=way == "poly")


def main(way, strand_count):
    hair_addon.register()
    head, guides = head_with_guides()
    grow(way, head, guides, 1000)  # loads kernels and libraries
    before = resident("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")
    grow(way, head, guides, strand_count)
    bpy.context.view_layer.update()
    print(resident("VmHWM") - before)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
