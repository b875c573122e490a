# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines and dots in pictures: alone, and as plots with labeled axes, several side by side."""

import numpy as np

from blend_samples.sheets import picture_files

BACKGROUND, GRID, AXIS = 24, 44, 150
LEFT, RIGHT, TOP, BOTTOM = 62, 22, 40, 46  # pixels around a plot, for its labels
COLORS = ((255, 120, 90), (110, 210, 120), (110, 160, 255), (235, 200, 90))
REFERENCE = (150, 150, 150)
_FINER = 3  # pixels drawn for each that is shown, for smooth edges


class Canvas:
    """A picture of x and y between limits, drawn on in these coordinates; pixels wide and high."""

    def __init__(self, x_limits, y_limits, width, height):
        self._low, self._high = np.transpose([x_limits, y_limits]).astype(float)
        self.width, self.height = width, height
        self._image = np.full((_FINER * height, _FINER * width, 3), BACKGROUND, np.uint8)

    def place(self, point):
        """Return (x, y) pixels of a point, from the top left."""
        x, y = (np.asarray(point, float) - self._low) / (self._high - self._low)
        return x * self.width, (1.0 - y) * self.height

    def line(self, points, color, width=2.0):
        """Draw a line through points (N, 2)."""
        _stamp(self._image, _dense(self._fine(points)), color, 0.5 * _FINER * width)

    def dots(self, points, color, width=6.0):
        """Draw a dot at each of points (N, 2)."""
        _stamp(self._image, self._fine(points), color, 0.5 * _FINER * width)

    def area(self, is_inside, color):
        """Fill where is_inside(x, y) of arrays is true."""
        rows, columns = np.mgrid[: self._image.shape[0], : self._image.shape[1]] + 0.5
        part = np.stack([columns / self._image.shape[1], 1.0 - rows / self._image.shape[0]])
        x, y = self._low[:, None, None] + part * (self._high - self._low)[:, None, None]
        self._image[is_inside(x, y)] = color

    def pixels(self):
        """Return (height, width, 3) uint8."""
        shape = self.height, _FINER, self.width, _FINER, 3
        return np.round(self._image.reshape(shape).mean(axis=(1, 3))).astype(np.uint8)

    def _fine(self, points):
        part = (np.asarray(points, float)[:, :2] - self._low) / (self._high - self._low)
        return _FINER * np.stack([part[:, 0] * self.width, (1.0 - part[:, 1]) * self.height], axis=-1)


class Plot(Canvas):
    """A canvas with a title, axes and their ticks, and a legend of the labeled lines."""

    def __init__(self, title, x_limits, y_limits, ticks=((), ()), x_label="", size=(320, 320), legend=(0.62, 0.06)):
        """legend: its place, parts of the plot from its top left."""
        super().__init__(x_limits, y_limits, *size)
        self._title, self._ticks, self._x_label, self._legend_place = title, ticks, x_label, legend
        self._legend = []
        for value in ticks[0]:
            self.line([(value, y_limits[0]), (value, y_limits[1])], (GRID,) * 3, 1.0)
        for value in ticks[1]:
            self.line([(x_limits[0], value), (x_limits[1], value)], (GRID,) * 3, 1.0)

    def name(self, color, label):
        """Add a line to the legend."""
        self._legend.append((label, color))

    def drawn(self):
        """Return (pixels (H, W, 3) uint8, words of `picture_files.write`)."""
        pixels = np.full((TOP + self.height + BOTTOM, LEFT + self.width + RIGHT, 3), BACKGROUND, np.uint8)
        pixels[TOP - 1 : TOP + self.height + 1, LEFT - 1 : LEFT + self.width + 1] = AXIS
        pixels[TOP : TOP + self.height, LEFT : LEFT + self.width] = self.pixels()
        return pixels, [*self._labels(), *self._draw_legend(pixels)]

    def _labels(self):
        words = [(self._title, LEFT, TOP - 14)]
        for value in self._ticks[0]:
            column = self.place((value, 0.0))[0]
            words.append((f"{value:g}", LEFT + column - 4 * len(f"{value:g}"), TOP + self.height + 17))
        for value in self._ticks[1]:
            row = self.place((0.0, value))[1]
            words.append((f"{value:g}", LEFT - 10 - 8 * len(f"{value:g}"), TOP + row + 5))
        middle = LEFT + 0.5 * self.width - 4 * len(self._x_label)
        return [*words, (self._x_label, middle, TOP + self.height + 36)]

    def _draw_legend(self, pixels):
        words = []
        for place, (label, color) in enumerate(self._legend):
            left = LEFT + int(self._legend_place[0] * self.width)
            row = TOP + int(self._legend_place[1] * self.height) + 18 * place
            pixels[row - 5 : row - 1, left : left + 16] = color
            words.append((label, left + 24, row + 2))
        return words


def write(plots, path):
    """Write plots of one height side by side as a PNG."""
    pictures, words, left = [], [], 0
    for plot in plots:
        pixels, own = plot.drawn()
        pictures.append(pixels)
        words += [(text, column + left, base) for text, column, base in own]
        left += pixels.shape[1]
    picture_files.write(np.concatenate(pictures, axis=1), path, words)


def _dense(points):
    """Points on a polyline, half a pixel apart."""
    lengths = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    at = np.linspace(0.0, lengths[-1], int(2.0 * lengths[-1]) + 2)
    return np.stack([np.interp(at, lengths, points[:, axis]) for axis in (0, 1)], axis=-1)


def _stamp(image, points, color, radius):
    """Paint a disk at each of points (N, 2) in pixels."""
    reach = int(np.ceil(radius))
    offsets = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2), axis=-1).reshape(-1, 2)
    offsets = offsets[np.linalg.norm(offsets, axis=1) <= radius]
    painted = (np.floor(points)[:, None].astype(int) + offsets).reshape(-1, 2)
    height, width, _ = image.shape
    columns, rows = painted[((painted >= 0) & (painted < (width, height))).all(axis=1)].T
    image[rows, columns] = color
