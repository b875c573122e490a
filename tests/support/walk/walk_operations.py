# SPDX-License-Identifier: GPL-3.0-or-later
"""Random walk: random operations on hair, with invariants checked after each.

    python -m tests.support.walk.walk_operations RUNS OPERATIONS SEED

It runs in a separate process, so that a crash of Blender is a failure and not the end of the tests. The same arguments
give the same walk; a failed run prints the command that repeats it.
"""

import contextlib
import faulthandler
import math
import sys
import tempfile
from pathlib import Path

import bpy
import gpu
import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, get_state_machine_test, invariant

import hair_addon
from hair_addon.blender.data.strands import curves as curve_data
from hair_addon.blender.render import offscreen
from hair_addon.core.errors import HairError
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from tests.support import invariants
from tests.support.invariants import (
    activate,
    changed,
    chosen,
    handlers_are_registered,
    objects,
    operate,
    ours,
    waits_elsewhere,
)
from tests.support.scenes import shrink_shadows
from tests.support.walk.walk_painting import PaintingSteps
from tests.support.walk.walk_steps import needs_room, odd_numbers, pick, step
from tests.support.walk.walk_styles import StyleSteps

GUIDE_COUNT, STRAND_COUNT = 12, 40
GUIDE_TOOLS = ["guide_length", "trim_guides", "change_guide_count", "mirror_guides", "copy_guide_shape"]
GUIDE_TOOLS += ["smooth_guides", "lift_guides", "attract_guides", "push_outside"]


