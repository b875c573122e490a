# SPDX-License-Identifier: GPL-3.0-or-later
"""Haircuts as lists of steps: what an artist presses, types and draws. `HAIRCUTS` has them by name.

The face of the sample's head looks to -Y, +X is its left, and the head is 0.25 m high. Hair grows in its vertex group
`scalp`.
"""

import numpy as np

from tests.desktop.haircuts.hands import (
    comb,
    cursor,
    curve,
    fields,
    lines,
    mirrored,
    press,
    rename,
    select,
    style,
    vary,
    view,
    weights,
)

LEFT, RIGHT, BACK, ABOVE = (1, 0, 0.1), (-1, 0, 0.1), (0, 1, 0.15), (0, -0.25, 1)
SIDE, FRONT = (1, 0, 0), (0, -1, 0.55)

PARTING = ((0.030, -0.140, 0.80), (0.030, -0.10, 0.84), (0.028, -0.06, 0.853), (0.02, -0.02, 0.85))
MIDDLE = ((0.0, -0.150, 0.79), (0.0, -0.10, 0.84), (0.0, -0.05, 0.853), (0.0, 0.0, 0.85), (0.0, 0.04, 0.82))


def grown(length, mask="scalp", **values):
    """A hair system on the head, where a vertex group is painted."""
    return (
        select("Head"),
        press("vellus.add_hair", density_group=mask),
        fields("guides", length=length, **values),
    )


def both_sides(*strokes, middle=0.0):
    """Strokes, and their mirror images about a parting."""
    return (*strokes, *(tuple((2.0 * middle - x, y, z) for x, y, z in stroke) for stroke in strokes))


# From a parting on the left, over the hairline of both temples and round the crown.
AWAY_FROM_PARTING = (
    ((0.022, -0.140, 0.80), (-0.03, -0.128, 0.815), (-0.068, -0.10, 0.785), (-0.085, -0.06, 0.75)),
    ((0.036, -0.138, 0.80), (0.060, -0.118, 0.80), (0.080, -0.08, 0.76), (0.085, -0.05, 0.745)),
    ((0.020, -0.08, 0.848), (-0.04, -0.07, 0.84), (-0.080, -0.04, 0.79)),
    ((0.036, -0.08, 0.846), (0.060, -0.06, 0.83), (0.082, -0.03, 0.78)),
    ((0.012, -0.01, 0.85), (-0.05, 0.01, 0.82), (-0.07, 0.03, 0.77)),
    ((0.024, -0.01, 0.85), (0.055, 0.01, 0.82), (0.07, 0.03, 0.77)),
)

# The same, with the hair in front of the right side swept to the back.
SWEPT = (
    ((0.022, -0.140, 0.80), (-0.02, -0.115, 0.828), (-0.065, -0.070, 0.805), (-0.084, -0.04, 0.76)),
    AWAY_FROM_PARTING[1],
    ((0.022, -0.09, 0.845), (-0.03, -0.065, 0.843), (-0.075, -0.025, 0.80)),
    *AWAY_FROM_PARTING[3:],
)

# In a layer, which keeps the combing when the guides or the mesh change.
OFF_THE_FACE = (
    press("vellus.add_layer"),
    view(0, -1, 0.1),
    comb(
        "Comb",
        0.035,
        *both_sides(
            ((0.0, -0.15, 0.76), (0.05, -0.15, 0.755), (0.115, -0.12, 0.745)),
            ((0.0, -0.15, 0.71), (0.05, -0.15, 0.71), (0.115, -0.12, 0.70)),
            ((0.0, -0.15, 0.66), (0.05, -0.15, 0.66), (0.105, -0.12, 0.655)),
        ),
    ),
    press("vellus.comb_guides"),
)

