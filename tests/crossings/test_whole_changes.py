# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that fail halfway, or refuse, leave the file and its folder unchanged."""

import contextlib
import functools
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data import whole_changes
from hair_addon.blender.io import groom_library
from hair_addon.blender.settings import map_items
from hair_addon.core.errors import HairError
from hair_addon.core.long_work import run_now
from tests.support import file_digest, folder_digest
from tests.support.exchange.card_meshes import card_object
from tests.support.exchange.imported import curves_object, lines_on, select
from tests.support.pairs import share_of_rows

PACKAGE = str(Path(whole_changes.__file__).parents[1])
# Parts of the calls of an operator, where it fails: for one operator after another.
FEW_PARTS = ((0.3, 1.0), (0.75, 0.93))
MANY_PARTS = tuple((n + 1) / 30 for n in range(30))


class Broken(Exception):
    """An exception that no function of ours raises."""


def things(name):
    return bpy.data.objects[name]


def on_hair(_rng):
    select(things("Hair"))


def on_guides(_rng):
    select(things("Guides"))


def on_sphere(_rng):
    select(things("Sphere"))


def on_bare_mesh(_rng):
    """Set up a mesh whose rest positions Blender does not store yet, with mirrored faces to tell apart."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, location=(4.0, 0.0, 0.0))
    bpy.context.object.name = "Other"
    bpy.context.object.modifiers.new("Mirror", "MIRROR").use_axis[2] = True


def on_other_mesh(rng):
    """Set up another mesh to which the hair is transferred, or on which it is read from a library."""
    on_bare_mesh(rng)
    api.add_style(bpy.data.hair_curves["Hair"], api.Curl(mask="top"))
    select(things("Hair"))


def on_drawn(rng, kind="CATMULL_ROM"):
    drawn = curves_object([*lines_on(things("Sphere"), rng, 9)], "Drawn", kind)
    drawn.modifiers.new("Own", "NODES")
    select(things("Sphere"), drawn)


def on_splines(rng):
    """Set up a curve object, which Blender converts in place."""
    data = bpy.data.curves.new("Spline", "CURVE")
    data.dimensions = "3D"
    for line in lines_on(things("Sphere"), rng, 6):
        spline = data.splines.new("POLY")
        spline.points.add(len(line) - 1)
        for point, place in zip(spline.points, line, strict=True):
            point.co = (*place, 1.0)
    drawn = bpy.data.objects.new("Spline", data)
    bpy.context.scene.collection.objects.link(drawn)
    select(things("Sphere"), drawn)


def on_two(rng):
    on_drawn(rng)
    other = curves_object([*lines_on(things("Sphere"), rng, 5)], "Drawn too")
    select(things("Sphere"), other, things("Drawn"))


def on_particles(_rng):
    sphere = things("Sphere")
    system = sphere.modifiers.new("Fur", "PARTICLE_SYSTEM").particle_system
    system.settings.type, system.settings.count = "HAIR", 12
    select(sphere)


def on_styled(_rng):
    on_hair(_rng)
    api.add_style(bpy.data.hair_curves["Hair"], api.Curl())
    bpy.context.view_layer.update()


def on_cards(rng):
    cards = card_object(list(lines_on(things("Sphere"), rng, 8)), 0.05)
    layer = cards.data.color_attributes.new("Color", "FLOAT_COLOR", "POINT")
    cards.data.color_attributes.active_color = layer
    select(things("Sphere"), cards)
    bpy.context.view_layer.update()


def on_selected_guides(rng):
    on_styled(rng)
    guides = bpy.data.hair_curves["Guides"]
    selected = guides.attributes.new(".selection", "FLOAT", "CURVE")
    selected.data.foreach_set("value", [float(index < 5) for index in range(len(guides.curves))])


def on_map(kind):
    def on_map_without_source(rng):
        on_hair(rng)
        item = map_items.add(bpy.data.hair_curves["Hair"].vellus, "look.color")
        item.kind = kind
        bpy.context.view_layer.update()

    return on_map_without_source


def on_shared_guides(_rng):
    copy = things("Hair").copy()
    copy.data = copy.data.copy()
    bpy.context.scene.collection.objects.link(copy)
    select(copy)
    bpy.context.view_layer.update()


def on_lost_guides(_rng):
    select(things("Hair"))
    bpy.data.objects.remove(things("Guides"))
    bpy.context.view_layer.update()


def on_cycles(_rng):
    on_hair(_rng)
    bpy.context.scene.render.engine = "CYCLES"


def on_library(rng):
    on_other_mesh(rng)
    save_groom(FOLDER[0] / "library", "Groom")
    select(things("Other"))


def save_groom(path, name=""):
    """Save a groom as the operator does, without its picture, which takes seconds to draw."""
    hair, picture = bpy.data.hair_curves["Hair"], np.ones((8, 8, 4), np.float32)
    run_now(groom_library.saving(hair, path, name, "Hair/Short", picture))


def on_exported(_rng):
    api.export_groom(FOLDER[0] / "read.abc", [bpy.data.hair_curves["Hair"]])
    on_sphere(_rng)


FOLDER = []  # of files, for the test that runs
FEW = {"guide_count": 6, "relax_iterations": 0}
# Operators that make data, or files: (what is done before, settings).
MAKING = {
    "add_hair": [(on_bare_mesh, FEW | {"strand_count": 20})],
    "distribute_guides": [(on_bare_mesh, FEW)],
    "interpolate_hair": [(on_guides, {"strand_count": 20})],
    "use_as_guides": [(on_drawn, {"strand_count": 20}), (on_splines, {"strand_count": 20}), (on_two, {})],
    "use_as_hair": [(on_drawn, {"guide_count": 4}), (on_two, {"guide_count": 4})],
    "import_groom": [(on_exported, {"filepath": "read.abc", "guide_count": 4})],
    "convert_particles": [(on_particles, {"guide_count": 4})],
    "mesh_to_hair": [(on_cards, {"guide_count": 4, "strand_count": 12})],
    "transfer_groom": [(on_other_mesh, {"target": "Other"})],
    "make_own_guides": [(on_shared_guides, {})],
    "restore_guides": [(on_lost_guides, {})],
    "draw_flow": [(on_guides, {})],
    "draw_parting": [(on_hair, {})],
    "draw_tie": [(on_guides, {})],
    "add_style": [(on_styled, {"style": "FRIZZ"})],
    "duplicate_style": [(on_styled, {})],
    "paint_style_mask": [(on_styled, {})],
    "paint_density": [(on_hair, {})],
    "paint_map": [(on_map("GROUP"), {"setting": "look.color"}), (on_map("IMAGE"), {"setting": "look.color"})],
    "add_ramp": [(on_hair, {})],
    "add_map_ramp": [(on_map("GROUP"), {"setting": "look.color"})],
    "add_course": [(on_styled, {"setting": "styles.Curl.amount"})],
    "mask_from_selection": [(on_selected_guides, {})],
    "make_uv_map": [(on_sphere, {})],
    "toggle_composite": [(on_cycles, {})],
    "hair_tubes": [(on_hair, {})],
    "hair_cards": [(on_hair, {"card_count": 4, "texture_size": 32, "level_count": 1, "picture_count": 2})],
    "save_groom": [(on_other_mesh, {})],
    "apply_groom": [(on_library, {"filepath": "library/Groom.asset.blend", "name": "Groom"})],
    "export_groom": [(on_hair, {"filepath": "groom.usdc"})],
    "save_groom_settings": [(on_hair, {"filepath": "settings.json"})],
}
MAKING["hair_cards"].append((on_hair, MAKING["hair_cards"][0][1] | {"folder": "cards"}))
# These change what is there, and settings; or show, choose and remove something. `deliver_dynamics` and baking write
# files that are whole at any time, in `test_frame_cache` and `test_delivery`.
OTHERS = {
    "add_grooms",
    *("apply_dynamics_preset", "apply_preset", "apply_saved_look", "apply_saved_style", "apply_scale"),
    *("apply_style_preset", "attach_to_surface", "attract_guides", "bake_dynamics", "bake_tables"),
    *("add_layer", "apply_layers", "duplicate_layer", "merge_layer_down", "move_layer", "remove_layer"),
    *("change_guide_count", "check_uvs", "comb_guides", "copy_guide_shape", "delete_hair", "delete_system"),
    *("deliver_dynamics", "drape_guides", "edit_map", "flip_normals", "free_dynamics", "freeze_selected"),
    *("guide_length", "invert_frozen", "lift_guides", "push_outside", "remove_map", "remove_ramp", "unfreeze_all"),
    *("remove_map_ramp", "remove_course"),
    *("load_groom_settings", "mirror_guides", "move_style", "pick_hair", "play_dynamics", "remove_delivery"),
    *("remove_look", "remove_style", "remove_style_preset", "render_picture", "save_look", "save_style_preset"),
    *("select_guides", "select_hair", "smooth_guides", "stiffen_dynamics", "toggle_drawing", "trim_guides"),
    *("gather_guides", "paint_flow", "size_flow_brush", "update_hair", "use_points", "use_uv_map"),
    *("save_selection", "select_saved", "remove_selection", "retry_baking"),
    *("keep_guide_density", "keep_strand_density"),
}
CASES = [(name, *case) for name, cases in MAKING.items() for case in cases]


def cases():
    """Return each of `CASES` with failures at one or two calls; every second case, and many calls, are `long`."""
    for place, case in enumerate(CASES):
        name = f"{case[0]}-{case[1].__name__}"
        yield pytest.param(
            *case, FEW_PARTS[place // 2 % 2], id=f"{name}-few", marks=() if place % 2 == 0 else pytest.mark.long
        )
        yield pytest.param(*case, MANY_PARTS, id=f"{name}-many", marks=pytest.mark.long)


def test_every_operator_is_one_that_makes_data_or_not():
    assert {*dir(bpy.ops.vellus)} == MAKING.keys() | OTHERS, "say in this file whether it makes data"


def run(name, settings, folder):
    """Run an operator, and return whether it succeeded."""
    if name == "save_groom":  # the operator's libraries are those of the preferences
        save_groom(folder / "saved.blend")
        return True
    places = {key: str(folder / settings[key]) for key in ("filepath", "folder") if key in settings}
    return getattr(bpy.ops.vellus, name)(**settings | places) == {"FINISHED"}


class Fault:
    """Within the context, count the calls of functions of the add-on, and let that of a given number fail."""

    def __init__(self, number=0):
        self.number, self.count, self._before = number, 0, None

    def __enter__(self):
        self._before = sys.gettrace()
        sys.settrace(self._see)
        return self

    def __exit__(self, *_error):
        sys.settrace(self._before)

    def _see(self, frame, _event, _argument):
        if whole_changes._open and owner_of(frame.f_code.co_filename) == "changing" and not called_back(frame):
            self.count += 1
            if self.count == self.number:
                raise Broken


@functools.cache
def owner_of(path):
    """Return the kind of a piece of code: "test", "called back" by Blender, "changing" files, or "other"."""
    if "tests" in path:
        return "test"
    if "/live/" in path or "/settings/" in path:
        return "called back"
    is_changing = path.startswith(PACKAGE) and not path.endswith("whole_changes.py")
    return "changing" if is_changing else "other"


def called_back(frame):
    """Whether Blender has called the running function, as it only prints errors of handlers and property functions."""
    while frame is not None and (owner := owner_of(frame.f_code.co_filename)) != "test":
        if owner == "called back":
            return True
        frame = frame.f_back
    return False


@pytest.mark.parametrize("name, begin, settings, parts", [*cases()])
def test_what_fails_half_way_leaves_nothing(hair, tmp_path, name, begin, settings, parts):
    """An unexpected exception in any function of the add-on leaves the file as before, and no file half written."""
    FOLDER[:] = [tmp_path]
    begin(np.random.default_rng(1))
    bpy.context.view_layer.update()
    whole = tmp_path.with_suffix(".blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(whole))
    files = folder_digest.of_folder(tmp_path)
    assert run(name, settings, tmp_path)
    for path in folder_digest.of_folder(tmp_path).keys() - files.keys():
        path.unlink()
    bpy.ops.wm.open_mainfile(filepath=str(whole))
    with Fault() as counted:  # what is kept of the first time is not computed again
        assert run(name, settings, tmp_path)
    written = {path: data for path, data in folder_digest.of_folder(tmp_path).items() if path not in files}
    failed = 0
    for part in parts:
        for path in written:
            path.unlink(missing_ok=True)
        bpy.ops.wm.open_mainfile(filepath=str(whole))
        before = file_digest.of_file()
        with contextlib.suppress(RuntimeError, Broken), Fault(round(part * counted.count)) as fault:
            run(name, settings, tmp_path)
            fault.number = 0  # swallowed by Blender, in a handler
        if fault.number:
            failed += 1
            left = file_digest.changes(before, file_digest.of_file())
            # UV coordinates of roots are written again at any time.
            assert [key for key in left if "surface_uv_coordinate" not in key] == [], (part, fault.number)
            left = folder_digest.of_folder(tmp_path)
            assert {path for path in left if path not in files} <= written.keys()
    assert failed >= len(parts) // 2


def on_hidden_sphere(_rng):
    on_sphere(_rng)
    things("Sphere").hide_set(True)


def on_dynamics(_rng):
    on_guides(_rng)
    bpy.data.hair_curves["Guides"].vellus.simulates = True
    bpy.data.hair_curves["Guides"].vellus.cache_folder = str(FOLDER[0] / "frames")
    bpy.context.scene.frame_start = bpy.context.scene.frame_end = 2


def on_late_dynamics(rng):
    on_dynamics(rng)
    bpy.data.hair_curves["Guides"].vellus.dynamics.start_frame = 9


def on_blind_dynamics(rng):
    on_dynamics(rng)
    bpy.data.hair_curves["Guides"].vellus.dynamics.colliders = "nope"


def on_attribute_mask(rng):
    on_styled(rng)
    things("Sphere").data.attributes.new("painted", "FLOAT", "POINT")
    bpy.data.hair_curves["Hair"].vellus.styles[0].curl.mask = "painted"
    bpy.context.view_layer.update()


def on_vellus(_rng):
    on_hair(_rng)
    bpy.context.scene.render.engine = "VELLUS"


def on_a_file(_rng):
    on_hair(_rng)
    (FOLDER[0] / "taken").write_text("mine")
    (FOLDER[0] / "damaged.json").write_text("{")


def on_no_particles(rng):
    on_particles(rng)
    things("Sphere").particle_systems[0].settings.count = 0


# Operator, what is done before, settings that it refuses.
REFUSED = [
    ("add_hair", on_bare_mesh, {"density_image": "nope"}),
    ("distribute_guides", on_bare_mesh, {"density_image": "nope"}),
    ("interpolate_hair", on_guides, {"density_group": "nope"}),
    ("use_as_guides", on_drawn, {"density_image": "nope"}),
    ("use_as_guides", on_splines, {"surface": "nope"}),
    ("use_as_guides", on_two, {"density_group": "nope"}),
    ("use_as_hair", on_two, {"surface": "nope"}),
    ("convert_particles", on_no_particles, {}),
    ("mesh_to_hair", on_cards, {"surface": "nope"}),
    ("mesh_to_hair", on_other_mesh, {"surface": "Sphere"}),
    ("transfer_groom", on_other_mesh, {"target": "nope"}),
    ("transfer_groom", on_other_mesh, {"target": "Other", "method": "LANDMARKS"}),
    ("apply_groom", on_library, {"filepath": "library/Groom.asset.blend", "name": "nope"}),
    ("apply_groom", on_library, {"filepath": "nope.blend"}),
    ("hair_cards", on_a_file, {"card_count": 4, "texture_size": 32, "level_count": 1, "folder": "taken/cards"}),
    ("export_groom", on_hair, {"filepath": "groom.txt"}),
    ("export_groom", on_hair, {"filepath": "groom.usdc", "has_hair": False, "has_guides": False}),
    ("load_groom_settings", on_a_file, {"filepath": "damaged.json"}),
    ("paint_style_mask", on_attribute_mask, {}),
    ("mask_from_selection", on_styled, {}),
    ("make_uv_map", on_hidden_sphere, {}),
    ("toggle_composite", on_vellus, {}),
    ("bake_dynamics", on_late_dynamics, {}),
    ("bake_dynamics", on_blind_dynamics, {}),
    ("deliver_dynamics", on_dynamics, {}),
    ("use_points", on_hair, {}),
]


@pytest.mark.parametrize("name, begin, settings", share_of_rows(REFUSED, 2))
def test_a_refusal_changes_nothing(hair, tmp_path, name, begin, settings):
    FOLDER[:] = [tmp_path]
    begin(np.random.default_rng(1))
    bpy.context.view_layer.update()
    before, files = file_digest.of_file(), folder_digest.of_folder(tmp_path)
    with pytest.raises(RuntimeError) as refused:
        run(name, settings, tmp_path)
    assert "Traceback" not in str(refused.value)
    assert file_digest.changes(before, file_digest.of_file()) == {}
    assert folder_digest.of_folder(tmp_path) == files


def test_settings_that_the_interface_refuses_leave_the_surface_as_it_was(hair, tmp_path):
    FOLDER[:] = [tmp_path]
    on_bare_mesh(None)
    before = file_digest.of_file()
    with pytest.raises(HairError, match="nope"):
        api.add_hair(things("Other"), api.GroomSettings(api.GuideSettings(density_group="nope")))
    with pytest.raises(HairError, match="landmarks"):
        api.transfer_groom(bpy.data.hair_curves["Hair"], things("Other"), method="LANDMARKS")
    assert file_digest.changes(before, file_digest.of_file()) == {}


def test_a_mask_that_was_never_painted_is_saved_and_transferred(hair, tmp_path):
    """A mask that was never painted, whose vertex group has no vertices, is saved and transferred."""
    on_styled(None)
    bpy.ops.vellus.paint_style_mask()
    bpy.ops.object.mode_set(mode="OBJECT")
    mask = bpy.data.hair_curves["Hair"].vellus.styles[0].curl.mask
    save_groom(tmp_path / "saved.blend")
    masks = groom_library.read(tmp_path / "saved.blend").masks
    assert [*masks] == [mask] and not masks[mask].any()
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, location=(4.0, 0.0, 0.0))
    other = bpy.context.object
    api.transfer_groom(bpy.data.hair_curves["Hair"], other)
    assert mask in other.vertex_groups and not any(vertex.groups for vertex in other.data.vertices)
