# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading of USD stages: validated opening, drawn curves and their transforms over time."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ....core.errors import HairError

_MOST_NAMED = 3  # files in a sentence


@dataclass(frozen=True)
class Found:
    """Drawn curves prims, and numbers of omitted ones: invisible, proxies, scattered by point instancers."""

    prims: list
    invisible: int
    proxies: int
    scattered: int

    def notes(self, path: Path) -> Iterator[HairError]:
        """Notes on omitted prims."""
        for count, why in (
            (self.invisible, "are invisible"),
            (self.proxies, "are proxies"),
            (self.scattered, "are scattered by a point instancer"),
        ):
            if count:
                yield HairError(f"{path}: {count} curves objects {why} and left out.")


@contextmanager
def errors_named(path: Path):
    """Convert USD errors to `HairError`."""
    bpy.utils.expose_bundled_modules()
    from pxr import Tf

    try:
        yield
    except Tf.ErrorException as error:
        raise HairError(f"{path} cannot be read: {_cause_of(error)}.") from error


def time_code(time: float | None):
    """Return a `Usd.TimeCode`, the earliest for None."""
    from pxr import Usd

    return Usd.TimeCode.EarliestTime() if time is None else Usd.TimeCode(time)


def opened(path: Path):
    """Open a file as a `Usd.Stage`, bypassing USD's cache. Raises `HairError`, also if referenced files are missing."""
    with errors_named(path):
        from pxr import Usd

        stage = Usd.Stage.Open(str(path))
        stage.Reload()  # another stage in this process may hold an older version of the file
        missing = _missing(stage)
    if missing:
        named = ", ".join(missing[:_MOST_NAMED]) + ("…" if len(missing) > _MOST_NAMED else "")
        raise HairError(f"{path} refers to {named}, which cannot be found: restore it or correct the reference.")
    return stage


def _cause_of(error):
    """Return the first USD error, without its source location."""
    text = str(error)
    line = re.search(r":(\d+):\d+: parse error", text)
    if line is not None:
        return f"it is not valid in line {line[1]}"
    causes = re.findall(r": '(.*?)'\s*$", text, re.MULTILINE | re.DOTALL)
    if not causes:
        return "it is damaged"
    return " ".join(re.sub(r",? while reading @[^@]*@", "", causes[0]).split()).rstrip(".")


def _missing(stage):
    """Return the names of referenced files, and of prims in them, that are missing."""
    found = []
    for error in stage.GetCompositionErrors():
        named = re.search(r"@([^@]*)@(<[^>]*>)?", str(error))
        name = str(error) if named is None else Path(named[1]).name + (named[2] or "")
        if name not in found:
            found.append(name)
    return found


def curves_of(stage, time) -> Found:
    """Return the `Found` of a stage at a time, including instances."""
    from pxr import Usd, UsdGeom

    prims, invisible, proxies, instanced = [], 0, 0, 0
    walk = iter(Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
    prototypes = _prototypes(stage)
    for prim in walk:
        if not prim.IsA(UsdGeom.Curves):
            continue
        shown = UsdGeom.Imageable(prim)
        if any(prim.GetPath().HasPrefix(root) for root in prototypes):
            instanced += 1
        elif shown.ComputeVisibility(time) == UsdGeom.Tokens.invisible:
            invisible += 1
        elif shown.ComputePurpose() == UsdGeom.Tokens.proxy:
            proxies += 1
        else:
            prims.append(prim)
    return Found(prims, invisible, proxies, instanced)


def _prototypes(stage):
    """Paths of point instancer prototypes, which are not drawn in place."""
    from pxr import Usd, UsdGeom

    walk = Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate))
    instancers = [UsdGeom.PointInstancer(prim) for prim in walk if prim.IsA(UsdGeom.PointInstancer)]
    return [path for one in instancers for path in (*one.GetPrototypesRel().GetForwardedTargets(), one.GetPath())]


def times_of(prim, attributes, within: tuple[float, float] | None) -> list[float]:
    """Return sorted times, in time codes, of the samples of a prim's attributes and of all its transforms.

    within: the file's first and last time, which limit the result; the first is included if anything moves. None if the
    file states none.
    """
    from pxr import UsdGeom

    times = {time for attribute in attributes for time in attribute.GetTimeSamples()}
    above = prim
    while above and not above.IsPseudoRoot():
        place = UsdGeom.Xformable(above)
        if place:
            times.update(place.GetTimeSamples())
            if place.GetResetXformStack():
                break
        above = above.GetParent()
    if within is not None and len(times) > 1:
        times = {time for time in times if within[0] <= time <= within[1]} | {within[0]}
    return sorted(times)


def matrix_of(prim, time) -> np.ndarray:
    """Return the matrix (4, 4) float64 from local to stage coordinates."""
    from pxr import UsdGeom

    return np.array(UsdGeom.Imageable(prim).ComputeLocalToWorldTransform(time)).T  # USD's have rows of vectors


def array_of(value) -> np.ndarray | None:
    """Return a USD value as an array, empty if it is None; None if it is not an array or is damaged."""
    try:
        values = np.asarray([] if value is None else value)
    except (ValueError, OverflowError):  # an array whose size is negative
        return None
    return values if values.ndim else None


def values_at(attribute, time) -> np.ndarray | None:
    """Return an attribute's value at a time as `array_of` does."""
    return array_of(attribute.Get(time))


def primvar(prim, name: str, time):
    """Return the values of a primvar with its indices applied; None if it has no values."""
    from pxr import UsdGeom

    found = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    return found.ComputeFlattened(time) if found and found.HasValue() else None


def is_skinned(prim) -> bool:
    """Whether a skeleton deforms a prim."""
    from pxr import UsdSkel

    bound = UsdSkel.BindingAPI(prim)
    return bool(bound.GetInheritedSkeleton()) and bool(bound.GetJointIndicesPrimvar().HasAuthoredValue())
