# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots of tables: tone-mapped, with labeled axes. They need no GPU."""

import blf
import imbuf
import numpy as np

from ...core.shading.tables.dual_scattering import QUANTITIES

_PANEL = 320  # pixels
_LEFT, _RIGHT, _TOP, _BOTTOM = 78, 22, 34, 52  # margins of a panel, for its labels
_BACKGROUND, _AXIS = 24, 150
_TEXT_SIZE = 14
_CURVES = np.array([[255, 90, 80], [90, 220, 100], [110, 150, 255]])

_HALF_TURN = ("-π/2", "0", "π/2")
_SINE = ("-1", "0", "1")
_PART = ("0", "0.5", "1")


def plot_tables(tables, dual):
    """`Tables` and `DualTables` → {name: ImBuf}, one plot per table."""
    settings = tables.settings
    view = "cos θo" if settings.mode == "energy" else "cos θd"
    is_cosines = settings.axes == "COSINES"
    m_axes = [(f"sin {angle}", _SINE) if is_cosines else (angle, _HALF_TURN) for angle in ("θi", "θo")]
    n_axes = [("cos φ", _SINE) if is_cosines else ("φ", ("0", "π/2", "π")), (view, _PART)]
    m_names = ("M_R", "M_TT", "M_TRT", "M of the residual" if settings.mode == "energy" else "cos θd")
    pictures = {"m": [_image(tables.m[..., i : i + 1], name, m_axes) for i, name in enumerate(m_names)]}
    for name, ending, n, n_trt in (
        ("n", "", tables.n, tables.n_trt),
        ("n_g", ", half-circle mean", dual.n_g, dual.n_g_trt),
    ):
        pictures[name] = [
            _image(n[..., :3], "N_TT" + ending, n_axes),
            _image(n[..., 3:], "N_R" + ending, n_axes),
        ]
        pictures[name + "_trt"] = [_image(n_trt, "N_TRT" + ending, n_axes)]
    if tables.n_res is not None:
        pictures["n_res"] = [_curves(tables.n_res[:, 0], "N of the residual", (view, _PART))]
    pictures["dual"] = [
        _curves(row, name, ("θi", _HALF_TURN)) for name, row in zip(QUANTITIES, dual.theta, strict=True)
    ]
    return {name: _beside(panels) for name, panels in pictures.items()}


class _Panel:
    """Pixels (H, W, 3) of one plot, top row first, and its labels."""

    def __init__(self, inside, title, x_axis, y_axis):
        height, width = _PANEL + _TOP + _BOTTOM, _PANEL + _LEFT + _RIGHT
        self.pixels = np.full((height, width, 3), _BACKGROUND, np.uint8)
        self.pixels[_TOP - 1 : _TOP + _PANEL + 1, _LEFT - 1 : _LEFT + _PANEL + 1] = _AXIS
        self.pixels[_TOP : _TOP + _PANEL, _LEFT : _LEFT + _PANEL] = inside
        self.text = [(title, _LEFT, _TOP - 12)]  # (text, x, y of the baseline), from the top left
        (x_label, x_ticks), (y_label, y_ticks) = x_axis, y_axis
        for part, tick in zip((0.0, 0.5, 1.0), x_ticks, strict=True):
            self.text.append((tick, _LEFT + part * _PANEL - 0.5 * _width(tick), _TOP + _PANEL + 18))
        for part, tick in zip((0.0, 0.5, 1.0), y_ticks, strict=True):
            self.text.append((tick, _LEFT - 8 - _width(tick), _TOP + part * _PANEL + 5))
        self.text.append((x_label, _LEFT + 0.5 * (_PANEL - _width(x_label)), _TOP + _PANEL + 40))
        self.text.append((y_label, 6, _TOP + 0.25 * _PANEL))


def _image(table, title, axes):
    """Image of a table (H, W, 1 or 3): square-root scale, white at the 99.9th percentile."""
    white = max(float(np.quantile(table, 0.999)), 1e-6)
    tones = 255.0 * np.sqrt(np.clip(table / white, 0.0, 1.0))
    rows, columns = ((np.arange(_PANEL) * count) // _PANEL for count in table.shape[:2])
    inside = np.broadcast_to(tones[rows][:, columns], (_PANEL, _PANEL, 3))
    return _Panel(inside, f"{title}   white = {white:.3g}", *axes)


def _curves(values, title, x_axis):
    """Plot values (W, 3) as one curve per channel."""
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    high = high if high > low else low + 1.0
    inside = np.full((_PANEL, _PANEL, 3), _BACKGROUND, np.uint8)
    columns = np.arange(_PANEL)
    for channel, color in enumerate(_CURVES):
        curve = np.interp((columns + 0.5) / _PANEL, (np.arange(len(values)) + 0.5) / len(values), values[:, channel])
        line = np.rint((high - curve) / (high - low) * (_PANEL - 1)).astype(int)
        before = np.concatenate([line[:1], line[:-1]])
        for column, first, last in zip(columns, np.minimum(line, before), np.maximum(line, before), strict=True):
            inside[first : last + 1, column] = color
    ticks = [f"{value:.3g}" for value in (high, 0.5 * (low + high), low)]
    return _Panel(inside, title, x_axis, ("", ticks))


def _width(words):
    blf.size(0, _TEXT_SIZE)
    return blf.dimensions(0, words)[0]


def _beside(panels, columns=5):
    """Panels → one ImBuf, at most `columns` per row."""
    height, width = panels[0].pixels.shape[:2]
    lines = -(-len(panels) // columns)
    picture = imbuf.new((width * min(len(panels), columns), height * lines))
    corners = [(width * (index % columns), height * (index // columns)) for index in range(len(panels))]
    canvas = np.full((*picture.size[::-1], 4), 255, np.uint8)
    canvas[..., :3] = _BACKGROUND
    for panel, (x, y) in zip(panels, corners, strict=True):
        canvas[y : y + height, x : x + width, :3] = panel.pixels
    with picture.with_buffer(write=True) as buffer:
        np.asarray(buffer)[...] = canvas[::-1]  # an ImBuf stores the bottom row first
    blf.size(0, _TEXT_SIZE)
    blf.color(0, 1.0, 1.0, 1.0, 1.0)
    with blf.bind_imbuf(0, picture):
        for panel, (x, y) in zip(panels, corners, strict=True):
            for words, left, base in panel.text:
                blf.position(0, x + left, picture.size[1] - y - base, 0.0)
                blf.draw_buffer(0, words)
    return picture
