# SPDX-License-Identifier: GPL-3.0-or-later
"""The visible difference between two pictures that are flipped back and forth: LDR-FLIP [Andersson20]."""

import numpy as np

PIXELS_PER_DEGREE = 67.0  # a 4K monitor 0.7 m wide at a distance of 0.7 m

_TO_XYZ = np.array(
    [[0.41238656, 0.35759149, 0.18045049], [0.21263682, 0.71518298, 0.0721802], [0.01933062, 0.11919716, 0.95037259]]
)
_WHITE = _TO_XYZ.sum(axis=1)
# Contrast sensitivity of the channels Y, Cx, Cz: two Gaussians (a, b) each, in degrees.
_CONTRAST = (((1.0, 0.0047),), ((1.0, 0.0053),), ((34.1, 0.04), (13.5, 0.025)))
_COLOR_EXPONENT, _COLOR_KNEE, _COLOR_KNEE_TO = 0.7, 0.4, 0.95
_FEATURE_WIDTH, _FEATURE_EXPONENT = 0.082, 0.5  # of edges and points, in degrees


def flip(reference: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return (H, W) errors between 0 and 1 of two (H, W, 3) pictures in sRGB display values between 0 and 1."""
    references, others = (_opponent(_linear(np.clip(one, 0.0, 1.0))) for one in (reference, other))
    color = _color_error(references, others)
    feature = _feature_error(references[..., 0], others[..., 0])
    return color ** (1.0 - feature)


def _linear(encoded):
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def _opponent(linear):
    """Return YCxCz of linear RGB."""
    x, y, z = np.moveaxis(linear @ _TO_XYZ.T / _WHITE, -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def _from_opponent(opponent):
    y = (opponent[..., 0] + 16.0) / 116.0
    normalized = np.stack([y + opponent[..., 1] / 500.0, y, y - opponent[..., 2] / 200.0], axis=-1)
    return (normalized * _WHITE) @ np.linalg.inv(_TO_XYZ).T


def _color_error(reference, other):
    seen = [_hunt(np.clip(_from_opponent(_filtered(one)), 0.0, 1.0)) for one in (reference, other)]
    error = _hyab(*seen) ** _COLOR_EXPONENT
    extremes = [_hunt(np.array(color, float)) for color in ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    most = _hyab(*extremes) ** _COLOR_EXPONENT
    knee = _COLOR_KNEE * most
    above = _COLOR_KNEE_TO + (error - knee) / (most - knee) * (1.0 - _COLOR_KNEE_TO)
    return np.where(error < knee, _COLOR_KNEE_TO / knee * error, above)


def _filtered(opponent):
    """Return the picture as the eye resolves it: each channel convolved with its contrast sensitivity."""
    channels = []
    for channel, gaussians in enumerate(_CONTRAST):
        widest = max(width for parts in _CONTRAST for _weight, width in parts)
        radius = int(np.ceil(3.0 * np.sqrt(widest / (2.0 * np.pi**2)) * PIXELS_PER_DEGREE))
        places = np.arange(-radius, radius + 1) / PIXELS_PER_DEGREE
        found, total = 0.0, 0.0
        for weight, width in gaussians:
            kernel = np.exp(-((np.pi * places) ** 2) / width)
            amplitude = weight * np.sqrt(np.pi / width)
            found = found + amplitude * _separable(opponent[..., channel], kernel, kernel)
            total += amplitude * kernel.sum() ** 2
        channels.append(found / total)
    return np.stack(channels, axis=-1)


def _separable(values, along, across):
    """Return values (H, W) convolved with odd kernels along rows and across them; the border is repeated."""
    return _convolved(_convolved(values.T, along).T, across)


def _convolved(values, kernel):
    """Return values (H, W) convolved with a kernel along the first axis."""
    radius, count = len(kernel) // 2, len(values)
    padded = np.pad(values, ((radius, radius), (0, 0)), mode="edge")
    found = np.zeros(values.shape)
    for step, weight in enumerate(kernel[::-1]):
        found += weight * padded[step : step + count]
    return found


def _hunt(linear):
    """Return L*a*b* with chroma in proportion to lightness, the Hunt effect."""
    relative = linear @ _TO_XYZ.T / _WHITE
    edge = 6.0 / 29.0
    bent = np.where(relative > edge**3, np.cbrt(relative), relative / (3.0 * edge**2) + 4.0 / 29.0)
    x, y, z = np.moveaxis(bent, -1, 0)
    lightness = 116.0 * y - 16.0
    return np.stack([lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)], axis=-1)


def _hyab(one, other):
    apart = one - other
    return np.abs(apart[..., 0]) + np.hypot(apart[..., 1], apart[..., 2])


def _feature_error(reference, other):
    deviation = 0.5 * _FEATURE_WIDTH * PIXELS_PER_DEGREE
    places = np.arange(-np.ceil(3.0 * deviation), np.ceil(3.0 * deviation) + 1.0)
    bell = np.exp(-(places**2) / (2.0 * deviation**2))
    sizes = []
    for kernel in (-places * bell, (places**2 / deviation**2 - 1.0) * bell):  # edges, points
        parts = np.where(kernel > 0.0, kernel / kernel[kernel > 0.0].sum(), kernel / -kernel[kernel < 0.0].sum())
        smooth = bell / bell.sum()
        size = []
        for luminance in (reference, other):
            lightness = (luminance + 16.0) / 116.0
            size.append(np.hypot(_separable(lightness, parts, smooth), _separable(lightness, smooth, parts)))
        sizes.append(np.abs(size[0] - size[1]))
    return np.clip(np.maximum(*sizes) / np.sqrt(2.0), 0.0, 1.0) ** _FEATURE_EXPONENT
