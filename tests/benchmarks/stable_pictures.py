# SPDX-License-Identifier: GPL-3.0-or-later
"""Flicker of hair in viewports during motion, on the sample head: differences between frames.

Each movement begins at rest. It is drawn in three ways: with one pass a frame, with one pass that is mixed with the
frame before, as a viewport does, and with all passes, as at rest. The figures are display levels of 255 where hair is:
the 99th percentile of a pixel's change between frames, for the three ways; the largest change; the 99th percentile of
the change of means of 12 × 12 pixels, which show flicker that single pixels hide; the distance of the means of the
moving picture and of one pass from the mean of the resting picture, over all frames and in the worst frame; and the
99th percentile of the moving picture's distance from the resting picture.

.venv/bin/python tests/benchmarks/stable_pictures.py --strands 10000 --size 240 180
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

import bpy
import gpu
import numpy as np
import warp as wp
from mathutils import Matrix

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import hair_addon
from blend_samples.dynamics import dynamics_scene
from blend_samples.heads import head
from hair_addon import api
from hair_addon.blender.data import scene
from hair_addon.blender.gpu import display_transform
from hair_addon.blender.render import drawn_scene, offscreen
from hair_addon.blender.render.viewport import hair_picture, view_film

BEHIND = 0.05  # scene-linear gray behind the hair
BLOCK = 12  # pixels along each side of a block


class Movement:
    """A movement that changes the scene of the sample head in each frame."""

    is_of_camera = False  # whether nothing else moves

    def __init__(self):
        self.camera = bpy.context.scene.camera
        self.start = self.camera.matrix_world.copy()

    def end(self):
        """Restore the scene."""
        self.camera.matrix_world = self.start


class Orbit(Movement):
    """The camera moves around the head by a quarter of a degree per frame."""

    is_of_camera = True

    def step(self, frame):
        turn = Matrix.Rotation(np.radians(0.25 * frame), 4, "Z")
        self.camera.matrix_world = turn @ self.start


class Sway(Orbit):
    """The camera moves back and forth around the head by two degrees per frame."""

    def step(self, frame):
        super().step(8 * frame)


class Zoom(Orbit):
    """The camera moves away from the head, from 1 to 50 times the distance in 120 frames."""

    def step(self, frame):
        middle = Matrix.Translation(head.LOOK_AT)
        away = Matrix.Translation((middle.inverted() @ self.start).translation * (50.0 ** (frame / 120.0) - 1.0))
        self.camera.matrix_world = away @ self.start


class Turntable(Movement):
    """The head turns by a quarter of a degree per frame."""

    def step(self, frame):
        bpy.data.objects["Head"].rotation_euler.z = np.radians(0.25 * frame)

    def end(self):
        self.step(0)


class MovingLight(Movement):
    """The key light moves around the head by two degrees per frame."""

    def __init__(self):
        super().__init__()
        self.light = bpy.data.objects["Key"]
        self.place = self.light.matrix_world.copy()

    def step(self, frame):
        self.light.matrix_world = Matrix.Rotation(np.radians(2.0 * frame), 4, "Z") @ self.place

    def end(self):
        self.light.matrix_world = self.place


class FastLight(MovingLight):
    """The key light moves around the head by ten degrees per frame, so that it lights from behind within a few
    frames.
    """

    def step(self, frame):
        super().step(5 * frame)


class Dimmer(MovingLight):
    """The key light becomes brighter by a tenth per frame."""

    def __init__(self):
        super().__init__()
        self.energy = self.light.data.energy

    def step(self, frame):
        self.light.data.energy = self.energy * 1.1**frame

    def end(self):
        self.light.data.energy = self.energy


class Combing(Movement):
    """Guides in front move to the side, by 1 mm per frame at their tips."""

    def __init__(self):
        super().__init__()
        self.guides = bpy.data.objects["Guides"].data
        points = np.empty((len(self.guides.points), 3), np.float32)
        self.guides.attributes["position"].data.foreach_get("vector", points.ravel())
        self.points = points

    def step(self, frame):
        strands = self.points.reshape(len(self.guides.curves), -1, 3).copy()
        along = np.linspace(0.0, 1.0, strands.shape[1]) ** 2
        strands[strands[:, 0, 1] < 0.0, :, 0] += np.float32(0.001 * frame) * along.astype(np.float32)
        self.guides.attributes["position"].data.foreach_set("vector", strands.ravel())
        self.guides.update_tag()

    def end(self):
        self.step(0)


class StyleSlider(Movement):
    """The radius of curls grows by a tenth of a millimeter per frame."""

    def __init__(self):
        super().__init__()
        self.hair = bpy.data.objects["Hair"].data
        api.set_styles(self.hair, [api.Clump(size=0.02, amount=0.6), api.Curl(radius=0.003, pitch=0.04)])

    def step(self, frame):
        self.hair.vellus.styles[1].curl.radius = 0.003 + 1e-4 * frame

    def end(self):
        api.set_styles(self.hair, [])


class Playback(Movement):
    """Baked guides on a head that turns to and fro by three degrees once per second."""

    def __init__(self):
        super().__init__()
        self.head, guides = bpy.data.objects["Head"], bpy.data.objects["Guides"]
        bpy.context.scene.render.fps = dynamics_scene.RATE
        api.set_dynamics(guides, simulates=True, bend_stiffness=dynamics_scene.STIFFNESS)
        dynamics_scene.turn(self.head, 2, dynamics_scene.shaking(degrees=3.0, rate=1.0), dynamics_scene.RATE)
        self.folder = tempfile.TemporaryDirectory()
        dynamics_scene.bake(guides, dynamics_scene.RATE, self.folder.name)
        self.guides = guides

    def step(self, frame):
        bpy.context.scene.frame_set(dynamics_scene.FIRST + frame)

    def end(self):
        self.step(0)
        api.set_dynamics(self.guides, simulates=False)
        self.head.animation_data_clear()
        self.folder.cleanup()


_OF_ALL = (Orbit, Sway, Zoom, Turntable, MovingLight, FastLight, Dimmer, Combing, StyleSlider, Playback)
MOVEMENTS = {one.__name__: one for one in _OF_ALL}


class HairFrames:
    """Pictures of hair alone, as viewports lay them over Blender's drawing."""

    def __init__(self, size, per_side, rests):
        self._picture = hair_picture.HairPicture(size, per_side)
        self._rests = rests

    def moved(self, drawn, camera):
        """Return (H, W, 3) scene-linear light of the first pass after a movement."""
        self._picture.restart(is_moved=True)
        self._picture.add_pass(drawn, *camera)
        return _over_grey(self._picture.read_shown())

    def alone(self, drawn, camera):
        """Return the same without the earlier frames."""
        self._picture.restart()
        self._picture.add_pass(drawn, *camera)
        return _over_grey(self._picture.read())

    def rested(self, drawn, camera):
        """Return the same for a picture at rest."""
        self._picture.restart()
        _finish(self._picture, drawn, camera, self._rests)
        return _over_grey(self._picture.read())