WAVY = (
    *grown(0.28, drape=False),
    view(*ABOVE),
    lines("vellus.draw_parting", PARTING),
    view(*FRONT),
    lines("vellus.draw_flow", *SWEPT),
    fields("guides", drape=True),
    *OFF_THE_FACE[:-1],
    comb(  # from the parting, which is not in the middle
        "Comb",
        0.035,
        ((0.03, -0.15, 0.79), (-0.04, -0.14, 0.79), (-0.10, -0.10, 0.765)),
        *[((0.03, -0.16, z), (-0.05, -0.15, z), (-0.12, -0.11, z - 0.01)) for z in (0.76, 0.725, 0.69, 0.655, 0.62)],
    ),
    OFF_THE_FACE[-1],
    style("WAVY"),
    press("vellus.apply_preset", preset="BROWN"),
)

# From the crown: forward to the brows, over the temples, and down at the sides and the back.
FROM_CROWN = (
    ((0.0, -0.004, 0.853), (0.0, -0.08, 0.848), (0.0, -0.142, 0.80)),
    *both_sides(
        ((0.004, -0.008, 0.853), (0.020, -0.085, 0.845), (0.026, -0.140, 0.80)),
        ((0.014, -0.022, 0.852), (0.037, -0.085, 0.838), (0.048, -0.126, 0.797)),
        ((0.022, -0.012, 0.85), (0.058, -0.07, 0.825), (0.072, -0.105, 0.775), (0.074, -0.10, 0.75)),
        ((0.006, 0.0, 0.853), (0.06, -0.03, 0.825), (0.085, -0.04, 0.77)),
    ),
)
BEHIND_CROWN = (
    ((0.0, 0.004, 0.85), (0.0, 0.05, 0.81), (0.0, 0.062, 0.76)),
    *both_sides(((0.006, 0.004, 0.85), (0.05, 0.035, 0.80), (0.062, 0.04, 0.75))),
)


# Around the fringe.
SECTION = both_sides(((0.012, -0.012, 0.853), (0.042, -0.08, 0.836), (0.058, -0.12, 0.788)))


def trimmed(**plane):
    """A cut of the selected head's guides by a plane, which is deleted afterward."""
    return (
        press("mesh.primitive_plane_add", **plane),
        select("Head"),
        press("vellus.trim_guides", cutter="Plane"),
        select("Plane"),
        press("object.delete", confirm=False),
    )


BOB = (
    *grown(0.24, drape=False),
    view(*FRONT),
    lines("vellus.draw_parting", *SECTION),
    lines("vellus.draw_flow", *FROM_CROWN),
    view(*BACK),
    lines("vellus.draw_flow", *BEHIND_CROWN),
    fields("guides", drape=True),
    *trimmed(size=0.13, location=(0.0, -0.19, 0.752)),  # the fringe
    *trimmed(size=0.6, location=(0.0, 0.0, 0.655)),
    select("Hair"),
    style("SLEEK"),
    press("vellus.apply_preset", preset="DARK_BROWN"),
)

# Weights of lengths from the top to the skin, sizes [m] of their brushes, and heights [m] of strokes around the head.
FADED = (
    (0.5, 0.026, (0.796,)),
    (0.25, 0.026, (0.774,)),
    (0.12, 0.026, (0.754,)),
    (0.05, 0.036, (0.726, 0.69, 0.655)),
)
SIDE_LEVELS = ((0.066, -0.120), (0.080, -0.07), (0.085, -0.02), (0.072, 0.03), (0.02, 0.06))  # (x, y) of a stroke [m]
CORNER_LEVELS = ((0.085, -0.03), (0.080, 0.01), (0.062, 0.04), (0.03, 0.06))
BACK_LEVELS = ((-0.075, 0.02), (-0.04, 0.05), (0.0, 0.06), (0.04, 0.05), (0.075, 0.02))


def faded(direction, places):
    """Paint bands of weights that are seen from a direction, each over the lower edge of the band above."""
    strokes = [
        weights(weight, size, [(*place, z) for row, z in enumerate(heights) for place in places[:: 1 - 2 * (row % 2)]])
        for weight, size, heights in FADED
    ]
    return (view(*direction), *strokes)


