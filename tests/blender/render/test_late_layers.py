# SPDX-License-Identifier: GPL-3.0-or-later
"""Viewports bake the tables of a map of the radial roughness in the background, at most one within a redraw."""

import threading

import bpy
import numpy as np
import pytest

from hair_addon.blender.gpu.hair_shading import Shading
from hair_addon.blender.host import running
from hair_addon.blender.live import invalidation, live_hair
from hair_addon.blender.render import drawn_scene, hair_cache, late_layers
from hair_addon.blender.settings import map_items
from hair_addon.core.errors import HairError
from hair_addon.core.maps.map_settings import MapSettings
from hair_addon.core.shading.tables import look_tables
from tests.support.interface.layout import draw


@pytest.fixture
def baked(lit, monkeypatch):
    """Return names of the threads that have baked tables, of hair whose radial roughness varies from 0.25 to 0.5."""
    state = lit.data.vellus
    state.model, state.marschner.size, state.appearance.radial_roughness = "MARSCHNER", 16, 0.25
    map_items.keep(state, MapSettings(setting="look.radial_roughness", kind="STRAND", low=1.0, high=2.0))
    bpy.context.view_layer.update()
    monkeypatch.setattr(running, "has_window", lambda: True)
    found, real = [], look_tables.bake
    monkeypatch.setattr(look_tables, "bake", lambda *given: found.append(_thread()) or real(*given))
    yield found
    live_hair.cancel_writing()
    invalidation.clear()


def _thread():
    return "redraw" if threading.current_thread() is threading.main_thread() else "background"


def shown(hair, waits=False) -> Shading:
    """Return the shading that a viewport shows."""
    return hair_cache.shading_of(hair.data, hair_cache.strands_on_gpu(hair.data), waits=waits)


def settle():
    """Wait until all tables are baked."""
    while late_layers.parts() is not None:
        for baking in late_layers._jobs:
            baking.job.wait()
        late_layers.look()


def released(monkeypatch):
    """Return an event for which the background waits before it bakes, so that it is late at any processor speed."""
    event, real = threading.Event(), look_tables.bake

    def bake(*given):
        assert _thread() == "redraw" or event.wait(60.0)
        return real(*given)

    monkeypatch.setattr(look_tables, "bake", bake)
    return event


def layers_of(shading):
    return np.array(shading.samplers["n_slices"].read()) if shading.is_radial else None


def test_a_redraw_bakes_one_table_and_others_follow(lit, baked):
    first = shown(lit)
    assert baked.count("redraw") == 1 and not first.is_radial
    settle()
    assert baked.count("redraw") == 1 and len(baked) == 5
    assert late_layers.has_new() and not late_layers.has_new()
    last = shown(lit)
    assert last.is_radial and len(baked) == 5 and late_layers.parts() is None
    hair_cache.shading_cache.clear()
    np.testing.assert_array_equal(layers_of(last), layers_of(shown(lit, waits=True)))
    assert not len(late_layers.request_cache)


def test_a_slider_bakes_one_table_for_each_value_and_stops_for_former_ones(lit, baked, monkeypatch):
    look, is_released = lit.data.vellus.appearance, released(monkeypatch)
    for roughness in (0.2, 0.25, 0.3, 0.35):
        look.roughness = roughness
        bpy.context.view_layer.update()
        shown(lit)
    assert baked.count("redraw") == 4
    is_released.set()
    settle()
    assert shown(lit).is_radial
    # Each thread ends after the layer that it bakes.
    assert len(baked) <= 4 + 4 + 4


def test_viewports_show_the_first_and_last_layer_until_all_are_baked(lit, baked):
    shown(lit)
    ((request,)) = late_layers.request_cache.values()
    settle()
    for arguments in request.wanted[1:-1]:
        late_layers.layer_cache.invalidate(arguments)
    assert late_layers.has_new()
    coarse = shown(lit)
    assert coarse.is_radial and len(late_layers.request_cache) == 1
    settle()
    assert late_layers.has_new() and shown(lit) is not coarse


def test_a_range_that_grows_keeps_the_layers_so_far(lit, baked, monkeypatch):
    """Without its last layer hair is drawn by the others, and no table is baked within the redraw."""
    shown(lit)
    settle()
    shown(lit)
    map_items.keep(lit.data.vellus, MapSettings(setting="look.radial_roughness", kind="STRAND", low=1.0, high=2.2))
    bpy.context.view_layer.update()
    is_released = released(monkeypatch)
    grown = shown(lit)
    assert grown.is_radial and baked.count("redraw") == 1 and late_layers.parts() == (5, 6)
    is_released.set()
    settle()
    assert late_layers.has_new() and len(baked) == 6 and len(layers_of(shown(lit))) > len(layers_of(grown))


def test_a_viewport_reads_looks_without_waiting(lit, baked):
    areas = bpy.context.window_manager.windows[0].screen.areas
    viewport = next(area.spaces.active for area in areas if area.type == "VIEW_3D")
    context, depsgraph = bpy.context, bpy.context.evaluated_depsgraph_get()
    drawn_scene.read(context.scene, context.view_layer, depsgraph, viewport)
    assert baked.count("redraw") == 1
    bpy.context.view_layer.objects.active = lit
    assert "of 5 tables are baked" in " ".join(draw(bpy.types.VELLUS_PT_shading).texts)
    ((_strands, shading, *_rest),) = drawn_scene.read_render(depsgraph, {}, None, None).hair
    assert shading.is_radial
    settle()
    drawn_scene.read(context.scene, context.view_layer, depsgraph, viewport)
    assert not len(late_layers.request_cache)
    assert "tables" not in " ".join(draw(bpy.types.VELLUS_PT_shading).texts)


def test_failed_tables_are_said_and_leave_a_picture(lit, baked, monkeypatch, capsys):
    real = look_tables.bake

    def bake(*given):
        if _thread() == "background":
            raise HairError("No memory for tables.")
        return real(*given)

    monkeypatch.setattr(look_tables, "bake", bake)
    assert not shown(lit).is_radial
    settle()
    assert not shown(lit).is_radial and "No memory for tables." in "".join(capsys.readouterr())