class FilmFrames:
    """Pictures of hair and surfaces, as in Rendered shading."""

    def __init__(self, size, per_side, rests):
        self._film = view_film.ViewFilm(size, per_side, False)
        self._rests = rests

    def moved(self, drawn, camera):
        """Return (H, W, 3) scene-linear light of the first pass after a movement."""
        self._film.restart(is_moved=True)
        self._film.add_pass(drawn, *camera)
        return self._film.read_shown()[..., :3]

    def alone(self, drawn, camera):
        """Return the same without the earlier frames."""
        self._film.restart()
        self._film.add_pass(drawn, *camera)
        return self._film.read()[..., :3]

    def rested(self, drawn, camera):
        """Return the same for a picture at rest."""
        self._film.restart()
        _finish(self._film, drawn, camera, self._rests)
        return self._film.read()[..., :3]


KINDS = {"hair": HairFrames, "film": FilmFrames}


def _finish(picture, drawn, camera, times):
    """Draw passes until a picture is fine, and then `times` - 1 as many again."""
    count = 0
    while not picture.is_fine:
        picture.add_pass(drawn, *camera)
        count += 1
    for _ in range((times - 1) * count):
        picture.add_pass(drawn, *camera)


def _over_grey(light):
    return light[..., :3] + (1.0 - light[..., 3:]) * BEHIND


def levels(light):
    """Convert scene-linear light to display values of the scene's view transform, from 0 to 255."""
    transform = display_transform.DisplayTransform.of(bpy.context.scene)
    shown = display_transform.apply(transform, light.reshape(-1, 3).astype(np.float32))
    return 255.0 * np.clip(shown, 0.0, 1.0).reshape(light.shape)


