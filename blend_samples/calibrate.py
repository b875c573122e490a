# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit of dual scattering's backscattering gain to Cycles: python blend_samples/calibrate.py --reuse out/compare.

Draws the pictures of compare.py with several gains and prints their deviation from Cycles. The best is
dual_scattering.BACK_GAIN, which the shaders use.
"""

import argparse
import os
import sys
from pathlib import Path

import compare  # beside this file
import numpy as np

from hair_addon.blender.live import invalidation
from hair_addon.core.shading.tables import dual_scattering

GAINS = (1.2, 1.35, 1.5, 1.7)


def main():
    """Fit and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reuse", type=Path, default=Path("out/compare"), help="folder with images by Cycles")
    options = parser.parse_args()
    stage = compare.Stage(strand_count=30_000)
    lights = ("front", "back")  # the sun alone: an even world hides what comes from where
    print(f"{'gain':>6}{'deviation':>12}    mean ratio of each colour, in front and behind")
    deviations = []
    for gain in GAINS:
        dual_scattering.BACK_GAIN = gain
        invalidation.clear()
        ratios = []
        for color in compare.COLORS:
            for light in lights:
                stage.set(color, light)
                ratios.append(
                    compare.ratio(stage.by_cycles(color, light, options.reuse, options.reuse), stage.by_vellus())
                )
        deviations.append(float(np.sqrt(np.mean(np.square(np.log(ratios))))))
        means = "  ".join(f"{np.mean(ratio):.3f}" for ratio in ratios)
        print(f"{gain:6.2f}{deviations[-1]:12.4f}    {means}", flush=True)
    quadratic = np.polyfit(GAINS, np.square(deviations), 2)
    print(f"minimum at {-0.5 * quadratic[1] / quadratic[0]:.2f}")


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing; all files are closed by now.
    os._exit(0)
