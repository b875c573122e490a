# SPDX-License-Identifier: GPL-3.0-or-later
"""Lookup tables as OpenEXR files: half floats, with their settings and axes in the header.

The first line of a file is row 0 of its table. Files are encoded and decoded in memory, because OpenEXR reports neither
a full disk nor a truncated file as an error.
"""

import contextlib
import hashlib
import io
import json
import os
import stat
from dataclasses import asdict
from pathlib import Path

import numpy as np
import OpenEXR

from ..errors import HairError, cause_of
from ..params import declared, like
from ..shading.tables import table_axes
from ..shading.tables.dual_scattering import DualTables
from ..shading.tables.lookup_tables import MAX_SIZE, Settings, Tables, to_half
from .atomic_file import atomic_files

FORMAT_VERSION = 2

_MAX_BYTES = 64 * 2**20
_MAX_SETTINGS_LENGTH = 10_000
_MAGIC = b"\x76\x2f\x31\x01"
_PREFIX = "vellus."  # prefix of our header attributes


def write_tables(folder: str | Path, tables: Tables, version: str) -> list[Path]:
    """Write `Tables` as m.exr, n.exr, n_trt.exr and, if there is a residual, n_res.exr to a folder, created if missing.

    Returns their paths. All are on disk before the first is moved to its place. version: of the project, for the
    header. Raises `HairError` if the folder cannot be written.
    """
    names = table_axes.tables_of(tables.settings.mode)
    return _write_set(folder, {name: getattr(tables, name) for name in names}, tables.settings, version)


def write_dual_tables(folder: str | Path, dual: DualTables, version: str) -> list[Path]:
    """Write `DualTables` as dual.exr, n_g.exr and n_g_trt.exr, like `write_tables`."""
    arrays = {"dual": dual.theta, "n_g": dual.n_g, "n_g_trt": dual.n_g_trt}
    return _write_set(folder, arrays, dual.settings, version)


def read_tables(folder: str | Path) -> Tables:
    """Return `Tables`, with their settings, from a folder of `write_tables`.

    Raises `HairError` if a file is missing, damaged, foreign, or from another bake.
    """
    settings = _settings_of_folder(folder, "n")
    arrays = _read_set(folder, table_axes.tables_of(settings.mode), settings)
    return Tables(**arrays, settings=settings)


def read_dual_tables(folder: str | Path) -> DualTables:
    """Return `DualTables` from a folder of `write_dual_tables`. Raises `HairError` like `read_tables`."""
    settings = _settings_of_folder(folder, "dual")
    arrays = _read_set(folder, table_axes.DUAL_TABLES, settings)
    return DualTables(arrays["dual"], arrays["n_g"], arrays["n_g_trt"], settings)


def _write_set(folder, arrays, settings, version):
    folder = Path(folder)
    files = {}
    for name, array in arrays.items():
        half = to_half(array)
        channels = table_axes.channels(name, settings.mode)
        files[folder / f"{name}.exr"] = _encode(half, channels, _table_header(name, half, settings, version))
    with atomic_files(files) as partials:
        for partial, data in zip(partials, files.values(), strict=True):
            partial.write_bytes(data)
    return list(files)


def _settings_of_folder(folder, name):
    """Return the settings in the header of a table; name: of a table with the same channels in both modes."""
    image = _Image(Path(folder) / f"{name}.exr", table_axes.channels(name, "classic"))
    return _settings_from_header(image, name)


def _read_set(folder, names, settings):
    arrays = {}
    for name in names:
        image = _Image(Path(folder) / f"{name}.exr", table_axes.channels(name, settings.mode))
        if _settings_from_header(image, name) != settings:
            raise HairError(f"{image.path} and the tables beside it come from different bakes. Bake the tables again.")
        image.demand_size(table_axes.shape(name, settings))
        half = image.pixels()
        if image.header.get(_PREFIX + "sha256") != _digest(half, image.header[_PREFIX + "settings"]):
            raise HairError(f"{image.path} was changed after it was baked. Bake the tables again.")
        arrays[name] = half.astype(np.float32)
    return arrays


# Headers.


def _table_header(name, half, settings, version):
    x_axis, y_axis = table_axes.axes(name, settings)
    channels = table_axes.channels(name, settings.mode)
    exact = json.dumps(asdict(settings))
    header = {
        "table": name,
        "format": FORMAT_VERSION,
        "version": version,
        "xAxis": x_axis,
        "yAxis": y_axis,
        "channelMeaning": "; ".join(f"{channel}: {meaning}" for channel, meaning in channels.items()),
        "settings": exact,
        "sha256": _digest(half, exact),
    }
    for key, default, _ in declared(Settings):  # in single precision, for readability
        value = getattr(settings, key)
        header["settings." + key] = tuple(map(float, value)) if isinstance(default, tuple) else type(default)(value)
    return {_PREFIX + key: value for key, value in header.items()}


def _digest(half, settings_text):
    """Return a digest that detects damaged or edited texels and settings; OpenEXR may not report damage."""
    return hashlib.sha256(settings_text.encode() + np.ascontiguousarray(half, "<f2").tobytes()).hexdigest()