FADE = (
    *grown(0.035, drape=False, gravity=0.2, lift=0.75),
    view(*FRONT),
    lines(
        "vellus.draw_flow",
        ((0.0, 0.03, 0.83), (0.0, -0.05, 0.853), (0.0, -0.13, 0.815)),
        *both_sides(((0.04, 0.02, 0.825), (0.04, -0.05, 0.843), (0.03, -0.13, 0.81))),
        *both_sides(((0.075, -0.08, 0.78), (0.083, -0.06, 0.75), (0.082, -0.055, 0.72))),
    ),
    view(*BACK),
    lines(
        "vellus.draw_flow",
        ((0.0, 0.05, 0.81), (0.0, 0.065, 0.76), (0.0, 0.055, 0.70)),
        *both_sides(((0.055, 0.03, 0.80), (0.065, 0.035, 0.75), (0.06, 0.03, 0.70))),
    ),
    vary("strands.strand_length", kind="GROUP"),
    press("vellus.paint_map", setting="strands.strand_length"),
    mirrored(),
    *faded(LEFT, SIDE_LEVELS),
    *faded((0.7, 0.7, 0.1), CORNER_LEVELS),
    *faded(BACK, BACK_LEVELS),
    view(0, 1, -0.4),
    weights(0.05, 0.036, *[[(*place, z) for place in BACK_LEVELS] for z in (0.68, 0.655)]),
    press("object.vertex_group_smooth", group_select_mode="ACTIVE", factor=0.5, repeat=6),
    press("object.mode_set", mode="OBJECT"),
    select("Hair"),
    fields("hair", radius=5.0e-5),
    style("PIXIE"),
    fields("Lean", amount=0.1),
    fields("Clump", amount=0.0),
    press("vellus.apply_preset", preset="BLACK"),
)

# Short, fine hairs along the hairline, of a hair system of their own.
BABY_HAIR = (
    select("Head"),
    press("object.vertex_group_add"),
    press("paint.weight_paint_toggle"),
    mirrored(),
    view(*FRONT),
    weights(1.0, 0.008, ((0.0, -0.137, 0.804), (0.030, -0.131, 0.801), (0.055, -0.114, 0.790), (0.065, -0.102, 0.781))),
    view(1, -0.4, 0.1),
    weights(
        1.0, 0.008, ((0.065, -0.10, 0.780), (0.070, -0.080, 0.757), (0.072, -0.066, 0.741), (0.073, -0.036, 0.743))
    ),
    view(0.5, 1, -0.4),
    weights(1.0, 0.008, ((0.061, -0.018, 0.710), (0.051, -0.005, 0.695), (0.030, 0.016, 0.685), (0.0, 0.019, 0.684))),
    press("paint.weight_paint_toggle"),
    *grown(0.022, mask="Group", length_variation=0.5, drape=False, gravity=0.0, lift=0.25, tilt=0.25),
    view(*FRONT),
    lines(
        "vellus.draw_flow",
        ((0.0, -0.140, 0.795), (0.0, -0.110, 0.830)),
        *both_sides(
            ((0.040, -0.130, 0.790), (0.045, -0.10, 0.820)),
            ((0.070, -0.090, 0.760), (0.078, -0.06, 0.785)),
        ),
    ),
    view(*BACK),
    lines(
        "vellus.draw_flow",
        ((0.0, 0.02, 0.685), (0.0, 0.045, 0.73)),
        *both_sides(((0.05, 0.0, 0.70), (0.06, 0.02, 0.74))),
    ),
    fields("hair", strand_count=2500, radius=2.5e-5),
    press("vellus.add_style", style="FRIZZ"),
    fields("Frizz", amplitude=5.0e-4, wavelength=0.03),
)


