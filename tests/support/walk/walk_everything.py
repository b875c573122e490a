# SPDX-License-Identifier: GPL-3.0-or-later
"""The random walk of `walk_operations.py` with all operators and settings, on moving surfaces, with more invariants.

python -m tests.support.walk.walk_everything RUNS OPERATIONS SEED
"""

import gc
import random
from pathlib import Path

import bpy
import numpy as np
import warp as wp
from hypothesis import strategies as st
from hypothesis.stateful import invariant

from hair_addon.blender.data.strands import curves as curve_data
from hair_addon.blender.host import running
from hair_addon.blender.render import hair_cache
from hair_addon.blender.settings import animated, style_keys
from hair_addon.core.errors import HairError
from hair_addon.core.params import Settings
from tests.support import rooted
from tests.support.invariants import activate, changed, chosen, objects, operate, ours, waits_elsewhere
from tests.support.walk import any_values, walk_lengths
from tests.support.walk.walk_operations import Artist, main
from tests.support.walk.walk_steps import needs_room, pick, step

seeds = st.integers(0, 2**31)

_ROUNDING = 1e-6  # of roots
_MORE_BLOCKS = 40  # datablocks that come with the first use of a function: materials, node groups, images


class Everyone(Artist):
    """An artist who uses all operators and settings."""

    most_alive = None  # number of Python's objects after the first run of the process

    def law_of(self, name, values):
        return walk_lengths.law_of(name, values)

    @step(is_grid=st.booleans())
    @needs_room
    def add_surface(self, is_grid):
        """Add a surface on which hair can grow; `Artist` also adds unusable ones, on which most steps do nothing."""
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        if is_grid:
            bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4)
        else:
            bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
        changed("surface")

    @step(number=pick, amount=st.sampled_from([0.0, 0.1, 5.0]))
    def comb(self, number, amount):
        """Comb guides without moving roots, as brushes do."""
        seen = sorted({o.data.name for o in bpy.context.view_layer.objects if o.type == "CURVES"})
        if seen:
            curves = bpy.data.hair_curves[chosen(seen, number)]
            points, firsts = curve_data.read_points(curves), curve_data.curve_offsets(curves)[:-1]
            is_free = np.ones((len(points), 1), np.float32)
            is_free[firsts] = 0.0
            if len(points):
                curves.attributes["position"].data.foreach_set("vector", (points + amount * is_free).ravel())
                curves.update_tag()
                changed("comb")

    @step(number=pick, how=st.sampled_from(["move", "subdivide", "no UVs", "rename UVs"]))
    def change_mesh(self, number, how):
        self.change_mesh_as(number, how)

    def teardown(self):
        super().teardown()
        bpy.ops.wm.read_factory_settings(use_empty=True)
        alive = things_alive()
        most = Everyone.most_alive
        Everyone.most_alive = max(alive, most or 0)
        assert most is None or alive <= most + 200, f"{alive} things are held after a file was closed, {most} before"

    @step(number=pick, place=pick, seed=seeds)
    @needs_room
    def any_operator(self, number, place, seed):
        """Call any operator of the add-on with any settings, on any object with another one selected."""
        source, names = random.Random(seed), any_values.operators()
        name = chosen(names, number)
        there = objects("MESH") + objects("CURVES")
        if there:
            activate(chosen(there, place))
            bpy.data.objects[chosen(there, place // 7)].select_set(True)
        bpy.context.scene.frame_end = 3
        wanted = {}
        for declared in any_values.properties(name):
            is_needed = declared.identifier in any_values.NEEDED
            if is_needed or source.random() < 0.3:
                wanted[declared.identifier] = any_values.value(declared, source, Path(self.folder.name), odd=0.1)
        print(" ", name, wanted, flush=True)
        try:
            operate(getattr(bpy.ops.vellus, name), **wanted)
        except TypeError as error:  # a choice that exists only for other hair: Blender refuses the call
            assert "enum" in str(error), error
        bpy.context.view_layer.update()

    @step(number=pick, seed=seeds, is_odd=st.booleans())
    def any_setting(self, number, seed, is_odd):
        """Set any property of the add-on in any datablock."""
        source = random.Random(seed)
        owners = [*sorted(ours(), key=lambda c: c.name), *bpy.data.objects, *bpy.data.scenes]
        owner = chosen(owners, number)
        if owner.library is not None:
            return
        found = [(group, p) for group in any_values.groups(owner) for p in any_values.settings(group)]
        if found:
            group, declared = source.choice(found)
            value = any_values.value(declared, source, Path(self.folder.name), odd=0.3 if is_odd else 0.0)
            print(" ", owner.name, type(group).__name__, declared.identifier, repr(value), flush=True)
            setattr(group, declared.identifier, value)
            changed("setting")

    @step(number=pick, seed=seeds)
    def place_surface(self, number, seed):
        """Move, turn and scale a surface, unevenly and mirrored too."""
        if objects("MESH"):
            source, surface = random.Random(seed), bpy.data.objects[chosen(objects("MESH"), number)]
            surface.location = [source.uniform(-2.0, 2.0) for _ in range(3)]
            surface.rotation_euler = [source.uniform(-3.0, 3.0) for _ in range(3)]
            surface.scale = [source.choice([1.0, 1.0, -1.0, 0.5, 2.0, 0.01]) for _ in range(3)]
            changed("place")

    @step(number=pick, angle=st.floats(-3.0, 3.0), is_shown=st.booleans())
    def deform_surface(self, number, angle, is_shown):
        if objects("MESH"):
            surface = bpy.data.objects[chosen(objects("MESH"), number)]
            modifier = surface.modifiers.get("Twist") or surface.modifiers.new("Twist", "SIMPLE_DEFORM")
            modifier.angle, modifier.show_viewport = angle, is_shown
            changed("deform")

    @step(steps=st.integers(1, 3))
    def undo_and_redo(self, steps):
        """Check that undo and redo restore the state, outside Edit Mode: there Blender's steps hold only the mesh."""
        if bpy.context.mode.startswith("EDIT") or waits_elsewhere():
            return
        before = state()
        bpy.ops.ed.undo_push(message="here")
        for _ in range(steps):
            if not bpy.ops.ed.undo.poll():
                return
            bpy.ops.ed.undo()
        bpy.context.view_layer.update()
        for _ in range(steps):
            if not bpy.ops.ed.redo.poll():
                return
            bpy.ops.ed.redo()
        is_as(before)

    @step()
    def save_and_load_all(self):
        """Check that saving and loading keep the state, except unused datablocks."""
        before, is_due = state(), waits_elsewhere()
        self._save_and_load()
        if not is_due:
            is_as(before)

    @invariant()
    def more_is_well(self):
        """Check that roots are on their surface, strands have lengths, and the file does not grow."""
        roots_are_on_surfaces()
        assert len(bpy.data.all_ids) < 20 * (len(bpy.data.objects) + 4) + _MORE_BLOCKS
        assert running.job() is None


# All steps are equally frequent, except these.
for _number in range(2, 17):
    setattr(Everyone, f"any_operator_{_number}", Everyone.any_operator)
for _number in range(2, 9):
    setattr(Everyone, f"any_setting_{_number}", Everyone.any_setting)
for _number in range(2, 4):
    setattr(Everyone, f"undo_and_redo_{_number}", Everyone.undo_and_redo)


def state():
    """Return {name: state of hair} of all datablocks that are used by others than unused ones, after an update of each.

    Blender does not report data removed by scripts, such as guides of hair; undo and loading update everything.
    """
    for one in ours():
        one.update_tag()
    bpy.context.view_layer.update()
    return {one.name: _state_of(one) for one in ours() if _is_used(one)}


def _is_used(datablock):
    """Whether a datablock has a user that files keep: one without users is not written."""
    users = bpy.data.user_map(subset=[datablock]).get(datablock, set()) - {datablock}
    return any(not isinstance(user, bpy.types.Curves) or _is_used(user) for user in users)


def _state_of(datablock):
    points = curve_data.read_points(datablock)
    roots = {a.name: _values(a) for a in datablock.attributes if a.name.startswith("root_")}
    if "root_slide" in roots and not roots["root_slide"].any(where=abs(roots["root_slide"]) > _ROUNDING):
        del roots["root_slide"]  # is stored again where rounding leaves one, and else removed
    # Undo and loading bring animated settings to the values of the frame, which a script may have overwritten.
    animated_paths = animated._at(datablock, style_keys.keyed_paths(datablock)) if animated.are_keyed(datablock) else []
    keyed = {(group.path_from_id(), name) for group, name in animated_paths}
    values = {}
    for group in any_values.groups(datablock):
        for declared in any_values.settings(group):
            if (group.path_from_id(), declared.identifier) in keyed:
                continue
            values[f"{group.path_from_id()}.{declared.identifier}"] = any_values.plain(group, declared)
    counts = np.diff(curve_data.curve_offsets(datablock))
    # If a script removes the guides of hair, its status reports this after loading or undo.
    is_said = not keyed and (datablock.vellus.kind != "HAIR" or datablock.vellus.guide_curves is not None)
    # Blender reports no change of an image that no material shows: a sentence about it stays until another report.
    is_said = is_said and '"Painted"' not in datablock.vellus.status
    return points, counts, roots, values, datablock.vellus.status if is_said else ""


def _values(attribute):
    width = 3 if attribute.data_type == "FLOAT_VECTOR" else 1
    found = np.empty(len(attribute.data) * width, np.int32 if attribute.data_type == "INT" else np.float32)
    attribute.data.foreach_get("vector" if width == 3 else "value", found)
    return found


def is_as(before):
    """Assert that `state` has not changed, name by name, so that a failure shows the difference."""
    after = state()
    assert after.keys() == before.keys()
    for name, (points, counts, roots, values, status) in before.items():
        now = after[name]
        changed_values = {k: (v, now[3].get(k)) for k, v in values.items() if now[3].get(k) != v}
        assert changed_values == {}, (name, changed_values)
        assert bool(now[4]) == bool(status), (name, status, now[4])
        assert np.array_equal(now[1], counts), (name, len(counts), len(now[1]))
        assert np.array_equal(now[0], points), (name, float(abs(now[0] - points).max()))
        assert now[2].keys() == roots.keys(), (name, [*roots], [*now[2]])
        changed_roots = [k for k, v in roots.items() if not np.array_equal(now[2][k], v)]
        assert changed_roots == [], (name, changed_roots)


def roots_are_on_surfaces():
    """Check the roots of hair that is drawn, live and without errors."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for one in (o for o in bpy.context.view_layer.objects if o.type == "CURVES" and rooted.should_be_rooted(o)):
        try:
            strands = hair_cache.strands_on_gpu(one.data).points
        except HairError:
            continue
        assert np.isfinite(strands).all(), one.name
        away = rooted.far_root(one, strands, depsgraph)
        assert not away, away


def things_alive():
    """Return the number of our objects and of Warp's arrays in Python's memory."""
    gc.collect()
    kinds = [type(each) for each in gc.get_objects()]
    of_ours = [k for k in kinds if k is wp.array or str(getattr(k, "__module__", "")).startswith("hair_addon")]
    return sum(not issubclass(kind, Settings) for kind in of_ours)


if __name__ == "__main__":
    main(Everyone)
