# SPDX-License-Identifier: GPL-3.0-or-later
"""Combing in a layer stays when the head is remeshed and the guides are doubled, in a window.

Run by a desktop Blender as steps.py says. Notes how far guides are from the nearest guides that were combed.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))
from tests.desktop.haircuts import hands  # noqa: E402
from tests.desktop.haircuts.comparison import distances  # noqa: E402
from tests.desktop.haircuts.haircuts import AWAY_FROM_PARTING, FRONT, SIDE, grown  # noqa: E402
from tests.desktop.steps import OUT, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    curve_points,
    import_head,
    install,
    mask_scalp,
    refine_to,
    remove_objects,
    take_picture,
    wait,
    wait_for,
)

VOXEL = 0.005  # [m]
COUNT, STRANDS = 400, 300
_COMBED = 0.05  # a guide is combed if it moved by at least this part of its length

STYLED = (
    *grown(0.28, drape=False),
    hands.fields("hair", strand_count=STRANDS),
    hands.view(*FRONT),
    hands.lines("vellus.draw_flow", *AWAY_FROM_PARTING),
    hands.fields("guides", drape=True),
)

# The hair of the left side to the back.
COMBED = (
    hands.press("vellus.add_layer"),
    hands.view(*SIDE),
    hands.comb("Comb", 0.05, *[[(0.09, y, z) for y in (-0.12, -0.02, 0.08)] for z in (0.76, 0.70, 0.64, 0.58)]),
    hands.press("vellus.comb_guides"),
)


def guides():
    """Return (G, P, 3) positions."""
    return curve_points(hands.guides()).reshape(len(hands.guides().data.curves), -1, 3)


def comb():
    install(ZIP)
    refine_to(1)
    remove_objects()
    mask_scalp(import_head())
    yield from wait(0.5)
    for step in STYLED:
        yield from step()
    grown_guides = guides()
    for step in COMBED:
        yield from step()
    combed = guides()
    facts["combed"] = np.sort(distances(combed, grown_guides)).tolist()
    take_picture(OUT / "combed.png")
    before = len(bpy.data.objects["Head"].data.vertices)
    yield from hands.remeshed(VOXEL)()
    facts["vertices"] = [before, len(bpy.data.objects["Head"].data.vertices)]
    facts["groups"] = [group.name for group in bpy.data.objects["Head"].vertex_groups]
    yield from hands.select("Hair Guides")()
    yield from hands.fields("guides", guide_count=2 * COUNT)()
    yield from wait_for(lambda: len(hands.guides().data.curves) == 2 * COUNT)
    yield from wait(1.0)
    after = guides()
    facts["guides"], facts["status"] = len(after), [hands.hair().data.vellus.status, hands.guides().data.vellus.status]
    is_combed = distances(combed, grown_guides) > _COMBED
    roots = combed[is_combed][:, 0]
    near = np.array([np.linalg.norm(roots - guide[0], axis=1).min() < 0.006 for guide in after])
    facts["from combed"] = np.sort(distances(after[near], combed)).tolist()
    facts["from uncombed"] = np.sort(distances(after[near], grown_guides)).tolist()
    # The distance between neighbors, without any change.
    some = np.arange(len(combed)) % 2 == 0
    facts["between neighbors"] = np.sort(distances(combed[some & is_combed], combed[~some])).tolist()
    take_picture(OUT / "remeshed.png")


if __name__ == "__main__":
    take((comb,), pause=0.02)
