# SPDX-License-Identifier: GPL-3.0-or-later
"""Any value for any argument of the functions for scripts, and for any property, works or raises `HairError`.

Afterwards the file contains no incomplete hair, it can be saved and drawn, and an undo works. VELLUS_TEST_STEPS sets
the number of calls.
"""

import math
import os
import random
from fractions import Fraction

import bpy
import numpy as np

from hair_addon import api
from hair_addon.api import guide_tools
from hair_addon.blender.live import live_hair
from hair_addon.core.files import settings_file
from hair_addon.core.grooming import guide_tool_settings
from hair_addon.core.imaging.pixel_sampling import DRAWING_FIELDS, FRAME_FIELDS, PictureSettings
from hair_addon.core.params import declared
from hair_addon.core.shading.tables import lookup_tables
from hair_addon.core.styling.kinds import KINDS, OFFERS
from tests.support.dynamics.following import update
from tests.support.reading import everything, points

FOREIGN = "Foreign"  # curves not created by Vellus

STEPS = int(os.environ.get("VELLUS_TEST_STEPS", "60"))

NUMBERS = [0, 1, -1, 2, 7, 0.5, 1e-300, 1e-30, 1e-9, 1e6, 1e30, 1e300, -1e300, 2**31 - 1, 2**31, 10**400, math.pi]
NUMBERS += [math.nan, math.inf, -math.inf, True, np.int8(3), np.float32(0.25), np.float16(2), Fraction(1, 3), 5e-324]
OTHERS = [
    None,
    "",
    "top",
    "x" * 300,
    "\udcff",
    "a\0b",
    b"top",
    "BLOND",
    "MARSCHNER",
    "energy",
    "COLOR",
    1j,
    [],
    {},
    set(),
]
OTHERS += [
    np.zeros(3),
    np.ones((2, 2)),
    np.array(None),
    (0, 0, 0),
    [1, 1, 1],
    (1, 2),
    object(),
    print,
    range(3),
    NUMBERS,
]

# Largest values of arguments that would otherwise take long or fill memory.
COSTLY = {
    "guide_count": 40,
    "strand_count": 100,
    "relax_iterations": 3,
    "size": 32,
    "width": 24,
    "height": 24,
    "samples_per_side": 2,
    "sample_count": 2,
    "factor": 1.5,
    "vertex_count": 9,
    "preroll": 2,
}


def extremes(default, details):
    """Return an end of a setting's range, sometimes a value just beyond."""
    if isinstance(default, bool | str):
        return [not default] if isinstance(default, bool) else [choice[0] for choice in details.choices] or [default]
    ends = [v for v in (details.low, details.high, details.soft_high) if math.isfinite(v)] or [default]
    above = details.above if math.isfinite(details.above) else details.low
    found = [*ends, *ends, math.nextafter(above, math.inf), math.nextafter(details.high, math.inf)]
    return [tuple([value] * len(default)) for value in found] + found if isinstance(default, tuple) else found


def value_for(dice, name, default, details):
    kind = dice.random()
    value = dice.choice(extremes(default, details) if kind < 0.85 else NUMBERS if kind < 0.93 else OTHERS)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return COSTLY[name] if name in COSTLY and is_number and value > COSTLY[name] else value


def changes(dice, settings_class, cheap, skip=()):
    known = [(name, *declaration) for name, *declaration in declared(settings_class) if name not in skip]
    declarations = {name: (default, details) for name, default, details in known}
    chosen = dice.sample(sorted(declarations), dice.randint(0, 2))
    found = {name: value for name, value in COSTLY.items() if name in declarations and name in cheap}
    return found | {name: value_for(dice, name, *declarations[name]) for name in chosen}


def target(dice, kind):
    """Return a target that is mostly valid."""
    of_kind = [o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == kind]
    of_kind += [o for o in bpy.data.objects if kind == "MESH" and o.type == "MESH"]
    return dice.choice(of_kind if dice.random() < 0.85 else [*bpy.data.objects, dice.choice(OTHERS)])


