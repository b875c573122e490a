# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of any_setting.py beside single settings: dynamics, exports, composites, presets and guide tools."""

import bpy

from tests.desktop.window import in_viewport, viewport, wait_for, window

_LAST_FRAME = 5  # of the scene: a bake is as long

# Long operators that begin at once when they are clicked, with the settings that they are given here.
_CLICKED = {
    *("bake_dynamics", "deliver_dynamics", "distribute_guides", "export_groom", "hair_cards", "hair_tubes"),
    *("interpolate_hair", "transfer_groom", "use_as_guides", "use_as_hair"),
}


class Operations:
    """Mixin of any_setting.py's `Artist`, whose random numbers and scene its steps use."""

    plays_until = 0  # the number of the step

    def do_dynamics(self):
        """Change any setting of simulated guides, or of a mesh as a collider, sometimes with a key."""
        guides, surface = self._curves("GUIDES"), self._surface()
        if guides is None or surface is None:
            return
        state = guides.data.vellus
        group = self.random.choice([state.dynamics, state.dynamics, surface.vellus])
        if group.id_data.library is not None:
            return
        name = self.random.choice(sorted(p.identifier for p in group.bl_rna.properties if self._is_set_by_hand(p)))
        value = self._value(group.bl_rna.properties[name], name, guides)
        self.say(f"{group.id_data.name}: {type(group).__name__}.{name} = {value!r}")
        setattr(group, name, value)
        if group.bl_rna.properties[name].is_animatable and self.random.random() < 0.1:
            group.keyframe_insert(name, frame=self.random.randint(1, _LAST_FRAME))

    def do_simulate(self):
        """Play some frames one after another, or jump in the middle."""
        guides = self._curves("GUIDES")
        if guides is None or guides.library is not None:
            return
        guides.data.vellus.simulates = self.random.random() < 0.8
        first, count = self.random.randint(1, 3), self.random.randint(1, 4)
        self.say(f"simulate {guides.name}: {guides.data.vellus.simulates}, frames {first} to {first + count - 1}")
        for frame in range(first, first + count):
            bpy.context.scene.frame_set(frame)

    def do_play(self):
        """Start playback, so that the next steps are taken while Blender plays."""
        guides = self._curves("GUIDES")
        if guides is not None and guides.library is None and self._activate(guides):
            self.say(f"play {guides.name}")
            bpy.context.scene.frame_end = _LAST_FRAME
            bpy.ops.vellus.play_dynamics("EXEC_DEFAULT")
            self.plays_until = self.step_count + 2

    def stop_playing(self):
        """Stop what `do_play` started, two steps later, as each step takes seconds while every frame is played."""
        if self.step_count >= self.plays_until and window().screen.is_animation_playing:
            self.say("stop playing")
            with in_viewport():
                bpy.ops.screen.animation_cancel(restore_frame=self.random.random() < 0.5)

    def do_bake(self):
        """Bake, deliver or remove frames."""
        guides = self._curves("GUIDES")
        if guides is None or guides.library is not None or not self._activate(guides):
            return
        bpy.context.scene.frame_end = _LAST_FRAME
        settings = guides.data.vellus.dynamics
        # A million frames take their time.
        settings.start_frame, settings.preroll, settings.substeps = 1, min(settings.preroll, 3), 4
        self._call(self.random.choice(["bake_dynamics", "deliver_dynamics", "free_dynamics", "remove_delivery"]))

    def do_preset(self):
        """Apply a preset of dynamics, of styles or of the look, or the stiffness that guides need."""
        curves_object = self._curves()
        if curves_object is None or not self._activate(curves_object):
            return
        name = self.random.choice(
            ["apply_dynamics_preset", "apply_style_preset", "apply_preset", "stiffen_dynamics", "drape_guides"]
        )
        properties = getattr(bpy.ops.vellus, name).get_rna_type().properties
        wanted = {"preset": self._value(properties["preset"], "preset", None)} if "preset" in properties else {}
        self._call(name, **(wanted | ({"seconds": 0.1} if name == "drape_guides" else {})))

    def do_guide_tool(self):
        """Use any tool with any settings, in Object or Edit Mode."""
        guides = self._curves("GUIDES")
        if guides is None or len(guides.data.curves) > 500 or not self._activate(guides):
            return
        tools = ["attract_guides", "change_guide_count", "copy_guide_shape", "guide_length", "lift_guides"]
        name = self.random.choice([*tools, "mirror_guides", "smooth_guides", "trim_guides"])
        declared = {p.identifier: p for p in getattr(bpy.ops.vellus, name).get_rna_type().properties}
        chosen = sorted(key for key, p in declared.items() if self._is_set_by_hand(p) and self.random.random() < 0.4)
        wanted = {key: self._value(declared[key], key, guides) for key in chosen}
        if guides.library is None and self.random.random() < 0.3:
            bpy.ops.object.mode_set(mode="EDIT")
        self._call(name, **wanted)
        self._leave_mode()

    def do_export(self):
        """Export a groom in every format, still or moving."""
        hair = self._curves("HAIR")
        if hair is not None and self._activate(hair):
            bpy.context.scene.frame_end = _LAST_FRAME
            ending = self.random.choice(["abc", "abc", "usdc"])  # some builds of Blender lack USD
            animation = self.random.choice(["NONE", "GUIDES", "ALL"])
            self._call("export_groom", filepath=str(self.folder / f"groom.{ending}"), animation=animation)

    def do_composite(self):
        self._call("toggle_composite")

    def do_collider(self):
        """Set a collection of colliders, one of them hidden or deleted."""
        guides, surface = self._curves("GUIDES"), self._surface()
        if guides is None or surface is None or guides.library is not None:
            return
        colliders = bpy.data.collections.get("Colliders") or bpy.data.collections.new("Colliders")
        if surface.name not in colliders.objects:
            colliders.objects.link(surface)
        guides.data.vellus.dynamics.colliders = "Colliders"
        action = self.random.choice(["hide", "show", "scale to nothing", "leave"])
        self.say(f"{surface.name} collides with {guides.name}: {action}")
        surface.hide_viewport = surface.hide_render = action == "hide"
        if action == "scale to nothing" and surface.library is None:
            surface.scale.z = 0.0

    def _is_set_by_hand(self, declared):
        is_own = declared.identifier not in {"rna_type", "name"} and declared.type != "POINTER"
        return is_own and not declared.is_readonly and not declared.is_hidden

    def _call(self, name, /, **wanted):
        operator = getattr(bpy.ops.vellus, name)
        active = bpy.context.object
        self.say(f"{name} {wanted} of {active.name if active else None}")
        if operator.poll():
            is_clicked = name in _CLICKED and self.random.random() < 0.5
            operator("INVOKE_DEFAULT" if is_clicked else "EXEC_DEFAULT", **wanted)

    def is_working(self):
        """Whether work that a click started continues."""
        return self.blender.host.running.job() is not None

    def wait_for_work(self):
        """Wait, as artists have to, for what a click started, with Esc now and then."""
        if not self.is_working():
            return
        self.say("working")
        if self.random.random() < 0.3:
            self.say("escape")
            area, _region = viewport()
            at = {"x": area.x + area.width // 2, "y": area.y + area.height // 2}
            for value in ("PRESS", "RELEASE"):
                window().event_simulate(type="ESC", value=value, **at)
                yield
        yield from wait_for(lambda: not self.is_working(), 120.0)
        if self.is_working():
            raise TimeoutError("two minutes were not enough for what a click began")
