# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of the drawing GPU for generating styled strands, and its agreement with Warp.

.venv/bin/python tests/benchmarks/styles_where_drawn.py --strands 30000 100000

On the sample head, of 4,000 guides. In milliseconds to the end on the GPU: a stroke that moves all guides, a slider of
the last style; and the first strands, for which programs are compiled unless the driver has kept them. Beside them the
bytes that each uploads, and how far strands are from Warp's, as parts of their lengths.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import bpy  # noqa: F401 (gpu is a part of it)
import gpu
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from hair_addon.blender.gpu.strand_textures import upload_strands
from hair_addon.blender.gpu.strands import style_maker
from hair_addon.core.styling import bend, braid, clump, curl, frizz, smooth, trim, wet
from tests.support.pictures import drawn_strands
from tests.support.strands.styled import head

STACKS = {
    "none": (),
    "trim": (trim.Settings(factor=0.8, random=0.5),),
    "bend": (bend.Settings(),),
    "smooth": (smooth.Settings(),),
    "frizz": (frizz.Settings(),),
    "curl": (curl.Settings(),),
    "clump": (clump.Settings(),),
    "clump, curl, frizz": (clump.Settings(), curl.Settings(), frizz.Settings()),
    "wet": (wet.Settings(cling=0.0),),
    "braid": (braid.Settings(),),
}
REPETITIONS = 20
CHECKED = 2000  # strands that are compared with Warp's


class Uploads:
    """Bytes of all buffers that are uploaded to the GPU within the context."""

    def __enter__(self):
        self.count, self._real = 0, gpu.types.Buffer
        gpu.types.Buffer = self._counted
        return self

    def _counted(self, kind, size, *values):
        self.count += np.prod(size) * (1 if kind == "UBYTE" else 4) if values else 0
        return self._real(kind, size, *values)

    def __exit__(self, *_error):
        gpu.types.Buffer = self._real


def median(work):
    """Return the milliseconds of the median run."""
    found = []
    for turn in range(REPETITIONS):
        started = time.perf_counter()
        work(turn)
        found.append(time.perf_counter() - started)
    return 1e3 * float(np.median(found))


def measure(hair, styles):
    """Print a row of the table."""
    styling, plain = hair.bound(*styles), hair.plain
    radii = np.full(plain.shape[1], 1e-4, np.float32)
    started = time.perf_counter()
    maker = style_maker.maker_of(hair.binding, styling, len(radii), np.eye(3))
    strands = upload_strands(plain, np.broadcast_to(radii, plain.shape[:2]))
    guides = (hair.guides if styling is None else styling.guides(hair.guides)).numpy().copy()
    strands = maker.make(strands, guides)
    compiled = 1e3 * (time.perf_counter() - started)
    combed = [guides, guides + np.linspace(0.0, 1e-3, guides.shape[1], dtype=np.float32)[:, None]]
    with Uploads() as of_stroke:
        stroke = median(lambda turn: maker.make(strands, combed[turn % 2])), of_stroke.count // REPETITIONS
    slider = None
    if styles:
        others = [hair.bound(*styles[:-1], replace(styles[-1], amount=amount)) for amount in (0.9, 1.0)]

        def slide(turn):
            maker.restyle(others[turn % 2])
            maker.make(strands, guides)

        with Uploads() as of_slider:
            slider = median(slide), of_slider.count // REPETITIONS
    strands = maker.make(strands, guides)
    chosen = np.linspace(0, len(plain) - 1, min(CHECKED, len(plain))).astype(np.int32)
    points = drawn_strands.places(strands)[chosen]
    lengths = np.linalg.norm(np.diff(plain[chosen], axis=1), axis=2).sum(axis=1)
    error = np.linalg.norm(points - hair.styled(*styles)[chosen], axis=2).max(axis=1) / lengths
    return stroke, slider, compiled, error


def main():
    """Print a table for each number of strands."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--strands", type=int, nargs="+", default=[100_000])
    parser.add_argument("--guides", type=int, default=4000)
    given = parser.parse_args()
    gpu.init()
    print(gpu.platform.renderer_get(), gpu.platform.backend_type_get())
    for count in given.strands:
        hair = head(count, given.guides, device="cpu")
        print(
            f"{count:,} strands: stroke [ms, bytes], slider [ms, bytes], made first [ms], error in the median and 99 %"
        )
        for name, styles in STACKS.items():
            (stroke, uploaded), slider, compiled, error = measure(hair, styles)
            of_slider = f"{slider[0]:8.2f} {slider[1]:9,}" if slider else f"{'':18}"
            quantiles = f"{np.median(error):.1e} {np.quantile(error, 0.99):.1e}"
            print(f"  {name:20}{stroke:8.2f} {uploaded:9,}   {of_slider}   {compiled:8.1f}   {quantiles}")


if __name__ == "__main__":
    main()
