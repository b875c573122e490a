# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's pictures of dynamics, some values of each setting.

`python blend_samples/dynamics/dynamics_setting_pictures.py bend_stiffness` draws one of them, without a name all.

Writes docs/manual/dynamics_SETTING.png: a strand at successive moments, the last one bright, as it was combed in red.
Strands are simulated as arrays; no scene is needed.
"""

import argparse
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import bpy  # noqa: F401  blf, which writes words, comes with it
import numpy as np
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from blend_samples.sheets import line_plot, picture_files
from hair_addon.core.dynamics.air import ForceField
from hair_addon.core.dynamics.rod.rotations import IDENTITY
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.dynamics.root_motion import RootPose
from hair_addon.core.dynamics.simulation import Obstacle, Simulation, World

OUT = Path(__file__).resolve().parents[2] / "docs" / "manual"
WIDTH, HEIGHT, CAPTION = 160, 200, 24  # pixels of a picture, and of the words above it
RATE = 48  # frames per second
GROOM_COLOR, DIM, BRIGHT, SOLID_COLOR = (170, 70, 60), 60, (240, 225, 200), (62, 74, 88)
POINTS = 41


def still(_time):
    """Return a root that stays."""
    return np.zeros(3)


@dataclass(frozen=True)
class Experiment:
    """Strands, what acts on them, and how they are seen.

    grooms: (G, P, 3) [m]; moments [s] that are drawn, the last one bright; limits: left, bottom and height [m] of the
    picture; base: settings that all pictures share; root: way [m] of the roots by time [s]; solid: mesh and function of
    (x, y) in the picture that it fills.
    """

    grooms: np.ndarray
    moments: tuple[float, ...]
    limits: tuple[float, float, float]
    base: dict
    root: Callable[[float], np.ndarray] = still
    fields: tuple[ForceField, ...] = ()
    solid: tuple | None = None
    slant: float = 0.5 * math.pi  # [radians] of the picture's plane, which is upright
    is_trace: bool = False  # the height of the tip by time in place of strands


def straight(length, direction, root=(0.0, 0.0, 0.0)):
    """Return (1, P, 3): a straight strand."""
    along = np.linspace(0.0, length, POINTS)[:, None]
    return (np.array(root) + along * np.array(direction) / np.linalg.norm(direction))[None]


def curl(length=0.15, turns=5, radius=0.012):
    """Return (1, P, 3): a curl that hangs."""
    along = np.linspace(0.0, length, POINTS)
    angle, wide = 2.0 * np.pi * turns * along / length, radius * np.minimum(1.0, 12.0 * along / length)
    return np.stack([wide * np.sin(angle), wide * (1.0 - np.cos(angle)), -along], axis=-1)[None]


def ball(radius, center):
    """Return (vertices, triangles, function (x, y) that tells whether a place of the picture is in the sphere)."""
    rows, columns = 24, 48
    polar, around = np.meshgrid(np.linspace(0.0, np.pi, rows + 1), np.linspace(0.0, 2.0 * np.pi, columns + 1)[:-1])
    sphere = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1)
    index = np.arange(columns * (rows + 1)).reshape(columns, rows + 1)
    a, b, c, d = index[:, :-1], np.roll(index, -1, axis=0)[:, :-1], np.roll(index, -1, axis=0)[:, 1:], index[:, 1:]
    triangles = np.concatenate([np.stack([a, d, c], -1)[:, 1:], np.stack([a, c, b], -1)[:, :-1]], axis=1)
    vertices = radius * sphere.reshape(-1, 3) + center
    return vertices, _wound_outwards(vertices, triangles.reshape(-1, 3), center), _in_disk(radius, center)


def _wound_outwards(vertices, triangles, center):
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    is_inward = np.sum(normals * (corners.mean(axis=1) - center), axis=1) < 0.0
    return np.where(is_inward[:, None], triangles[:, ::-1], triangles).astype(np.int32)


def _in_disk(radius, center):
    return lambda x, y: np.hypot(x - center[0], y - center[2]) < radius


def slope(angle):
    """Return a square that rises along Y under the strands, and None as it fills the whole picture."""
    rise = math.tan(angle)
    corners = np.array([[x, y, y * rise] for x, y in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))])
    return corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32), None


SLOPE = math.radians(40.0)
OFF_SLOPE = 0.0015 * np.array([0.0, -math.sin(SLOPE), math.cos(SLOPE)])

FALL = (0.0, 0.06, 0.12, 0.2, 4.0)
LEVEL = straight(0.14, (1.0, 0.0, 0.0))
SAGGING = Experiment(LEVEL, FALL, (-0.012, -0.155, 0.20), {"sag_free": False})
HANGING = straight(0.16, (0.0, 0.0, -1.0))
WIND = (ForceField("WIND", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.5, shape="POINT"),)
WINDY = Experiment(HANGING, (0.0, 0.1, 0.2, 0.3, 4.0), (-0.02, -0.175, 0.2), {}, fields=WIND)
SOFT = {"sag_free": False, "bend_stiffness": 1.0}
ON_SLOPE = Experiment(
    straight(0.13, (1.0, 0.0, 0.0)) + OFF_SLOPE,
    (0.0, 0.1, 0.2, 0.3, 4.0),
    (-0.012, -0.135, 0.18),
    SOFT,
    solid=slope(SLOPE),
    slant=SLOPE,
)
OVER_BALL = Experiment(
    straight(0.15, (0.9, 0.0, 0.35), (-0.04, 0.0, 0.01)),
    (0.0, 0.08, 0.16, 4.0),
    (-0.05, -0.125, 0.22),
    {"sag_free": False, "bend_stiffness": 2.0},
    solid=ball(0.035, np.array([0.015, 0.0, -0.035])),
)


def sideways(time):
    """Return the way of a root that is carried to the right by 8 cm in a third of a second."""
    part = float(np.clip(3.0 * time, 0.0, 1.0))
    return np.array([0.08 * part**2 * (3.0 - 2.0 * part), 0.0, 0.0])


CARRIED = Experiment(HANGING, (0.0, 0.125, 0.21, 0.29, 0.375), (-0.02, -0.175, 0.2), {}, root=sideways)
COIL = Experiment(
    curl(), (0.0, 4.0), (-0.11, -0.275, 0.29), {"sag_free": False, "bend_stiffness": 3.0, "vertex_count": 61}
)
HEAVY = Experiment(HANGING, (0.0, 4.0), (-0.09, -0.21, 0.22), {"sag_free": False, "weight": 10.0})
# Thin air and small steps barely slow hair down, so damping alone does.
UNBRAKED = {"sag_free": False, "air_drag": 0.05, "substeps": 24}
SWINGING = Experiment(straight(0.1, (1.0, 0.0, 0.0)), (0.0, 1.5), (0.0, -0.05, 0.06), UNBRAKED, is_trace=True)

# Setting: (words of the captions, values, experiment).
PICTURES = {
    "bend_stiffness": ("Stiffness {}", (1.0, 8.0, 100.0), SAGGING),
    "twist_stiffness": ("Twist {}", (0.02, 0.2, 1.0), COIL),
    "stretch_stiffness": ("Stretch {}", (1.0, 0.0001, 0.00001), HEAVY),
    "tip_stiffness": ("Tip {}", (0.0, 1.0, 4.0), SAGGING),
    "damping": ("Damping {} s", (0.0, 0.01, 0.05), SWINGING),
    "weight": ("Weight {}", (0.5, 1.0, 4.0), SAGGING),
    "wetness": ("Wetness {}", (0.0, 0.5, 1.0), SAGGING),
    "gravity": ("Gravity {}", (-1.0, 0.0, 1.0), replace(SAGGING, limits=(-0.012, -0.1, 0.20))),
    "air_drag": ("Drag {}", (0.3, 1.0, 3.0), WINDY),
    "force_fields": ("Fields {}", (0.0, 1.0, 2.0), WINDY),
    "inertia": ("Inertia {}", (0.0, 0.5, 1.0), CARRIED),
    "hold": ("Hold {}", (0.0, 50.0, 500.0), replace(WINDY, base={"air_drag": 2.0})),
    "hold_tip": ("Tip hold {}", (0.0, 0.3, 1.0), replace(WINDY, base={"air_drag": 2.0, "hold": 300.0})),
    "sag_free": ("Sag-Free {}", (False, True), SAGGING),
    "pinned": ("Pinned {}", (0.0, 0.4, 0.8), replace(WINDY, base={"air_drag": 2.0})),
    "collision_distance": ("Distance {} mm", (0.001, 0.008, 0.02), OVER_BALL),
    "friction": ("Friction {}", (0.0, 0.3, 1.0), ON_SLOPE),
}
_ALONE = {"hair_friction": 0.0, "hair_pressure": 0.0}  # a strand that has no others beside it


def main():
    """Draw the requested pictures, all by default."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="settings such as bend_stiffness; all by default")
    parser.add_argument("--out", type=Path, default=OUT)
    given = parser.parse_args()
    wp.config.log_level = wp.LOG_WARNING
    given.out.mkdir(parents=True, exist_ok=True)
    for name in given.names or PICTURES:
        draw(name, *PICTURES[name], given.out.resolve() / f"dynamics_{name}.png")