def with_baby_hair(look):
    """Baby hair with a look, as a hair system of its own before the haircut."""
    return (*BABY_HAIR, press("vellus.apply_preset", preset=look), rename("Baby Hair"))


FLYAWAYS = (  # a few hairs that stand out
    press("vellus.add_style", style="FRIZZ"),
    fields("Frizz", amplitude=2.0e-4, wavelength=0.05, stray=0.02, stray_gain=12.0),
)

TAIL = ((0.0, 0.040, 0.795), (0.0, 0.062, 0.805), (0.0, 0.085, 0.785), (0.0, 0.090, 0.74), (0.0, 0.085, 0.60))

PONYTAIL = (
    *with_baby_hair("LIGHT_BROWN"),
    *grown(0.36, drape=False),
    view(*SIDE),
    curve("Tie", TAIL, depth="CURSOR"),
    select("Hair"),
    press("vellus.gather_guides", line="Tie", shape="PONYTAIL"),
    *FLYAWAYS,
    press("vellus.apply_preset", preset="LIGHT_BROWN"),
)

BUN = (
    *with_baby_hair("GINGER"),
    *grown(0.36, drape=False),
    view(*BACK),
    lines("vellus.draw_tie", ((0.0, 0.055, 0.80), (0.0, 0.055, 0.83))),
    select("Hair"),
    press("vellus.gather_guides", shape="BUN"),
    fields("hair", point_count=97),  # the coil bends without corners
    *FLYAWAYS,
    press("vellus.apply_preset", preset="GINGER"),
)

# From the skin behind the left ear.
OVER_SHOULDER = (
    *((0.050, 0.004, 0.705), (0.054, 0.008, 0.680), (0.058, 0.0, 0.655), (0.062, -0.03, 0.632)),
    *((0.068, -0.09, 0.600), (0.074, -0.125, 0.560), (0.089, -0.14, 0.460)),
)

BRAIDS = (
    *with_baby_hair("AUBURN"),
    *grown(0.36, drape=False, length_variation=0.0, guide_count=2000),
    view(*ABOVE),
    lines("vellus.draw_parting", MIDDLE, ((0.0, 0.03, 0.83), (0.0, 0.055, 0.80))),
    view(*BACK),
    lines("vellus.draw_parting", ((0.0, 0.04, 0.82), (0.0, 0.065, 0.76), (0.0, 0.05, 0.69), (0.0, 0.04, 0.66))),
    view(0, 1, 0),
    cursor(*OVER_SHOULDER[0]),
    view(1.0, 0.0, 0.16),  # so that the line goes outward on its way down
    curve("Ties", OVER_SHOULDER, depth="CURSOR", is_mirrored=True),
    select("Hair"),
    press("vellus.gather_guides", line="Ties", shape="BRAID", tail_radius=0.019, tie_radius=0.009),
    fields("hair", point_count=97),  # locks bend without corners
    *FLYAWAYS,
    press("vellus.apply_preset", preset="AUBURN"),
)


def row(aside, start, end):
    """Return places on the scalp, nearly a sphere, from one angle behind the top to another; aside: angle to a side."""
    angles = np.linspace(start, end, 20)
    narrow = aside * np.where(angles < 0.8, 1.0, 1.0 - 0.15 * (angles - 0.8))
    radius = 0.088 * (1.0 - 0.1 * aside**2)
    along = np.stack([np.sin(narrow), np.cos(narrow) * np.sin(angles), np.cos(narrow) * np.cos(angles)], axis=1)
    return np.array([0.0, -0.045, 0.755]) + radius * along


ASIDE = np.linspace(-0.98, 0.98, 8)  # from one side to the other
TO_CROWN = [row(aside, 0.55 * aside**2 - 1.1, 0.75) for aside in ASIDE]  # from the hairline
TO_NAPE = [row(aside, 0.75, 2.25) for aside in ASIDE]

