# SPDX-License-Identifier: GPL-3.0-or-later
"""Every setting in random order in a real window, on surfaces that are deformed, animated, emptied and linked.

Run by a desktop Blender as steps.py says; PART is the number of the step before which it ends, MORE the seed. The next
part goes on with the scene and the state of the random numbers. In background hair is written at once; in a window the
picture is ahead of the Curves, and what is drawn then comes from both.
"""

import math
import random
import sys
import time
import traceback
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))
from tests.desktop.random_walk import any_scene  # noqa: E402
from tests.desktop.random_walk.any_exchange import Exchanges  # noqa: E402
from tests.desktop.random_walk.any_operation import Operations  # noqa: E402
from tests.desktop.steps import MORE, OUT, PART, ZIP, facts, take  # noqa: E402
from tests.desktop.window import MODULE, addon, in_viewport, install, refine_to, viewport, wait  # noqa: E402
from tests.support import rooted  # noqa: E402

_BLOCKS_AN_OBJECT, _MORE_BLOCKS = 8, 150  # curves, meshes, materials, images; workspaces, screens, node groups, text


class Artist(Operations, Exchanges):
    """Takes random steps, each printed before it is taken, so that the log ends with the step that crashed Blender."""

    def __init__(self, seed, folder):
        self.random = random.Random(seed)
        self.folder = folder
        self.scene = str(folder / "any_setting.blend")
        self.step_count, self.taken, self.redraw_count = 0, [], 0
        self.blender = addon()
        self.core = sys.modules[f"{MODULE}.hair_addon.core"]
        refine_to(1)  # it is not the quality of pictures that is looked at
        bpy.types.SpaceView3D.draw_handler_add(self._count_redraw, (), "WINDOW", "POST_PIXEL")

    def _count_redraw(self):
        self.redraw_count += 1

    # ------------------------------------------------------------------------------------------------- the scene

    def begin(self):
        """Open the scene of the previous part, or create a new one."""
        self.add_asset_library()
        if "random" not in facts:
            yield from any_scene.build(self.folder)
            self._save()  # frames are baked beside the file
            return
        version, numbers, gauss = facts["random"]
        self.random.setstate((version, tuple(numbers), gauss))
        self.step_count, self.taken = facts["step_count"], facts["steps"]
        bpy.ops.wm.open_mainfile(filepath=self.scene)
        yield

    def end(self):
        """Save what the next part continues with."""
        with in_viewport():
            self._save()
        facts.update(step_count=self.step_count, random=self.random.getstate(), steps=self.taken)

    # ------------------------------------------------------------------------------------------------- the steps

    def take(self, end):
        """Take all steps before number `end`, with Blender's own events and redraws between them."""
        moves = [getattr(self, name) for name in sorted(dir(self)) if name.startswith("do_")]
        weights = [12.0 if move in (self.do_setting, self.do_two_settings) else 1.0 for move in moves]
        while self.step_count < end:
            (move,) = self.random.choices(moves, weights)
            self._try(self._step, move)
            self.step_count += 1
            yield
            yield from self.wait_for_work()
            self._try(self.stop_playing)
            if self.step_count % 2 == 0:
                self._try(self.look)
        yield from wait(1.0)
        self._try(self.look)
        self._try(self.ask)
        print(f"any_setting: {self.redraw_count} redraws, {time.process_time():.0f} s of all processors", flush=True)

    def _step(self, move):
        with in_viewport():
            try:
                move()
            finally:
                # As Blender does after each operator of an artist, also if a later operator of the move is refused:
                # undo from objects that a script added without a step has ended Blender (seed 4003).
                self._push_undo(move.__name__)

    def _push_undo(self, message):
        # Refused for a moment after a file was opened.
        if bpy.context.mode == "OBJECT" and not self.is_working() and bpy.ops.ed.undo_push.poll():
            bpy.ops.ed.undo_push(message=message)

    def _try(self, action, *arguments):
        """Run a function and continue: exceptions stay in the log, which is checked at the end."""
        try:
            action(*arguments)
        except RuntimeError as refusal:  # an operator that reported why not; its traceback if it raised
            self.say(f"refused: {refusal}")
        except Exception:
            traceback.print_exc()

    def say(self, text):
        """Print to the log immediately."""
        self.taken.append(text)
        print(f"any_setting: {text}", flush=True)

    def ask(self):
        """Ask all operators whether they apply, in a context with a window and in one without."""
        for context in ({}, {"window": None}):
            with bpy.context.temp_override(**context):
                offered = [name for name in dir(bpy.ops.vellus) if getattr(bpy.ops.vellus, name).poll()]
            self.say(f"{len(offered)} operators apply")

    def look(self):
        """Draw the window, and compare cached hair with a first drawing."""
        with in_viewport():
            bpy.ops.wm.redraw_timer(type="DRAW_WIN", iterations=1)
        cache = self.blender.render.hair_cache
        for curves_object in self._objects("CURVES"):
            datablock = curves_object.data
            try:
                kept = cache.strands_on_gpu(datablock)
            except self.core.errors.HairError as error:
                self.say(f"not drawn: {error}")
                continue
            bound = self.blender.groom.bindings.of(datablock)
            strand_count = len(datablock.curves) if bound is None else len(bound.points)
            assert kept is None or kept.strand_count == strand_count, datablock.name
            assert kept is None or np.isfinite(kept.points).all(), datablock.name
            if kept is not None and rooted.should_be_rooted(curves_object):
                away = rooted.far_root(curves_object, kept.points, bpy.context.evaluated_depsgraph_get())
                assert not away, away
        self._nothing_grows()

    def _nothing_grows(self):
        """Assert that handlers exist once, and that there are as many datablocks as the scene's objects need."""
        for name in dir(bpy.app.handlers):
            functions = getattr(bpy.app.handlers, name)
            if isinstance(functions, list):
                of_ours = [function for function in functions if getattr(function, "__module__", "").startswith(MODULE)]
                assert len(of_ours) == len(set(of_ours)), (name, of_ours)
        assert len(self.blender.render.viewport.viewport._handles) == 1
        count = len(bpy.data.all_ids) - len(bpy.data.brushes)
        assert count < _BLOCKS_AN_OBJECT * len(bpy.data.objects) + _MORE_BLOCKS, count

    def _objects(self, kind):
        # Objects that a script has just removed are listed as None until the next update.
        return [o for o in bpy.context.view_layer.objects if o is not None and o.type == kind]

    def _curves(self, kind=None):
        found = [o for o in self._objects("CURVES") if o.data.vellus.kind in ({kind} if kind else {"GUIDES", "HAIR"})]
        return self.random.choice(sorted(found, key=lambda o: o.name)) if found else None

    def _surface(self):
        found = sorted(o.name for o in self._objects("MESH"))
        return bpy.data.objects[self.random.choice(found)] if found else None

    def do_setting(self):
        """Set any property that hair stores to any valid value; counts stay small enough to draw."""
        curves_object = self._curves()
        if curves_object is None:
            return
        state = curves_object.data.vellus
        group = self.random.choice([state, state.guides if state.kind == "GUIDES" else state.hair])
        if state.kind == "HAIR" and self.random.random() < 0.3:
            group = self.random.choice([state.appearance, state.marschner])
        if state.kind == "HAIR" and len(state.styles) and self.random.random() < 0.4:
            group = self.blender.settings.style_items.group_of(self.random.choice(list(state.styles)))
        hidden = {"rna_type", "name", "kind"}
        declared = [p for p in group.bl_rna.properties if p.identifier not in hidden and not p.is_readonly]
        names = [p.identifier for p in declared if not p.is_hidden and p.type != "POINTER"]
        name = self.random.choice(sorted(names))
        value = self._value(group.bl_rna.properties[name], name, curves_object)
        self.say(f"{curves_object.name}.{name} = {value!r}")
        setattr(group, name, value)

    def do_two_settings(self):
        """Set two properties before Blender has evaluated either."""
        self.do_setting()
        self.do_setting()

    def _value(self, declared, name, curves_object):
        names = {
            "density_group": ["", "half", "missing"],
            "region_group": ["", "half", "missing"],
            "region_attribute": ["", "sharp_face", "missing"],
            "part_lines": ["", "Sun", "Line", "missing"],
            "density_image": ["", "missing"],
            "mask": ["", "half", "missing"],
            "mask_image": ["", "missing"],
            **{key: ["", "Sun", "Plain", "missing"] for key in ("cutter", "source", "target")},
            "colliders": ["", "Collection", "Colliders", "missing"],
        }
        if declared.type == "STRING":
            return self.random.choice(names.get(name, [""]))
        if declared.type == "BOOLEAN":
            return self.random.random() < 0.5
        if declared.type == "ENUM":
            return self.random.choice([item.identifier for item in declared.enum_items])
        if declared.is_array:
            return [self.random.random() for _ in range(declared.array_length)]
        # Limits for drawing by a processor: thick hair of many points takes seconds per frame.
        most = {"guide_count": 200, "strand_count": 2000, "point_count": 60, "thickness": 20.0, "relax_iterations": 20}
        most |= {"size": 64, "levels": 2, "preroll": 3}
        # Smaller locks are tens of thousands.
        least = {"size": 0.1, "lock": 0.1} if declared.type == "FLOAT" else {}
        low, high = least.get(name, declared.hard_min), min(declared.hard_max, most.get(name, declared.soft_max))
        if declared.type == "INT":
            return self.random.choice([int(low), int(high), self.random.randint(int(low), max(int(low), int(high)))])
        return self.random.choice([low, high, low + (high - low) * self.random.random() ** 3])

    def do_style(self):
        """Add, move, remove or key a style."""
        hair = self._curves("HAIR")
        if hair is None or not self._activate(hair):
            return
        state = hair.data.vellus
        operators = {
            "add_style": {"style": self.random.choice(list(self.core.styling.kinds.OFFERS))},
            "move_style": {"direction": self.random.choice(["UP", "DOWN"])},
            "remove_style": {},
            "duplicate_style": {},
        }
        name = self.random.choice(["add_style", *operators])
        operator = getattr(bpy.ops.vellus, name)
        self.say(f"{name} {operators[name]} of {hair.name}")
        if operator.poll():
            operator("EXEC_DEFAULT", **operators[name])
        if hair.library is None and len(state.styles) and self.random.random() < 0.3:
            item = self.random.choice(list(state.styles))
            self.blender.settings.style_items.group_of(item).keyframe_insert("amount", frame=self.random.randint(1, 5))

    def do_many_strands(self):
        hair = self._curves("HAIR")
        if hair is not None:
            hair.data.vellus.hair.strand_count = self.random.choice([7, 700, 6000, 15_000])
            self.say(f"{hair.name}: {hair.data.vellus.hair.strand_count} strands")

    def do_edit(self):
        """Delete all or some points in Edit Mode."""
        curves_object = self._curves()
        if curves_object is None or curves_object.library is not None or not self._activate(curves_object):
            return
        action = self.random.choice(["SELECT", "INVERT"])
        self.say(f"empty {curves_object.name}: {action}")
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.curves.select_all(action="SELECT")
        if action == "INVERT":
            bpy.ops.curves.select_random(probability=0.5)
        bpy.ops.curves.delete()
        bpy.ops.object.mode_set(mode="OBJECT")

    def do_regenerate(self):
        curves_object = self._curves()
        if curves_object is None or not self._activate(curves_object):
            return
        if curves_object.data.vellus.kind == "GUIDES":
            self._call("distribute_guides", guide_count=self.random.choice([1, 25, 60]), length=0.3)
        else:
            self._call("interpolate_hair", strand_count=self.random.choice([1, 500, 3000]))

    def do_comb(self):
        """Move the points of some guides in Sculpt Mode as a brush does, and sometimes leave the mode open."""
        guides = self._curves("GUIDES")
        if guides is None or guides.library is not None or not len(guides.data.points) or not self._activate(guides):
            return
        self.say(f"comb {guides.name}")
        bpy.ops.object.mode_set(mode="SCULPT_CURVES")
        positions = np.empty(3 * len(guides.data.points), np.float32)
        guides.data.attributes["position"].data.foreach_get("vector", positions)
        positions[: len(positions) // 2] += 0.05 * self.random.random()
        guides.data.attributes["position"].data.foreach_set("vector", positions)
        guides.data.update_tag()
        if self.random.random() < 0.7:
            bpy.ops.object.mode_set(mode="OBJECT")

    def do_deform(self):
        surface = self._surface()
        if surface is None or surface.library is not None:
            return
        self.say(f"deform {surface.name}")
        for modifier in surface.modifiers:
            modifier.show_viewport = self.random.random() < 0.7
            if modifier.type == "SUBSURF":
                modifier.levels = self.random.randint(0, 2)
            elif modifier.type == "SIMPLE_DEFORM":
                modifier.angle = self.random.uniform(-math.pi, math.pi)

    def do_edit_mesh(self):
        surface = self._surface()
        if surface is None or surface.library is not None or surface.data.shape_keys or not self._activate(surface):
            return
        self.say(f"edit {surface.name}")
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        edit = self.random.choice(["delete", "subdivide", "scale", "nothing"])
        if edit == "delete":
            bpy.ops.mesh.select_random(ratio=0.9, action="DESELECT")
            bpy.ops.mesh.delete(type="FACE")
        elif edit == "subdivide" and len(surface.data.polygons) < 3000:
            bpy.ops.mesh.subdivide()
        elif edit == "scale":
            bpy.ops.transform.resize(value=(1.1, 0.9, 1.0))
        bpy.ops.object.mode_set(mode="OBJECT")

    def do_move(self):
        surface = self._surface()
        if surface is not None and surface.library is None:
            self.say(f"move {surface.name}")
            surface.rotation_euler.z += self.random.random()
            surface.scale.x *= self.random.choice([1.0, -1.0, 1.1])

    def do_frame(self):
        frame = self.random.randint(1, 24)
        self.say(f"frame {frame}")
        bpy.context.scene.frame_set(frame)

    def do_undo(self):
        steps = self.random.randint(1, 3)
        self.say(f"undo {steps}, redo 1")
        for _ in range(steps):
            if bpy.ops.ed.undo.poll():
                bpy.ops.ed.undo()
        if self.random.random() < 0.5 and bpy.ops.ed.redo.poll():
            bpy.ops.ed.redo()

    def do_hide(self):
        curves_object = self._curves()
        if curves_object is not None:
            self.say(f"hide {curves_object.name}")
            curves_object.hide_set(self.random.random() < 0.4)

    def do_save_and_load(self):
        self.say("save and load")
        self._save()
        bpy.ops.wm.open_mainfile(filepath=self.scene)

    def _save(self):
        self._leave_mode()
        bpy.ops.wm.save_as_mainfile(filepath=self.scene)

    def do_duplicate(self):
        curves_object = self._curves()
        if curves_object is not None and len(self._objects("CURVES")) < 20 and self._activate(curves_object):
            self.say(f"duplicate {curves_object.name}")
            bpy.ops.object.duplicate(linked=self.random.random() < 0.3)

    def do_delete(self):
        curves_object = self._curves()
        if curves_object is not None and len(self._objects("CURVES")) > 8 and self._activate(curves_object):
            self.say(f"delete {curves_object.name}")
            bpy.ops.object.delete()

    def do_shading(self):
        mode = self.random.choice(["SOLID", "WIREFRAME"])
        self.say(f"shading {mode}")
        viewport()[0].spaces.active.shading.type = mode

    def _leave_mode(self):
        if bpy.context.mode != "OBJECT" and bpy.context.object is not None:
            bpy.ops.object.mode_set(mode="OBJECT")

    def _activate(self, thing):
        """Select one object alone, and return whether that is possible."""
        self._leave_mode()
        if not thing.visible_get():
            return False
        bpy.ops.object.select_all(action="DESELECT")
        thing.select_set(True)
        bpy.context.view_layer.objects.active = thing
        return thing.select_get()


def steps():
    """Return the steps before the part's number, once the extension is installed."""
    install(ZIP)
    artist = Artist(int(MORE[0]), OUT)
    yield from artist.begin()
    yield from artist.take(int(PART))
    artist.end()


if __name__ == "__main__":
    take([steps], pause=0.02)