def draw(setting, caption, values, experiment, path):
    """Write the pictures of values of a setting side by side, each with its caption."""
    pictures, words = [], []
    for place, value in enumerate(values):
        found = moments_of(experiment, replace(DynamicsSettings(), **_ALONE | experiment.base | {setting: value}))
        pictures += [np.full((CAPTION, WIDTH, 3), line_plot.BACKGROUND, np.uint8), drawn(experiment, found)]
        words.append((caption.format(_written(setting, value)), WIDTH * place + 8, 17))
    columns = [np.concatenate(pictures[i : i + 2]) for i in range(0, len(pictures), 2)]
    picture_files.write(np.concatenate(columns, axis=1), path, words)


def _written(setting, value):
    """Return a value as its picture's caption has it."""
    if isinstance(value, bool):
        return "on" if value else "off"
    shown = 1e3 * value if setting == "collision_distance" else value
    return f"{shown:.5f}".rstrip("0").rstrip(".")


def moments_of(experiment, settings):
    """Return [(G, P, 3)] of the moments of an experiment; of all frames where the tip is traced."""
    grooms = np.asarray(experiment.grooms, float)
    turns = np.tile(IDENTITY, (len(grooms), 1))
    obstacles = ()
    if experiment.solid is not None:
        vertices, triangles, _fills = experiment.solid
        obstacles = (Obstacle("Solid", vertices, triangles, settings.friction, settings.collision_distance),)
    world = World(obstacles=obstacles, fields=experiment.fields)

    def pose(time):
        return RootPose(grooms[:, 0] + experiment.root(time), turns)

    simulation = Simulation(grooms, settings, pose(0.0), world, "cpu")
    frames = [grooms]
    for frame in range(1, round(experiment.moments[-1] * RATE) + 1):
        simulation.advance(pose(frame / RATE), replace(world, time=frame / RATE), 1.0 / RATE)
        frames.append(simulation.points())
    return frames if experiment.is_trace else [frames[round(time * RATE)] for time in experiment.moments]