CORNROWS = (
    *grown(0.26, drape=False, length_variation=0.0, guide_count=2000),
    view(0.0, -0.1, 1.0),
    lines("vellus.draw_tie", *TO_CROWN, use_stroke_endpoints=False),
    view(*BACK),
    lines("vellus.draw_tie", *TO_NAPE, use_stroke_endpoints=False),
    select("Head"),
    press("vellus.gather_guides", shape="CORNROWS", tie_radius=0.0065),
    fields("hair", point_count=97),
    *FLYAWAYS,
    press("vellus.apply_preset", preset="DARK_BROWN"),
)

# Paints the vertex group `Group`.
BEARD_AREA = (
    select("Head"),
    press("object.vertex_group_add"),
    press("paint.weight_paint_toggle"),
    mirrored(),
    view(1.0, -0.35, -0.1, middle=(0.0, -0.06, 0.68), distance=0.45),
    weights(
        1.0,
        0.013,
        ((0.07, -0.062, 0.715), (0.068, -0.070, 0.69), (0.062, -0.085, 0.665), (0.045, -0.115, 0.645)),
        ((0.066, -0.062, 0.68), (0.060, -0.075, 0.655), (0.045, -0.11, 0.632), (0.02, -0.135, 0.625)),
        ((0.066, -0.075, 0.695), (0.058, -0.095, 0.67), (0.045, -0.12, 0.655)),
        ((0.06, -0.075, 0.64), (0.045, -0.10, 0.622), (0.02, -0.12, 0.615)),
    ),
    view(0.0, -1.0, -0.1, middle=(0.0, -0.06, 0.68), distance=0.45),
    weights(
        1.0,
        0.010,
        ((0.0, -0.15, 0.622), (0.025, -0.14, 0.628), (0.045, -0.115, 0.642)),
        ((0.0, -0.15, 0.636), (0.025, -0.14, 0.638), (0.045, -0.115, 0.655)),
        ((0.033, -0.135, 0.65), (0.036, -0.13, 0.662)),
    ),
    weights(1.0, 0.005, ((0.0, -0.155, 0.677), (0.018, -0.15, 0.676), (0.033, -0.14, 0.668))),
)

BEARD = (
    *BEARD_AREA,
    press("paint.weight_paint_toggle"),
    *grown(0.022, mask="Group", gravity=0.6),
    fields("hair", radius=3.0e-5),
    style("BEARD"),
    press("vellus.apply_preset", preset="DARK_BROWN"),
)

_SEEN = {"middle": (0.0, 0.03, 0.18), "distance": 0.75}

_SIDE = (
    (
        *((0.02, -0.10, 0.325), (0.03, -0.06, 0.35), (0.03, -0.02, 0.31), (0.035, 0.02, 0.24)),
        *((0.05, 0.07, 0.20), (0.06, 0.13, 0.13), (0.05, 0.165, 0.07)),
    ),
    ((0.04, -0.10, 0.285), (0.055, -0.06, 0.270), (0.05, -0.03, 0.245)),
    ((0.04, -0.05, 0.24), (0.045, -0.055, 0.18), (0.04, -0.055, 0.12), (0.035, -0.06, 0.04)),
    ((0.05, -0.01, 0.20), (0.06, 0.03, 0.14), (0.08, 0.05, 0.08), (0.10, 0.05, 0.025)),
)

_CROWN = [  # between the ears, to the neck
    ((x, -0.085, 0.343), (x, -0.05, 0.352), (x, -0.01, 0.342), (x, 0.02, 0.315)) for x in (0.0, 0.012, -0.012)
]

_BELOW_TAIL = ((0.02, 0.17, 0.0), (0.08, 0.20, 0.0), (0.135, 0.17, 0.0), (0.155, 0.10, 0.0), (0.145, 0.03, 0.0))

