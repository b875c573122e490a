# SPDX-License-Identifier: GPL-3.0-or-later
"""Descriptions of the channels, columns and rows of each table, for its file header."""

from .dual_scattering import QUANTITIES, SAMPLE_COUNT
from .lookup_tables import Settings

DUAL_TABLES = ("dual", "n_g", "n_g_trt")

_M = {"R": "M_R", "G": "M_TT", "B": "M_TRT"}
_RGB = {"R": "red", "G": "green", "B": "blue"}
_CHANNELS = {
    "n": {**{channel: f"N_TT {color}" for channel, color in _RGB.items()}, "A": "N_R"},
    "n_trt": {channel: f"N_TRT {color}" for channel, color in _RGB.items()},
    "n_res": {channel: f"N of the residual, {color}" for channel, color in _RGB.items()},
    "dual": _RGB,
    "n_g": {**{channel: f"N_TT {color}, half-circle mean" for channel, color in _RGB.items()}, "A": "that of N_R"},
    "n_g_trt": {channel: f"N_TRT {color}, half-circle mean" for channel, color in _RGB.items()},
}

_LONGITUDINAL_AXES = {
    "ANGLES": (
        "column k of W, left to right: theta_i = ((k + 0.5) / W - 0.5) pi, the inclination of the light",
        "row j of H, top to bottom: theta_o = ((j + 0.5) / H - 0.5) pi, the inclination of the viewer",
    ),
    "COSINES": (
        "column k of W, left to right: sin(theta_i) = 2 (k + 0.5) / W - 1, theta_i the inclination of the light",
        "row j of H, top to bottom: sin(theta_o) = 2 (j + 0.5) / H - 1, theta_o the inclination of the viewer",
    ),
}
_AZIMUTHAL_COLUMNS = {
    "ANGLES": "column k of W, left to right: phi / pi = (k + 0.5) / W, phi the azimuth between light and viewer; "
    "each texel is the mean over phi / pi from k / W to (k + 1) / W",
    "COSINES": "column k of W, left to right: (cos(phi) + 1) / 2 = (k + 0.5) / W, phi the azimuth between light and "
    "viewer; each texel is the mean over its cell of phi",
}
_AZIMUTHAL_ROWS = {
    "classic": "row j of H, top to bottom: cos(theta_d) = (j + 0.5) / H, theta_d = (theta_o - theta_i) / 2",
    "energy": "row j of H, top to bottom: cos(theta_o) = (j + 0.5) / H, theta_o the inclination of the viewer",
}
_DUAL_AXES = (
    "column k of W, left to right: theta_i = ((k + 0.5) / W - 0.5) pi, the inclination of the light",
    "rows, top to bottom: " + ", ".join(QUANTITIES) + " [Zinke08]; angles are radians of theta_h",
)


def tables_of(mode: str) -> tuple[str, ...]:
    """Return the names of one fiber's tables."""
    return ("m", "n", "n_trt", "n_res") if mode == "energy" else ("m", "n", "n_trt")


def channels(name: str, mode: str) -> dict[str, str]:
    """Return {channel: meaning} of a table."""
    if name == "m":
        return _M | {"A": "M of the residual" if mode == "energy" else "cos(theta_d)"}
    return _CHANNELS[name]


def shape(name: str, settings: Settings) -> tuple[int, int]:
    """Return (height, width) of a table."""
    if name == "dual":
        return len(QUANTITIES), SAMPLE_COUNT
    return settings.size, 1 if name == "n_res" else settings.size


def axes(name: str, settings: Settings) -> tuple[str, str]:
    """Return descriptions of the columns and rows of a table."""
    if name == "dual":
        return _DUAL_AXES
    if name == "m":
        return _LONGITUDINAL_AXES[settings.axes]
    columns = "the one column stands for every phi" if name == "n_res" else _AZIMUTHAL_COLUMNS[settings.axes]
    return columns, _AZIMUTHAL_ROWS[settings.mode]
