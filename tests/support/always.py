# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds for hair after any operation, and how an operation is done so that it can be asked."""

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
    """Standard error that remembers: Blender prints what is raised in handlers and callbacks, and goes on."""

    def __init__(self, stream):
        self.stream, self.said = stream, []

    def write(self, text):
        self.said.append(text)
        return self.stream.write(text)


def ours(kind=None):
    """Curves of ours in the file."""
    return [c for c in bpy.data.hair_curves if c.vellus.kind == kind or (kind is None and c.vellus.kind != "NONE")]


def objects(kind):
    """Names of objects of a type in the view layer."""
    return sorted(o.name for o in bpy.context.view_layer.objects if o.type == kind)


def chosen(names, number):
    return names[number % len(names)]


def activate(name):
    """Leave any mode and select one object; whether it is there to be selected."""
    if bpy.context.mode != "OBJECT" and bpy.context.object is not None:
        bpy.ops.object.mode_set(mode="OBJECT")
    for other in bpy.context.view_layer.objects:
        other.select_set(other.name == name)
    bpy.context.view_layer.objects.active = bpy.data.objects[name]


def orphans():
    return {c.name for c in ours() if c.users == 0}


def operate(operator, **arguments):
    """Call an operator as a window does, with undo. A refusal is a sentence and leaves everything as it was."""
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
    """Whether a material is what hair gives itself where it has none, with any update of the surface."""
    material = bpy.data.materials[name]
    return hair_materials.is_hair_material(material) and any(material in {*c.materials} for c in ours("HAIR"))


def nothing_is_left_listening(is_on):
    """Handlers, draw handlers, timers and menu entries are there once while the add-on is on, and never else."""
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
    """Blender takes note of what a script changed, as after any operator."""
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message=what)


def nothing_was_raised():
    said = "".join(sys.stderr.said)
    assert "Traceback" not in said and "Error in bpy" not in said, said


def hair_is_what_its_settings_say():
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


def what_is_drawn_is_what_is_there():
    """What is kept on the GPU is what a first drawing would bring there, once what waits for an update has had it."""
    bpy.context.view_layer.update()
    present = {o.data for o in bpy.context.view_layer.objects if o.type == "CURVES"}
    # All that is kept is read first: what stands on one surface is made anew together.
    for datablock, kept in [(datablock, _drawn_points(datablock)) for datablock in ours() if datablock in present]:
        events.strands_made(datablock)
        if datablock.surface is not None:
            events.surface_moved(datablock.surface)
        fresh = _drawn_points(datablock)
        assert fresh is None or _are_alike(kept, fresh), _difference(datablock, kept, fresh)


def _are_alike(kept, fresh):
    """Equal but for the rounding of how a surface carries strands, whose scale may have changed since."""
    return kept.shape == fresh.shape and np.allclose(kept, fresh, rtol=0.0, atol=1e-6 * np.abs(fresh).max())


def _difference(datablock, kept, fresh):
    if kept.shape != fresh.shape:
        return f"{datablock.name}: {kept.shape} are drawn, {fresh.shape} are there"
    odd, most = np.count_nonzero(~np.isfinite(kept)), np.abs(kept - fresh).max()
    return f"{datablock.name}: up to {most} of {np.abs(fresh).max()} away, {odd} no numbers"


def _drawn_points(datablock):
    """(S, P, 3) in local coordinates; None where a sentence says why not."""
    try:
        return hair_cache.strands_on_gpu(datablock).points
    except HairError:
        return None


def all_is_well():
    """All of it."""
    nothing_was_raised()
    nothing_is_left_listening(is_on=True)
    hair_is_what_its_settings_say()
    what_is_drawn_is_what_is_there()