class Artist(PaintingSteps, StyleSteps, RuleBasedStateMachine):
    """An artist whose state is Blender's own data."""

    def __init__(self):
        super().__init__()
        sys.stderr.reported.clear()
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.context.preferences.edit.use_global_undo = True
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
        bpy.ops.ed.undo_push(message="begin")
        self.folder = tempfile.TemporaryDirectory(prefix="vellus_walk_")

    def teardown(self):
        self.folder.cleanup()

    def law_of(self, name, values):
        """Return the context for a step, which may check more than the invariants."""
        return contextlib.nullcontext()

    # ------------------------------------------------------------------------------------------------- making

    @step(kind=st.sampled_from(["ico", "grid", "no faces", "not a number", "flat"]))
    @needs_room
    def add_surface(self, kind):
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        if kind == "ico":
            bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
        elif kind == "grid":
            bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4)
        else:
            third = {"no faces": [], "not a number": [(0, math.nan, 0)], "flat": [(2, 0, 0)]}[kind]
            mesh = bpy.data.meshes.new("Odd")
            mesh.from_pydata([(0, 0, 0), (1, 0, 0), *third], [], [(0, 1, 2)] if third else [])
            bpy.context.scene.collection.objects.link(bpy.data.objects.new("Odd", mesh))
        changed("surface")

    @step(number=pick)
    @needs_room
    def add_hair(self, number):
        if objects("MESH"):
            activate(chosen(objects("MESH"), number))
            operate(bpy.ops.vellus.add_hair, guide_count=GUIDE_COUNT, strand_count=STRAND_COUNT, relax_iterations=2)

    @step(number=pick, length=odd_numbers)
    @needs_room
    def distribute_guides(self, number, length):
        names = objects("MESH") + objects("CURVES")
        if names:
            activate(chosen(names, number))
            operate(bpy.ops.vellus.distribute_guides, guide_count=GUIDE_COUNT, relax_iterations=1, length=length)

    @step(number=pick, distance=odd_numbers, automatic=st.booleans())
    @needs_room
    def interpolate_hair(self, number, distance, automatic):
        names = objects("CURVES") + objects("MESH")
        if names:
            activate(chosen(names, number))
            operate(
                bpy.ops.vellus.interpolate_hair,
                strand_count=STRAND_COUNT,
                influence_distance=distance,
                automatic_influence=automatic,
            )

    # ----------------------------------------------------------------------------------------------- changing

    @step(number=pick, amount=st.sampled_from([0.0, 0.1, 5.0]))
    def comb(self, number, amount):
        seen = sorted({o.data.name for o in bpy.context.view_layer.objects if o.type == "CURVES"})
        if seen:
            guides = bpy.data.hair_curves[chosen(seen, number)]
            points = curve_data.read_points(guides) + np.float32(amount)
            if len(points):
                guides.attributes["position"].data.foreach_set("vector", points.ravel())
                guides.update_tag()
                changed("comb")

    @step(number=pick)
    def sculpt(self, number):
        if objects("CURVES"):
            activate(chosen(objects("CURVES"), number))
            operate(bpy.ops.vellus.comb_guides)

    @step(number=pick, operator=st.sampled_from(["select_guides", "select_hair", "toggle_drawing", "restore_guides"]))
    def use_button(self, number, operator):
        names = objects("MESH") + objects("CURVES")
        if names:
            activate(chosen(names, number))
            operate(getattr(bpy.ops.vellus, operator))

    @step(number=pick, other=pick, tool=st.sampled_from(GUIDE_TOOLS), factor=st.sampled_from([0.5, 0.9, 1.5]))
    def use_guide_tool(self, number, other, tool, factor):
        names = objects("MESH") + objects("CURVES")
        if names:
            activate(chosen(names, number))
            own = {"trim_guides": {"cutter": chosen(list(bpy.data.objects), other).name}}
            own |= {name: {"factor": factor} for name in ("guide_length", "change_guide_count")}
            operate(getattr(bpy.ops.vellus, tool), **own.get(tool, {}))

    @step(number=pick, operator=st.sampled_from(["make_uv_map", "use_uv_map", "check_uvs", "apply_scale"]))
    def mend_surface(self, number, operator):
        names = objects("CURVES") + objects("MESH")
        if names:
            activate(chosen(names, number))
            operate(getattr(bpy.ops.vellus, operator))

    @step(number=pick, other=pick)
    def attach(self, number, other):
        if objects("CURVES") and objects("MESH"):
            activate(chosen(objects("CURVES"), number))
            bpy.data.objects[chosen(objects("MESH"), other)].select_set(True)
            operate(bpy.ops.vellus.attach_to_surface)

    @step(number=pick, value=odd_numbers)
    def change_setting(self, number, value):
        if not ours():
            return
        state = chosen(sorted(ours(), key=lambda c: c.name), number).vellus
        group, name = [
            (state.guides, "length"),
            (state.guides, "tilt"),
            (state.hair, "radius"),
            (state.hair, "influence_distance"),
            *((state.hair, name) for name in ("angle_limit", "length_limit", "keep_length")),
            (state.appearance, "roughness"),
            (state.appearance, "melanin"),
            (state.marschner, "glint_gain"),
        ][number % 10]
        setattr(group, name, value)
        changed("setting")

    @step(number=pick, count=st.integers(-1, 30))
    def change_count(self, number, count):
        if ours():
            state = chosen(sorted(ours(), key=lambda c: c.name), number).vellus
            state.guides.guide_count = count
            state.hair.strand_count = count
            changed("count")

    @step(number=pick, is_live=st.booleans(), model=st.sampled_from(["KAJIYA_KAY", "MARSCHNER"]))
    def switch(self, number, is_live, model):
        if ours():
            state = chosen(sorted(ours(), key=lambda c: c.name), number).vellus
            state.is_live, state.model = is_live, model
            changed("switch")

    @step(number=pick)
    def apply_preset(self, number):
        if objects("CURVES"):
            activate(chosen(objects("CURVES"), number))
            operate(bpy.ops.vellus.apply_preset, preset="GREY" if number % 2 else "WET_BLOND")

    @step(number=pick, other=pick)
    def follow_others(self, number, other):
        if ours("HAIR"):
            hair = chosen(sorted(ours("HAIR"), key=lambda c: c.name), number)
            hair.vellus.guide_curves = chosen([None, *sorted(ours("GUIDES"), key=lambda c: c.name)], other)
            changed("follow")

    @step(number=pick, how=st.sampled_from(["move", "subdivide", "no faces", "not a number", "no UVs", "rename UVs"]))
    def change_mesh(self, number, how):
        self.change_mesh_as(number, how)

    def change_mesh_as(self, number, how):
        """Move a vertex, subdivide, or make the mesh unusable."""
        if not objects("MESH"):
            return
        surface = bpy.data.objects[chosen(objects("MESH"), number)]
        activate(surface.name)
        mesh = surface.data
        if how == "move" and len(mesh.vertices):
            mesh.vertices[number % len(mesh.vertices)].co.z += 0.3
        elif how == "subdivide" and not surface.modifiers:
            surface.modifiers.new("Subdivision", "SUBSURF").levels = 1
        elif how == "no faces" and number % 4 == 0:
            mesh.clear_geometry()
        elif how == "not a number" and number % 4 == 0 and len(mesh.vertices):
            mesh.vertices[0].co.x = math.nan
        elif how == "no UVs" and mesh.uv_layers:
            mesh.uv_layers.remove(mesh.uv_layers[0])
        elif how == "rename UVs" and mesh.uv_layers:
            mesh.uv_layers[0].name = f"Map {number}"
        mesh.update()
        mesh.update_tag()
        changed("mesh")

    @step(
        number=pick, scale=st.sampled_from([(1, 1, 1), (2, 2, 2), (-1, 1, 1), (0, 1, 1), (1, 3, 0.5), (1e6, 1e6, 1e6)])
    )
    def scale_surface(self, number, scale):
        if objects("MESH"):
            bpy.data.objects[chosen(objects("MESH"), number)].scale = scale
            changed("scale")

    @step(number=pick)
    def edit_surface(self, number):
        if objects("MESH"):
            activate(chosen(objects("MESH"), number))
            with contextlib.suppress(RuntimeError):  # Blender lets no two objects edit one mesh
                bpy.ops.object.mode_set(mode="EDIT")
            changed("edit")

    # -------------------------------------------------------------------------------------------- life and death

    @step(number=pick)
    def delete_object(self, number):
        names = objects("CURVES") + objects("MESH")
        if names:
            activate(chosen(names, number))
            bpy.ops.object.delete("EXEC_DEFAULT", True)
            bpy.context.view_layer.update()

    @step(number=pick)
    def delete_hair(self, number):
        names = objects("CURVES") + objects("MESH")
        if names:
            activate(chosen(names, number))
            operate(bpy.ops.vellus.delete_hair)

    @step(number=pick)
    def remove_datablock(self, number):
        if bpy.data.hair_curves:
            if bpy.context.mode != "OBJECT" and bpy.context.object is not None:
                bpy.ops.object.mode_set(mode="OBJECT")
            bpy.data.hair_curves.remove(chosen(list(bpy.data.hair_curves), number))
            changed("remove")

    @step()
    def purge(self):
        bpy.data.orphans_purge()
        changed("purge")

    @step(number=pick, is_linked=st.booleans(), has_children=st.booleans())
    @needs_room
    def duplicate(self, number, is_linked, has_children):
        names = objects("MESH") + objects("CURVES")
        if names:
            activate(chosen(names, number))
            for child in bpy.context.object.children if has_children else ():
                child.select_set(True)
            bpy.ops.object.duplicate("EXEC_DEFAULT", True, linked=is_linked)
            bpy.context.view_layer.update()

    @step(number=pick, name=st.sampled_from(["Hair", "Guides", "Ünïcödé {x}", "a" * 200]))
    def rename(self, number, name):
        if bpy.data.objects:
            renamed = chosen(list(bpy.data.objects), number)
            renamed.name = name
            if renamed.data is not None:
                renamed.data.name = name
            changed("rename")

    @step(steps=st.integers(1, 3))
    def undo(self, steps):
        for _ in range(steps):
            if bpy.ops.ed.undo.poll():
                bpy.ops.ed.undo()
        bpy.context.view_layer.update()

    @step(steps=st.integers(1, 3))
    def redo(self, steps):
        for _ in range(steps):
            if bpy.ops.ed.redo.poll():
                bpy.ops.ed.redo()
        bpy.context.view_layer.update()

    @step()
    def save_and_load(self):
        before, is_due = {c.name: len(c.curves) for c in ours() if c.users}, waits_elsewhere()
        self._save_and_load()
        assert is_due or {c.name: len(c.curves) for c in ours()} == before

    def _save_and_load(self):
        path = str(Path(self.folder.name) / "walk.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        bpy.ops.ed.undo_push(message="loaded")

    @step(meanwhile=st.sampled_from(["nothing", "undo", "load", "delete"]), number=pick)
    def switch_addon(self, meanwhile, number):
        """Disable and enable the add-on, with a change in between."""
        hair_addon.unregister()
        handlers_are_registered(is_on=False)
        if meanwhile == "undo" and bpy.ops.ed.undo.poll():
            bpy.ops.ed.undo()
        elif meanwhile == "load":
            self._save_and_load()
        elif meanwhile == "delete" and objects("CURVES"):
            activate(chosen(objects("CURVES"), number))
            bpy.ops.object.delete("EXEC_DEFAULT", True)
        hair_addon.register()
        changed("add-on")

    @step(number=pick)
    def remove_material(self, number):
        if bpy.data.materials:
            bpy.data.materials.remove(chosen(list(bpy.data.materials), number))
            changed("material")

    @step()
    def other_scene(self):
        if len(bpy.data.scenes) < 2:
            bpy.data.scenes.new("Other")
        window = bpy.context.window
        window.scene = next(scene for scene in bpy.data.scenes if scene != window.scene)
        changed("scene")

    @step()
    def look(self):
        """Draw everything visible, as for a picture."""
        context = bpy.context
        if context.scene.camera is None:
            camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
            camera.location.z = 6.0
            context.scene.collection.objects.link(camera)
            context.scene.camera = camera
            changed("camera")
        small = PictureSettings(width=24, height=24, samples_per_side=1)
        try:
            pixels = offscreen.draw_picture(small)
        except HairError:
            return  # the error is expected
        assert np.isfinite(pixels).all()

    @invariant()
    def check_all(self):
        invariants.check_all()


def walk(run_count, operation_count, number, artist=Artist):
    """Run walks; raises the first failure."""
    limits = settings(
        max_examples=run_count,
        stateful_step_count=operation_count,
        database=None,
        deadline=None,
        phases=[Phase.generate],  # shrinking a failure would take minutes
        suppress_health_check=list(HealthCheck),
    )
    seed(number)(get_state_machine_test(artist, settings=limits))()


def main(artist=Artist):
    """Run walks as a separate process, with the numbers of the command line."""
    faulthandler.enable()
    sys.stderr = invariants.Echo(sys.stderr)
    hair_addon.register()
    gpu.init()
    shrink_shadows(pytest.MonkeyPatch())
    walk(*map(int, sys.argv[1:]), artist)
    hair_addon.unregister()
    print("walked")


if __name__ == "__main__":
    main()