def settings(dice):
    """Return random settings of a groom; most are valid."""
    if dice.random() < 0.1:
        return dice.choice(OTHERS)
    parts = {}
    for section, settings_class in settings_file.SECTIONS.items():
        if dice.random() < 0.3:
            parts[section] = settings_class(**changes(dice, settings_class, COSTLY))
    if dice.random() < 0.3:
        parts["styles"] = anything(dice, [style(dice) for _ in range(dice.randint(0, 3))])
    few = {"guides": api.GuideSettings(guide_count=20), "hair": api.HairSettings(strand_count=50)}
    return api.GroomSettings(**(few | parts))


def style(dice):
    """Return the settings of a style."""
    settings_class = dice.choice([*KINDS.values()])
    return settings_class(**changes(dice, settings_class, ()))


def add_style(dice):
    kind = dice.choice([*OFFERS])
    details = {"name": anything(dice, "", "A"), "fit": anything(dice, False, True)}
    changed = changes(dice, KINDS[OFFERS[kind].kind], ())
    return api.add_style(target(dice, "HAIR"), anything(dice, kind), **details, **changed)


def change_guides(dice):
    tool = dice.choice([*guide_tools.TOOLS])
    changed = changes(dice, guide_tools.TOOLS[tool], ())
    return api.change_guides(target(dice, "GUIDES"), anything(dice, tool), **changed)


def paint_flow(dice):
    stroke = anything(dice, [(0.0, 0.0, 1.0), anything(dice, (0.2, 0.0, 1.0), (0.0, 0.0, 1.0))], np.zeros((0, 3)))
    return api.paint_flow(target(dice, "GUIDES"), stroke, **changes(dice, guide_tool_settings.FlowSettings, ()))


def anything(dice, *often):
    return dice.choice(OTHERS + NUMBERS) if dice.random() < 0.15 else dice.choice(often)


def simulate(dice):
    """Simulate all frames of guides on a mesh of arrays."""
    mesh = np.eye(3), [[0, 1, 2]]
    guides = anything(dice, api.distribute_guides(mesh, guide_count=3))
    poses = anything(dice, [np.eye(3)] * 2, [np.eye(3), anything(dice, 2.0 * np.eye(3))])
    details = {"gravity": anything(dice, (0, 0, -1)), "regions": anything(dice, None, [0, 1, 1])}
    details["held"] = anything(dice, None, [0.5, 0.0, 1.0])
    changed = changes(dice, api.DynamicsSettings, ("vertex_count", "preroll"))
    return [*api.simulate(poses, mesh[1], guides, frame_rate=anything(dice, 24), **(details | changed))]


def hair_of_arrays(dice):
    """Grow strands with styles on a mesh of arrays."""
    mesh = np.eye(3), [[0, 1, 2]]
    guides = anything(dice, api.distribute_guides(mesh, guide_count=3))
    masks = anything(dice, None, {"top": anything(dice, [0, 1, 1])})
    styles = anything(dice, [style(dice)], [api.Clump(mask="top"), api.Curl()])
    return api.interpolate_hair(
        guides, mesh=anything(dice, mesh), styles=styles, masks=masks, **changes(dice, api.HairSettings, COSTLY)
    )


def bake(dice):
    """Replace the frame range by a few frames, as a million frames are valid but slow."""
    guides = target(dice, "GUIDES")
    if isinstance(guides, bpy.types.Object) and guides.type == "CURVES" and guides.data.vellus.dynamics.start_frame < 0:
        guides.data.vellus.dynamics.start_frame = 1
    last = anything(dice, None, 2, 3)
    return api.bake_dynamics(guides, last, starts_over=anything(dice, False, True), progress=anything(dice, print))


def require_foreign_curves():
    """Create curves that are not guides, unless there are some: `use_as_guides` converts them."""
    shown = bpy.data.objects.get(FOREIGN)
    if shown is not None and shown.data.vellus.kind == "NONE":
        return
    if shown is not None:
        shown.name = "Used"
    curves = bpy.data.hair_curves.new(FOREIGN)
    curves.add_curves([4, 4])
    curves.attributes["position"].data.foreach_set("vector", np.linspace(0.0, 1.0, 24, dtype=np.float32))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(FOREIGN, curves))
    update()


