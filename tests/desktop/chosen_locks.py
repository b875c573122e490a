# SPDX-License-Identifier: GPL-3.0-or-later
"""Locks around guides that are chosen by clicks in Edit Mode, and around others that are chosen in Sculpt Mode.

Run by a desktop Blender as steps.py says.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
from tests.desktop.haircuts import hands  # noqa: E402
from tests.desktop.haircuts.hands import fields, press, select  # noqa: E402
from tests.desktop.steps import OUT, ZIP, facts, take  # noqa: E402
from tests.desktop.window import (  # noqa: E402
    addon,
    curve_points,
    in_viewport,
    install,
    key,
    offscreen_light,
    places,
    refine_to,
    remove_objects,
    take_picture,
    viewport,
    wait,
    wait_for,
    window,
)

CLICKED = 5  # guides


def begin():
    """Grow hair on a ball."""
    install(ZIP)
    refine_to(2)
    bpy.context.preferences.system.use_region_overlap = False
    remove_objects()
    area, _region = viewport()
    area.spaces.active.overlay.show_extras = area.spaces.active.overlay.show_floor = False
    area.spaces.active.region_3d.view_distance = 4.5
    with in_viewport():
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=1.0)
        bpy.ops.vellus.add_hair("EXEC_DEFAULT", guide_count=40, length=0.5, strand_count=4000, radius=0.004)
    yield from wait(0.5)
    hands.begin()


def choose():
    """Click guides in Edit Mode, and save them as a selection that is used as centers."""
    for step in (
        select("Hair Guides"),
        press("object.mode_set", mode="EDIT"),
        press("curves.set_selection_domain", domain="CURVE"),
        press("curves.select_all", action="DESELECT"),
    ):
        yield from step()
    middles = guides()[:, 20]
    nearest = np.argsort(np.linalg.norm(middles - eye(), axis=1))
    chosen = [nearest[0]]
    for guide in nearest[1:24]:  # apart from each other, and not at the outline
        if len(chosen) < CLICKED and np.linalg.norm(middles[chosen] - middles[guide], axis=1).min() > 0.4:
            chosen.append(guide)
    for number, guide in enumerate(chosen):
        yield from click(places(middles[guide : guide + 1])[0], shift=number > 0)
    yield from save()
    take_picture(OUT / "chosen.png")
    facts["clicked"], facts["saved"] = sorted(map(int, chosen)), saved()
    for step in (
        press("object.mode_set", mode="OBJECT"),
        select("Hair"),
        press("vellus.add_style", style="CLUMP"),
        fields("Clump", levels=1, crossover=0.0, stray=0.0),
    ):
        yield from step()
    yield from wait(0.5)
    facts["automatic"] = len(np.unique(clumps()))
    before = offscreen_light(addon())
    yield from fields("Clump", centers="GUIDES", center_guides="Locks")()
    yield from wait(1.0)
    take_picture(OUT / "locks.png")
    facts["changed pixels"] = float((np.abs(offscreen_light(addon()) - before).max(axis=-1) > 0.02).mean())
    facts["chosen"] = locks()


def follow():
    """Choose all other guides in Sculpt Mode, save them under the same name, and undo this."""
    for step in (
        press("vellus.comb_guides"),
        press("curves.select_all", action="INVERT"),
        save,
    ):
        yield from step()
    facts["mode"] = bpy.context.mode
    yield from wait_for(lambda: len(np.unique(clumps())) > CLICKED)
    yield from wait(1.0)
    facts["others"] = locks()
    yield from key("Z", ctrl=True)
    yield from wait_for(lambda: len(np.unique(clumps())) == CLICKED)
    yield from wait(1.0)
    facts["undone"] = locks()


def save():
    """Choose Save Selection in the menu of the guide tools."""
    with in_viewport():
        bpy.ops.vellus.save_selection("EXEC_DEFAULT", True, name="Locks")
    yield from hands.settled()


def click(place, shift):
    """Click a place (x, y) of the window, with or without Shift."""
    at = {"x": int(place[0]), "y": int(place[1])}
    window().event_simulate(type="MOUSEMOVE", value="NOTHING", **at)
    yield
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(type="LEFTMOUSE", value=value, shift=shift, **at)
        yield
    yield from wait(0.3)


def eye():
    area, _region = viewport()
    return np.array(area.spaces.active.region_3d.view_matrix.inverted().translation)


def guides():
    """Return (G, P, 3) points."""
    return curve_points(hands.guides()).reshape(len(hands.guides().data.curves), -1, 3)


def saved():
    """Return the indices of the guides in the saved selection."""
    are_chosen = addon().data.strands.selection_sets.read_guides(hands.guides().data, "Locks")
    return np.flatnonzero(are_chosen).tolist()


def clumps():
    """Return the lock (S,) of each strand."""
    found = np.full(len(hands.hair().data.curves), -1, np.int32)
    stored = hands.hair().data.attributes.get("clump_index")
    if stored is not None:
        stored.data.foreach_get("value", found)
    return found


def locks():
    """Return facts about the locks.

    "at nearest": share of strands in the lock of the nearest chosen guide; "tips": median distance of tips from the tip
    of this guide, relative to the distance of the roots, of strands near the guide, whose directions are alike.
    """
    strands = curve_points(hands.hair()).reshape(len(hands.hair().data.curves), -1, 3)
    axes, its = guides()[saved()], clumps()
    apart = np.linalg.norm(strands[:, None, 0] - axes[:, 0], axis=2)
    nearest, distance = apart.argmin(axis=1), apart.min(axis=1)
    of_guides = {lock: int(np.bincount(nearest[its == lock]).argmax()) for lock in np.unique(its)}
    of_tips = np.linalg.norm(strands[:, -1] - axes[nearest, -1], axis=1) / distance
    return {
        "count": len(of_guides),
        "guides": len(set(of_guides.values())),
        "at nearest": float((np.array([of_guides[lock] for lock in its]) == nearest).mean()),
        "tips": float(np.median(of_tips[(distance > 0.02) & (distance < 0.3)])),
        "status": hands.hair().data.vellus.status,
    }


if __name__ == "__main__":
    take((begin, choose, follow), pause=0.02)