def measure(movement, kind, options):
    """Return (alone, moved, rested): scene-linear light of the frames after warm-up."""
    sides = (options.per_side, options.per_side, options.rest_per_side or options.per_side)
    moving, alone, resting = (KINDS[kind](tuple(options.size), side, options.rests) for side in sides)
    found, drawn = ([], [], []), None
    for frame in range(options.frames):
        movement.step(options.first + frame)
        bpy.context.view_layer.update()
        depsgraph = bpy.context.evaluated_depsgraph_get()
        if drawn is None or not movement.is_of_camera:
            drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph)
        camera = scene.read_camera(bpy.context.scene, depsgraph, *options.size)
        moved = moving.moved(drawn, camera) if frame else moving.rested(drawn, camera)
        if frame >= options.warm_up:
            for of, light in zip(found, (alone.alone(drawn, camera), moved), strict=False):
                of.append(light)
            found[2].append(resting.rested(drawn, camera))
    movement.end()
    bpy.context.view_layer.update()
    return found


def report(name, kind, alone, moved, rested):
    """Print a row of figures."""
    single, shown, still = (np.stack([levels(light) for light in of]) for of in (alone, moved, rested))
    is_hair = np.abs(still - levels(np.full((1, 1, 3), BEHIND))).max(axis=-1) > 2.0
    is_hair = is_hair[1:] | is_hair[:-1]
    changes = [np.abs(np.diff(of, axis=0)).max(axis=-1)[is_hair] for of in (single, shown, still)]
    of_blocks = [_of_blocks(of, is_hair) for of in (single, shown, still)]
    errors = np.abs(shown - still).max(axis=-1)[1:][is_hair]
    steps = [np.quantile(of, 0.99) for of in changes]
    print(
        f"{kind:5}{name:12} change alone {steps[0]:6.2f}, with history {steps[1]:6.2f}, at rest {steps[2]:6.2f}, "
        f"ratio {steps[1] / steps[2]:5.2f}; most {' '.join(f'{of.max():6.1f}' for of in changes)}; "
        f"blocks {' '.join(f'{of:5.2f}' for of in of_blocks)}; "
        f"mean {_of_means(moved, rested)}, alone {_of_means(alone, rested)}; "
        f"error {np.quantile(errors, 0.99):6.2f}",
        flush=True,
    )


def _of_blocks(pictures, is_hair):
    """Return the 99th percentile of the change of block means, for blocks with hair in a quarter of their pixels."""
    height, width = (length // BLOCK * BLOCK for length in pictures.shape[1:3])

    def means(of):
        blocks = of[:, :height, :width].reshape(len(of), height // BLOCK, BLOCK, width // BLOCK, BLOCK, -1)
        return blocks.mean(axis=(2, 4))

    counted = means(is_hair.astype(float))[..., 0] > 0.25
    return np.quantile(np.abs(np.diff(means(pictures), axis=0)).max(axis=-1)[counted], 0.99) if counted.any() else 0.0


def _of_means(light, rested):
    frames = [np.mean(one) / np.mean(still) - 1.0 for one, still in zip(light, rested, strict=True)]
    return f"{np.mean(light) / np.mean(rested) - 1.0:+7.2%} (worst {max(frames, key=abs):+7.2%})"


def main():
    """Print a row for each movement."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strands", type=int, default=10_000)
    parser.add_argument("--size", type=int, nargs=2, default=[240, 180], metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--per-side", type=int, default=1, help="samples along each side of a pixel")
    parser.add_argument("--frames", type=int, default=12)
    parser.add_argument("--first", type=int, default=0, help="step of the first frame")
    parser.add_argument("--rest-per-side", type=int, help="the same of pictures at rest")
    parser.add_argument("--rests", type=int, default=1, help="pictures at rest have so many times their passes")
    parser.add_argument("--look", help="a preset, with dual scattering, in place of the sample head's")
    parser.add_argument("--warm-up", type=int, default=8, help="frames that are not counted")
    parser.add_argument("--movements", nargs="+", choices=MOVEMENTS, default=list(MOVEMENTS))
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--out", type=Path, help="folder for the last frame of each, alone, with history, at rest")
    options = parser.parse_args()
    hair_addon.register()
    gpu.init()
    wp.config.log_level = wp.LOG_WARNING
    head.grow(head.build(), strand_count=options.strands)
    head.light()
    if options.look is not None:
        api.shade(bpy.data.objects["Hair"].data, options.look, mode="energy")
        bpy.context.view_layer.update()
    for name in options.movements:
        for kind in options.kinds:
            alone, moved, rested = measure(MOVEMENTS[name](), kind, options)
            report(name, kind, alone, moved, rested)
            if options.out is not None:
                pair = np.concatenate([alone[-1], moved[-1], rested[-1]], axis=1)
                pixels = np.concatenate([pair, np.ones((*pair.shape[:2], 1))], axis=-1).astype(np.float32)
                offscreen.write_picture(pixels, options.out / f"{name}_{kind}.png", bpy.context.scene)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    # Blender's module may crash while it is torn down after drawing.
    os._exit(0)