def use_as_guides(dice):
    """Use curves as guides, in Blender or as arrays."""
    if dice.random() < 0.5:
        lines = [[(0.2, 0.2, 0.0), (0.2, 0.2, 0.1)], anything(dice, [(0.1, 0.1, 0.0), (0.1, 0.3, 0.1)])]
        return api.use_as_guides(anything(dice, lines), (np.eye(3), [[0, 1, 2]]), every=anything(dice, 1, 2))
    return api.use_as_guides(
        anything(dice, bpy.data.objects[FOREIGN], target(dice, "GUIDES")),
        anything(dice, None, target(dice, "MESH")),
        every=anything(dice, 1),
        applies_modifiers=anything(dice, True),
        progress=anything(dice, print),
    )


CALLS = {
    "simulate": simulate,
    "hair_of_arrays": hair_of_arrays,
    "use_as_guides": use_as_guides,
    "bake_dynamics": bake,
    "deliver_dynamics": lambda d: api.deliver_dynamics(target(d, "GUIDES"), progress=anything(d, print)),
    "remove_delivery": lambda d: api.remove_delivery(target(d, "GUIDES")),
    "distribute_guides": lambda d: api.distribute_guides(target(d, "MESH"), **changes(d, api.GuideSettings, COSTLY)),
    "interpolate_hair": lambda d: api.interpolate_hair(target(d, "GUIDES"), **changes(d, api.HairSettings, COSTLY)),
    "add_hair": lambda d: api.add_hair(target(d, "MESH"), settings(d)),
    "arrays": lambda d: api.distribute_guides(
        (anything(d, np.eye(3)), anything(d, [[0, 1, 2]])), **changes(d, api.GuideSettings, COSTLY)
    ),
    "change_guides": change_guides,
    "paint_flow": paint_flow,
    "layers": lambda d: api.layers(target(d, "GUIDES")),
    "add_layer": lambda d: api.add_layer(target(d, "GUIDES"), anything(d, "", "Combing")),
    "set_layer": lambda d: api.set_layer(
        target(d, "GUIDES"),
        anything(d, "Combing", "Other"),
        weight=anything(d, None, 0.0, 0.5, 2.0, 3.0),
        is_active=anything(d, False, True),
    ),
    "apply_layers": lambda d: api.apply_layers(target(d, "GUIDES")),
    "transfer_groom": lambda d: api.transfer_groom(
        target(d, d.choice(["GUIDES", "HAIR"])), target(d, "MESH"), **changes(d, api.TransferSettings, ())
    ),
    "points": lambda d: api.points(target(d, d.choice(["GUIDES", "HAIR"]))),
    "shade": lambda d: api.shade(
        target(d, "HAIR"),
        anything(d, None, "BLOND", api.Appearance()),
        model=anything(d, None, "KAJIYA_KAY", "MARSCHNER"),
        **changes(d, api.Appearance, ()),
    ),
    "table_settings": lambda d: api.table_settings(settings(d), **changes(d, lookup_tables.Settings, COSTLY)),
    "bake_tables": lambda d: api.bake_tables(
        anything(d, "tables"), has_plots=anything(d, False), **changes(d, lookup_tables.Settings, COSTLY)
    ),
    "draw": lambda d: api.draw(**changes(d, PictureSettings, COSTLY, FRAME_FIELDS)),
    "render": lambda d: api.render(
        anything(d, "a.png", "b_##.exr"),
        frame=anything(d, None, 1, 5),
        engine=anything(d, "vellus"),
        **changes(d, PictureSettings, COSTLY, DRAWING_FIELDS),
    ),
    "add_style": add_style,
    "styles_of": lambda d: api.styles_of(target(d, "HAIR")),
    "set_styles": lambda d: api.set_styles(target(d, "HAIR"), anything(d, [], [style(d)], [style(d), style(d)])),
    "apply_style_preset": lambda d: api.apply_style_preset(
        target(d, "HAIR"), anything(d, "CURLY", "BUZZ"), fit=anything(d, True), keep_styles=anything(d, False, True)
    ),
    "settings_of": lambda d: api.settings_of(target(d, "HAIR")),
    "save_settings": lambda d: api.save_settings(anything(d, "a.json"), settings(d)),
    "load_settings": lambda d: api.load_settings(anything(d, "a.json")),
    "dynamics_of": lambda d: api.dynamics_of(target(d, "GUIDES")),
    "set_dynamics": lambda d: api.set_dynamics(
        target(d, "GUIDES"),
        anything(d, None, "STYLED", api.DynamicsSettings()),
        simulates=anything(d, None, True),
        **changes(d, api.DynamicsSettings, ()),
    ),
    "export_groom": lambda d: api.export_groom(
        anything(d, "a.abc", "a.usdc"),
        anything(d, None, [target(d, "HAIR")]),
        **changes(d, api.ExportSettings, (), ("animation",)),
    ),
    "apply_settings": lambda d: api.apply_settings(target(d, "HAIR"), settings(d)),
}