def drawn(experiment, found):
    """Return (HEIGHT, WIDTH, 3) uint8: the strands of successive moments."""
    left, bottom, height = experiment.limits
    up = (0.0, math.cos(experiment.slant), math.sin(experiment.slant))
    view = np.array([(1.0, 0.0, 0.0), up]).T
    if experiment.is_trace:
        return _traced(experiment, np.array([points[0, -1, 2] for points in found]))
    canvas = line_plot.Canvas((left, left + height * WIDTH / HEIGHT), (bottom, bottom + height), WIDTH, HEIGHT)
    if experiment.solid is not None:
        fills = experiment.solid[2]
        canvas.area(fills or (lambda x, y: np.isfinite(x)), SOLID_COLOR)
    for place, strands in enumerate(found):
        part = place / (len(found) - 1)
        is_last = place == len(found) - 1
        grey = round(DIM + 70 * part)
        color = BRIGHT if is_last else GROOM_COLOR if place == 0 else (grey, grey, grey)
        for points in strands:
            canvas.line(points @ view, color, 2.6 if is_last else 1.8)
        if place in (0, len(found) - 1):
            canvas.dots(strands[:, 0] @ view, (200, 200, 200), 6.0)
    return canvas.pixels()


def _traced(experiment, heights):
    _left, bottom, height = experiment.limits
    canvas = line_plot.Canvas((0.0, experiment.moments[-1]), (bottom, bottom + height), WIDTH, HEIGHT)
    times = np.arange(len(heights)) / RATE
    canvas.line([(0.0, heights[-1]), (times[-1], heights[-1])], (line_plot.GRID,) * 3, 1.0)
    canvas.line(np.stack([times, heights], axis=-1), BRIGHT)
    return canvas.pixels()


if __name__ == "__main__":
    main()