def _settings_from_header(image, name):
    foreign = HairError(f"{image.path} is not the table {name} of this version of Vellus. Bake the tables again.")
    header = image.header
    text = header.get(_PREFIX + "settings")
    if (
        header.get(_PREFIX + "table") != name
        or header.get(_PREFIX + "format") != FORMAT_VERSION
        or not isinstance(text, str)
        or len(text) > _MAX_SETTINGS_LENGTH
    ):
        raise foreign
    defaults = {key: default for key, default, _ in declared(Settings)}
    try:
        values = json.loads(text)
        if values.keys() != defaults.keys():
            raise foreign
        values = {key: like(default, values[key]) for key, default in defaults.items()}
    except (AttributeError, TypeError, ValueError, OverflowError, RecursionError) as error:
        raise foreign from error
    try:
        return Settings(**values)
    except (HairError, OverflowError) as error:
        raise HairError(f"{image.path} contains invalid settings: {error} Bake the tables again.") from error


# Writing.


def _encode(half, channels, header):
    # If Blender links OpenEXR as a shared library, as Debian's does, this library's functions override the functions of
    # the wheel, whose version differs: compression would print errors for every block, although the file is valid.
    attributes = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.NO_COMPRESSION, **header}
    planes = {name: np.ascontiguousarray(half[..., index]) for index, name in enumerate(channels)}
    stream = io.BytesIO()
    OpenEXR.File(attributes, planes).write(stream)
    return stream.getvalue()


# Reading.


class _Image:
    """An EXR file of one plain image with the requested channels."""

    def __init__(self, path, channels):
        self.path = Path(path)
        self.channels = list(channels)
        self._data = self._read_bytes()
        part_count, self.header, _ = self._parse(header_only=True)
        if part_count != 1:
            self._refuse(f"contains {part_count} images, not one")
        if self.header.get("type") != OpenEXR.scanlineimage:
            self._refuse("contains tiles or deep data, not a plain image")
        found = self.header["channels"]
        if found != dict.fromkeys(self.channels, (1, 1)):
            self._refuse(f"has the channels {', '.join(sorted(found))}, not {', '.join(self.channels)}")
        self.demand_size(None)

    def demand_size(self, size):
        """Raise `HairError` unless (height, width) is `size`, or at most `MAX_SIZE` if `size` is None."""
        (left, top), (right, bottom) = self.header["dataWindow"]
        height, width = int(bottom) - int(top) + 1, int(right) - int(left) + 1
        if max(height, width) > MAX_SIZE:
            self._refuse(f"is {width} x {height} texels, not at most {MAX_SIZE} x {MAX_SIZE}")
        if size is not None and (height, width) != tuple(size):
            self._refuse(f"is {width} x {height} texels, not {size[1]} x {size[0]}")

    def pixels(self):
        """Return (H, W, C) float16, all finite. Raises `HairError`."""
        _, _, planes = self._parse(header_only=False)
        planes = [planes[name].pixels for name in self.channels]
        if any(plane.dtype != np.float16 for plane in planes):
            self._refuse("does not contain half floats")
        half = np.stack(planes, axis=-1)
        if not np.isfinite(half).all():
            self._refuse("contains non-finite values")
        return half

    def _read_bytes(self):
        """Return the bytes of a plain file of limited size with the magic number of EXR."""
        try:
            # O_NONBLOCK: opening a pipe without a writer would block.
            flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
            with open(self.path, "rb", opener=lambda path, _flags: os.open(path, flags)) as file:
                status = os.fstat(file.fileno())
                if not stat.S_ISREG(status.st_mode):
                    self._refuse("is not a file")
                if status.st_size > _MAX_BYTES:
                    self._refuse("is larger than any table (64 MB)")
                if file.read(len(_MAGIC)) != _MAGIC:
                    self._refuse("is not an EXR file")
                return _MAGIC + file.read(_MAX_BYTES)
        except (OSError, ValueError) as error:
            raise HairError(f"Cannot read {self.path}: {cause_of(error)}. Bake the tables again.") from error

    def _parse(self, header_only):
        """Return (part count, header, {channel: Channel}) of the first part; header["channels"] is {name: sampling}."""
        try:
            with _size_limit():
                file = OpenEXR.File(io.BytesIO(self._data), separate_channels=True, header_only=header_only)
            # If pixels cannot be decoded, OpenEXR only warns on the console and returns no parts.
            if not file.parts:
                self._refuse("is truncated or damaged")
            header = file.header()
            header["channels"] = {each.name: (each.xSampling, each.ySampling) for each in header["channels"]}
            return len(file.parts), header, file.channels()
        except (RuntimeError, ValueError, TypeError, OverflowError) as error:
            raise HairError(f"{self.path} is damaged. Bake the tables again.") from error

    def _refuse(self, what):
        raise HairError(f"{self.path} {what}. Bake the tables again.")


@contextlib.contextmanager
def _size_limit():
    """Limit OpenEXR's images to `MAX_SIZE`; the process-wide limit is restored afterwards."""
    image, tile = OpenEXR.getMaxImageSize(), OpenEXR.getMaxTileSize()
    OpenEXR.setMaxImageSize(MAX_SIZE, MAX_SIZE)
    OpenEXR.setMaxTileSize(MAX_SIZE, MAX_SIZE)
    try:
        yield
    finally:
        OpenEXR.setMaxImageSize(*image)
        OpenEXR.setMaxTileSize(*tile)
