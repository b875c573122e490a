# SPDX-License-Identifier: GPL-3.0-or-later
"""Invariants of hair after any operation, and helpers that run operations so that these can be checked."""

import io
import sys

import bpy
import numpy as np

from hair_addon.blender.data.strands import curves as curve_data
from hair_addon.blender.host import running
from hair_addon.blender.live import events, handlers
from hair_addon.blender.materials import materials as hair_materials
from hair_addon.blender.render import hair_cache
from hair_addon.blender.render.viewport import viewport
from hair_addon.blender.ui import menus
from hair_addon.core.errors import HairError
from tests.support.reading import snapshot


class Echo(io.TextIOBase):
    """Standard error that records its text: Blender prints exceptions of handlers and callbacks, and continues."""

    def __init__(self, stream):
        self.stream, self.reported = stream, []

    def write(self, text):
        self.reported.append(text)
        return self.stream.write(text)


def ours(kind=None):
    """Return the guides and hair in the file, of one kind if given."""
    return [c for c in bpy.data.hair_curves if c.vellus.kind == kind or (kind is None and c.vellus.kind != "NONE")]


def objects(kind):
    """Return the names of objects of a type in the view layer."""
    return sorted(o.name for o in bpy.context.view_layer.objects if o.type == kind)


def chosen(names, number):
    return names[number % len(names)]


def activate(name):
    """Leave any mode and make one object active and selected."""
    if bpy.context.mode != "OBJECT" and bpy.context.object is not None:
        bpy.ops.object.mode_set(mode="OBJECT")
    for other in bpy.context.view_layer.objects:
        other.select_set(other.name == name)
    bpy.context.view_layer.objects.active = bpy.data.objects[name]


def orphans():
    return {c.name for c in ours() if c.users == 0}


def waits_elsewhere():
    """Whether hair waits for the end of an edit or paint mode in another scene, which undo and loading end, or follows
    guides on a surface that no scene shows together with the hair.
    """
    there = bpy.context.view_layer.objects
    stale = [one for one in ours() if one.vellus.is_stale and one.surface is not None]
    return any(one.surface.mode != "OBJECT" and one.surface.name not in there for one in stale) or any(
        {*curve_data.grown_on(one).users_scene}.isdisjoint(one.surface.users_scene) for one in stale
    )


def operate(operator, **arguments):
    """Call an operator with undo, as a window does. If it refuses, check the message and that nothing changed."""
    if not operator.poll():
        return
    before, orphans_before = snapshot(), orphans()
    try:
        operator("EXEC_DEFAULT", True, **arguments)
    except RuntimeError as refusal:
        assert "Traceback" not in str(refusal), refusal
        after = snapshot()
        after["materials"] = [name for name in after["materials"] if name in before["materials"] or not _is_own(name)]
        assert after == before, f"a refusal left something behind: {refusal}"
    assert orphans() <= orphans_before


def _is_own(name):
    """Whether a material was created for hair without material, which any update of the surface does."""
    material = bpy.data.materials[name]
    return hair_materials.is_hair_material(material) and any(material in {*c.materials} for c in ours("HAIR"))


def handlers_are_registered(is_on):
    """Check that handlers, draw handlers, timers and menu entries exist once if the add-on is on, otherwise never."""
    for name in dir(bpy.app.handlers):
        functions = getattr(bpy.app.handlers, name)
        if isinstance(functions, list):
            of_ours = [f for f in functions if getattr(f, "__module__", "").startswith("hair_addon")]
            assert of_ours == [f for known, f in handlers._HANDLERS if is_on and known is functions], name
    assert len(viewport._handles) == is_on
    assert running.job() is None and running._timer is None
    for menu, entry in menus._ENTRIES:
        assert getattr(bpy.types, menu).draw._draw_funcs.count(entry) == is_on


def changed(what):
    """Update the view layer and push an undo step after a script's changes, as after an operator."""
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message=what)


def no_exception_was_printed():
    reported = "".join(sys.stderr.reported)
    assert "Traceback" not in reported and "Error in bpy" not in reported, reported


def counts_match_settings():
    for datablock in ours():
        positions = curve_data.read_points(datablock)
        assert np.isfinite(positions).all(), datablock.name
        state = datablock.vellus
        if state.is_stale or state.status or not len(datablock.curves):
            continue
        if state.kind == "HAIR":
            assert len(datablock.curves) == state.hair.strand_count, datablock.name
        elif not curve_data.is_combed(datablock):
            assert len(datablock.curves) == state.guides.guide_count, datablock.name


def drawn_points_are_current():
    """Check that the points on the GPU, after an update, equal those that a first drawing would upload."""
    bpy.context.view_layer.update()
    present = {o.data for o in bpy.context.view_layer.objects if o.type == "CURVES"}
    # All points are read first, as hair on one surface is regenerated together.
    for datablock, kept in [(datablock, _drawn_points(datablock)) for datablock in ours() if datablock in present]:
        events.strands_computed(datablock)
        if datablock.surface is not None:
            events.surface_moved(datablock.surface)
        fresh = _drawn_points(datablock)
        is_alike = fresh is None or _is_blown_up(datablock, fresh) or _are_alike(kept, fresh)
        assert is_alike, _difference(datablock, kept, fresh)


def _is_blown_up(datablock, drawn):
    """Whether a surface has become a thousand times larger than it was with these roots, as does their rounding."""
    stored, offsets = curve_data.read_points(datablock), curve_data.curve_offsets(datablock)
    if not drawn.size or len(drawn) != len(offsets) - 1:
        return False
    return bool(np.abs(drawn[:, 0]).max() > 1e3 * np.abs(stored[offsets[:-1]]).max())


def _are_alike(kept, fresh):
    """Whether points are equal within the rounding of the surface's deformation, whose scale may have changed."""
    return kept.shape == fresh.shape and np.allclose(kept, fresh, rtol=0.0, atol=1e-6 * np.abs(fresh).max())


def _difference(datablock, kept, fresh):
    if kept.shape != fresh.shape:
        return f"{datablock.name}: {kept.shape} drawn, {fresh.shape} expected"
    odd, most = np.count_nonzero(~np.isfinite(kept)), np.abs(kept - fresh).max()
    return f"{datablock.name}: differences up to {most} of {np.abs(fresh).max()}, {odd} non-finite"


def _drawn_points(datablock):
    """Return the drawn points (S, P, 3) in local coordinates; None if drawing them raises `HairError`."""
    try:
        return hair_cache.strands_on_gpu(datablock).points
    except HairError:
        return None


def check_all():
    """Check all invariants."""
    no_exception_was_printed()
    handlers_are_registered(is_on=True)
    counts_match_settings()
    drawn_points_are_current()