CAT = (
    select("Head"),
    press("vellus.add_hair", density_group="fur", guide_count=2000),
    fields("guides", length=0.07, length_variation=0.08, tilt=0.05, gravity=0.0, lift=0.3),
    view(*LEFT, **_SEEN),
    lines("vellus.draw_flow", *_SIDE),
    view(*RIGHT, **_SEEN),
    lines("vellus.draw_flow", *[[(-x, y, z) for x, y, z in stroke] for stroke in _SIDE]),
    view(0.0, -1.0, 0.1, **_SEEN),
    lines(
        "vellus.draw_flow",
        ((0.0, -0.10, 0.315), (0.0, -0.09, 0.345)),
        ((0.0, -0.07, 0.25), (0.0, -0.065, 0.20), (0.0, -0.05, 0.15)),
    ),
    view(0.0, 0.5, 1.0, **_SEEN),
    lines("vellus.draw_flow", *_CROWN),
    view(0.2, 0.2, 1.0, **_SEEN),
    lines("vellus.draw_flow", ((0.05, 0.185, 0.05), (0.10, 0.19, 0.045), (0.14, 0.16, 0.045), (0.15, 0.05, 0.04))),
    vary("strands.strand_length", kind="GROUP"),
    press("vellus.paint_map", setting="strands.strand_length"),
    mirrored(),
    view(*LEFT, **_SEEN),
    weights(0.45, 0.030, ((0.05, -0.01, 0.34), (0.05, -0.02, 0.31), (0.05, -0.04, 0.27))),
    weights(
        0.15,
        0.020,
        ((0.04, -0.085, 0.28), (0.045, -0.07, 0.30), (0.045, -0.06, 0.335), (0.036, -0.04, 0.37)),
        ((0.036, -0.05, 0.10), (0.036, -0.06, 0.05), (0.036, -0.08, 0.015)),
        ((0.08, -0.035, 0.012), (0.09, 0.0, 0.012), (0.09, 0.05, 0.012)),
    ),
    view(0.0, -1.0, 0.1, **_SEEN),
    weights(
        0.15,
        0.022,
        ((0.0, -0.11, 0.285), (0.0, -0.10, 0.315), (0.0, -0.08, 0.35)),
        ((0.0, -0.10, 0.27), (0.03, -0.10, 0.285), (0.035, -0.09, 0.32), (0.038, -0.04, 0.37)),
        ((0.034, -0.05, 0.10), (0.034, -0.07, 0.015)),
        ((0.075, -0.03, 0.012), (0.09, 0.0, 0.012)),
    ),
    view(0.0, -0.3, 1.0, **_SEEN),
    weights(
        0.15,
        0.022,
        ((0.0, -0.09, 0.34), (0.0, -0.05, 0.352), (0.0, -0.01, 0.34)),
        ((0.0, -0.05, 0.35), (0.036, -0.03, 0.36)),
    ),
    view(0.0, 0.5, 1.0, **_SEEN),
    weights(0.15, 0.020, *_CROWN[:2]),
    view(0.0, 0.1, -1.0, **_SEEN),
    weights(0.15, 0.030, ((0.03, -0.08, 0.0), (0.04, 0.0, 0.0), (0.06, 0.06, 0.0), (0.03, 0.14, 0.0)), _BELOW_TAIL),
    press("object.mode_set", mode="OBJECT"),
    select("Hair"),
    style("FUR_LONG"),
    fields("Undercoat", random=0.15, undercoat=0.5),
    fields("Clump", size=0.006, amount=0.7, stray=0.0),
    fields("Frizz", amplitude=3.0e-4, stray=0.01),
    fields("hair", radius=8.0e-5),
    press("vellus.apply_preset", preset="GINGER"),
)

HAIRCUTS = {
    "wavy": WAVY,
    "bob": BOB,
    "fade": FADE,
    "bun": BUN,
    "ponytail": PONYTAIL,
    "braids": BRAIDS,
    "cornrows": CORNROWS,
    "beard": BEARD,
    "cat": CAT,
}