def set_property(dice):
    """Set a property of a random hair's settings, which Blender may refuse."""
    hair = dice.choice([c for c in bpy.data.hair_curves if c.vellus.kind != "NONE"])
    groups = {"guides": api.GuideSettings, "hair": api.HairSettings, "appearance": api.Appearance}
    groups["dynamics"] = api.DynamicsSettings
    name, settings_class = dice.choice([*groups.items(), ("marschner", lookup_tables.Settings)])
    setting, default, details = dice.choice(declared(settings_class))
    if name == "marschner" and not hasattr(hair.vellus.marschner, setting):
        return
    value = value_for(dice, setting, default, details)
    if setting in COSTLY and (not isinstance(value, int | float) or value > COSTLY[setting]):
        return
    try:
        setattr(getattr(hair.vellus, name), setting, value)
    except (TypeError, ValueError, OverflowError):  # Blender's own answer
        return
    update()


def assert_whole():
    """Assert that all guides and hair are complete."""
    for shown in bpy.data.objects:
        if shown.type == "CURVES" and not shown.name.startswith(FOREIGN):
            assert shown.data.vellus.kind != "NONE" and len(shown.data.curves) > 0
            assert np.isfinite(points(shown)).all()
    assert all(curves.users for curves in bpy.data.hair_curves)
    assert not bpy.app.timers.is_registered(live_hair.write_after_pause)


def test_any_argument_works_or_is_refused(lit, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    dice = random.Random(int(os.environ.get("VELLUS_TEST_SEED", "5")))
    bpy.data.hair_curves["Guides"].vellus.cache_folder = "haircache"
    bpy.context.scene.frame_end = 3
    refusals = 0
    for step in range(STEPS):
        name = dice.choice([*CALLS, "property", "property", "undo"])
        require_foreign_curves()
        before = everything()
        state = dice.getstate()
        try:
            if name == "property":
                set_property(dice)
            elif name == "undo":
                bpy.ops.ed.undo_push(message="step")
                set_property(dice)
                bpy.ops.ed.undo_push(message="property")
                bpy.ops.ed.undo()
            else:
                CALLS[name](dice)
        except api.HairError as error:
            refusals += 1
            assert "\n" not in str(error), (step, name)
            assert everything() == before, (step, name, str(error))
        except BaseException as error:
            raise AssertionError(f"step {step}, {name}: {state[1][-1]}") from error
        assert_whole()
        if len(bpy.data.hair_curves) > 8:  # or every call would take longer than the one before
            for shown in [o for o in bpy.data.objects if o.type == "CURVES" and o.name not in ("Hair", "Guides")]:
                bpy.data.hair_curves.remove(shown.data)
            update()
        reported = capfd.readouterr()
        assert "Traceback" not in reported.err + reported.out, (step, name, reported)
    assert 0 < refusals < STEPS
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    for hair in (c for c in bpy.data.hair_curves if c.vellus.kind == "HAIR"):
        api.shade(hair, api.Appearance())
        hair.vellus.marschner.size = 16
    assert np.isfinite(api.draw(width=16, height=12, samples_per_side=1)).all()
