# SPDX-License-Identifier: GPL-3.0-or-later
"""Results that tests request repeatedly and that depend on arguments alone, computed once per process."""

import dataclasses
import hashlib
from functools import lru_cache

import numpy as np

from hair_addon.core.placement import cvt
from hair_addon.core.shading.tables import albedo, dual_scattering, lookup_tables

MOST_PLACEMENTS = 500  # of some hundred points each

_place, _placements = cvt.place, {}


def place(mesh, count, seed, iterations, *, progress=lambda part: None, **given):
    """Call `cvt.place`, or return its earlier result after the same reports of progress, which may stop it again."""
    key = _digest((mesh.vertices, mesh.triangles, mesh.smooth_vertices, count, seed, iterations, sorted(given.items())))
    if key not in _placements:
        told = []

        def tell(part):
            told.append(part)
            progress(part)

        found = _place(mesh, count, seed, iterations, progress=tell, **given)
        if len(_placements) >= MOST_PLACEMENTS:
            del _placements[next(iter(_placements))]
        _placements[key] = found, told
    else:
        for part in _placements[key][1]:
            progress(part)
    return _placements[key][0][:]


def _digest(value):
    """Return the SHA-1 of nested tuples, lists, dataclasses and arrays."""
    total = hashlib.sha1()

    def add(one):
        if isinstance(one, np.ndarray):
            total.update(f"{one.dtype}{one.shape}".encode() + np.ascontiguousarray(one).tobytes())
        elif dataclasses.is_dataclass(one):
            add([getattr(one, field.name) for field in dataclasses.fields(one)])
        elif isinstance(one, (list, tuple)):
            total.update(f"({len(one)}".encode())
            for part in one:
                add(part)
        else:
            total.update(f"{one!r},".encode())

    add(value)
    return total.digest()


# {(module, name): the function that is called instead}.
REMEMBERED = {
    (module, name): lru_cache(64)(getattr(module, name))
    for module, name in ((lookup_tables, "bake"), (dual_scattering, "bake"), (albedo, "azimuthal_moments"))
} | {(cvt, "place"): place}


def remember(patch):
    """Keep results from now on; patch: a `pytest.MonkeyPatch`."""
    for (module, name), remembered in REMEMBERED.items():
        patch.setattr(module, name, remembered)


def forget(patch):
    """Place roots anew, for tests of placing itself or of memory; patch: a `pytest.MonkeyPatch`."""
    patch.setattr(cvt, "place", _place)
