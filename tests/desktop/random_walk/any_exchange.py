# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of any_setting.py that import or export hair: libraries, meshes, curves, particles."""

import bpy

LIBRARY_NAME = "Walk"  # of the asset library in Blender's preferences

_MOST_MESHES = 9
_MOST_CURVES = 20


class Exchanges:
    """Mixin of any_setting.py's `Artist`, whose random numbers and scene its steps use."""

    def add_asset_library(self):
        """Add an asset library in the walk's folder, which a new profile lacks."""
        libraries = bpy.context.preferences.filepaths.asset_libraries
        if LIBRARY_NAME not in libraries:
            folder = self.folder / "library"
            folder.mkdir(exist_ok=True)
            libraries.new(name=LIBRARY_NAME, directory=str(folder))

    def do_library(self):
        """Save a groom as an asset, or apply a saved one."""
        saved = sorted((self.folder / "library").glob("*.asset.blend"))
        if saved and self.random.random() < 0.5:
            surface = self._surface()
            if self._has_room() and surface is not None and self._activate(surface):
                method = self.random.choice(["AUTO", "UV", "NEAREST"])
                self._call("apply_groom", filepath=str(self.random.choice(saved)), method=method)
            return
        hair = self._curves("HAIR")
        if hair is not None and self._activate(hair):
            name, overwrites = self.random.choice(["One", "Two", ""]), self.random.random() < 0.8
            self._call("save_groom", name=name, library=LIBRARY_NAME, overwrites=overwrites)

    def do_meshes(self):
        """Convert hair to cards with textures or to tubes, which become surfaces of later steps up to a limit."""
        made = sorted(o.name for o in self._objects("MESH") if not len(o.vertex_groups))
        if len(self._objects("MESH")) >= _MOST_MESHES and made:
            self.say(f"remove {made[0]}")
            bpy.data.objects.remove(bpy.data.objects[made[0]])
        hair = self._curves("HAIR")
        if hair is None or not self._activate(hair):
            return
        if self.random.random() < 0.5:
            pictures, levels = self.random.choice([0, 5]), self.random.randint(1, 3)
            counts = {"card_count": self.random.randint(1, 40), "picture_count": pictures, "level_count": levels}
            self._call("hair_cards", texture_size=128, **counts)
        else:
            counts = {"tube_count": self.random.randint(1, 60), "side_count": self.random.randint(3, 6)}
            self._call("hair_tubes", **counts)

    def do_transfer(self):
        """Transfer a hair system to another mesh or to its own."""
        source, target = self._curves(), self._surface()
        if source is None or target is None or not self._has_room() or not self._activate(source):
            return
        properties = bpy.ops.vellus.transfer_groom.get_rna_type().properties
        settings = {name: self._value(properties[name], name, source) for name in ("method", "alignment", "reach")}
        if self.random.random() < 0.5:
            settings["target"] = target.name
        elif target.visible_get():
            target.select_set(True)
        self._call("transfer_groom", **settings)

    def do_foreign_curves(self):
        """Convert curves of other tools on a surface to guides, or to hair with derived guides."""
        surface = self._surface()
        if surface is None or surface.library is not None or not self._has_room() or not self._activate(surface):
            return
        self.say(f"empty hair on {surface.name}")
        bpy.ops.object.curves_empty_hair_add()
        curves = bpy.context.object
        for _ in range(self.random.choice([0, 1, 20])):  # Blender ends where curves are added with no counts
            curves.data.add_curves([self.random.choice([1, 2, 9])])
        for point in curves.data.points:
            point.position = [self.random.uniform(-1.0, 1.0) for _ in range(3)]
        if self.random.random() < 0.5:
            self._call("use_as_guides", strand_count=200)
        else:
            switches = {key: self.random.random() < 0.5 for key in ("applies_modifiers", "follows_guides")}
            self._call("use_as_hair", guide_count=self.random.choice([1, 10]), **switches)

    def do_particles(self):
        """Convert a particle system's hair to strands or guides."""
        surface = self._surface()
        if surface is None or surface.library is not None or not self._has_room() or not self._activate(surface):
            return
        self.say(f"particles on {surface.name}")
        surface.modifiers.new("Particles", "PARTICLE_SYSTEM")
        particles = surface.particle_systems[-1].settings
        particles.type, particles.count, particles.hair_length = "HAIR", self.random.choice([0, 1, 50]), 0.3
        bpy.context.view_layer.update()
        self._call("convert_particles", use=self.random.choice(["HAIR", "GUIDES"]), guide_count=8)
        made = bpy.context.object.data
        if made != surface.data and made.vellus.kind == "HAIR":
            made.vellus.hair.strand_count = 200  # between guides they are tens of thousands by default

    def do_any_operator(self):
        """Call any operator as a script does, with few strands and otherwise its defaults."""
        thing = self.random.choice([self._curves(), self._surface()])
        if thing is None or not self._activate(thing) or not self._has_room():
            return
        bpy.context.scene.frame_end = 5
        # The first plays on, the others take long by default; tables take minutes.
        left_out = {
            "play_dynamics",
            "bake_dynamics",
            "deliver_dynamics",
            "hair_cards",
            "convert_particles",
            "bake_tables",
        }
        name = self.random.choice(sorted(set(dir(bpy.ops.vellus)) - left_out))
        few = {"strand_count": 200, "guide_count": 20, "tube_count": 20, "seconds": 0.1}
        properties = getattr(bpy.ops.vellus, name).get_rna_type().properties
        self._call(name, **{key: value for key, value in few.items() if key in properties})
        self._leave_mode()

    def _has_room(self):
        return len(self._objects("CURVES")) < _MOST_CURVES
