# SPDX-License-Identifier: GPL-3.0-or-later
"""After a change only hair that is combed is read again, otherwise the whole scene."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.pictures import drawn_meshes
from hair_addon.blender.gpu import ambient_visibility
from hair_addon.blender.host import running
from hair_addon.blender.live import live_hair
from hair_addon.blender.render import drawn_scene, hair_cache
from hair_addon.blender.render.viewport import viewport
from hair_addon.blender.settings import style_items
from hair_addon.core.styling import lean
from tests.support.pictures.viewports import context_of, view3d
from tests.support.reading import points, write_points


@pytest.fixture
def forgotten(hair, monkeypatch):
    """Return for each update whether it counts as a change of hair only."""
    bpy.ops.object.light_add(type="SUN")
    bpy.context.view_layer.update()
    reported = []
    monkeypatch.setattr(viewport, "invalidate", lambda is_hair_only=False, *_others: reported.append(is_hair_only))
    return reported


def comb(guides):
    combed = points(guides)
    combed[3, 1:] += np.float32([0.0, 0.01, 0.02])
    write_points(guides, combed)


def test_combing_changes_hair_only(hair, forgotten):
    comb(bpy.data.objects["Guides"])
    bpy.context.view_layer.update()
    assert forgotten and all(forgotten)


CHANGES = {
    "a light moves": lambda hair: setattr(bpy.data.objects["Sun"], "location", (1.0, 2.0, 3.0)),
    "a light is brighter": lambda hair: setattr(bpy.data.lights["Sun"], "energy", 7.0),
    "a light is hidden": lambda hair: setattr(bpy.data.objects["Sun"], "hide_viewport", True),
    "the hair moves": lambda hair: setattr(hair, "location", (0.1, 0.0, 0.0)),
    "the surface moves": lambda hair: setattr(hair.data.surface, "location", (0.1, 0.0, 0.0)),
    "the surface is another": lambda hair: hair.data.surface.data.update_tag() or hair.data.surface.data.flip_normals(),
    "another world": lambda hair: setattr(bpy.context.scene, "world", bpy.data.worlds.new("Blue")),
    "a light is gone": lambda hair: bpy.data.objects.remove(bpy.data.objects["Sun"]),
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_else_changes_is_read_again(change, hair, forgotten):
    CHANGES[change](hair)
    bpy.context.view_layer.update()
    assert False in forgotten


def key(owner, name, values):
    for frame, value in enumerate(values, start=1):
        setattr(owner, name, value)
        owner.keyframe_insert(name, frame=frame)


MOVING = {
    "nothing": (lambda hair: None, True),
    "a camera": (lambda hair: key(bpy.data.objects["Camera"], "location", [(0, 0, 1), (0, 0, 2), (0, 0, 3)]), True),
    "a light": (lambda hair: key(bpy.data.lights["Sun"], "energy", [1.0, 2.0, 3.0]), False),
    "what is hidden": (lambda hair: key(hair.data.surface, "hide_viewport", [False, True, False]), False),
    "the hair": (lambda hair: key(hair, "location", [(0, 0, 1), (0, 0, 2), (0, 0, 3)]), False),
    "an image": (lambda hair: setattr(bpy.data.images.new("Film", 4, 4), "source", "SEQUENCE"), False),
}


@pytest.mark.parametrize("moving", MOVING)
def test_a_frame_in_which_only_hair_may_move_reads_hair_alone(moving, hair, forgotten):
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")))
    animate, is_hair_only = MOVING[moving]
    animate(hair)
    bpy.context.scene.frame_set(1)
    for frame in (2, 3):
        forgotten.clear()
        bpy.context.scene.frame_set(frame)
        assert all(forgotten) == is_hair_only


def test_a_stroke_reads_no_surfaces_and_draws_coarse_shadows(lit, monkeypatch):
    calls = []

    def counted(module, name):
        real = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *args, **kwargs: (calls.append(name), real(*args, **kwargs))[1])

    def read(**details):
        context = bpy.context
        calls.clear()
        return drawn_scene.read(context.scene, context.view_layer, context.evaluated_depsgraph_get(), **details)

    before = read()
    counted(drawn_meshes, "read_drawn_meshes")
    counted(ambient_visibility, "measure")
    comb(bpy.data.objects["Guides"])
    draft = read(before=before, is_draft=True)
    assert calls == []
    assert draft.surfaces is before.surfaces
    whole = read(before=draft)
    assert calls == ["measure"]
    afresh = read()
    assert calls == ["read_drawn_meshes", "measure"]
    for name, texture in whole.shadow_maps.samplers.items():
        np.testing.assert_array_equal(texture.read(), afresh.shadow_maps.samplers[name].read())
    for name, texture in whole.hair_visibility[0].items():
        np.testing.assert_array_equal(texture.read(), afresh.hair_visibility[0][name].read())


def shown(is_rendered):
    """Return the `DrawnScene` of a viewport, in Material Preview or in our own Rendered shading, with the lamps."""
    space = view3d()
    bpy.context.scene.render.engine = "VELLUS"
    space.shading.type = "RENDERED" if is_rendered else "MATERIAL"
    space.shading.use_scene_lights = space.shading.use_scene_world = True
    return viewport.drawn_scene_of(context_of(space))


LAMP_CHANGES = {
    "moves": lambda: setattr(bpy.data.objects["Sun"], "rotation_euler", (1.0, 0.4, 0.2)),
    "is brighter": lambda: setattr(bpy.data.lights["Sun"], "energy", 7.0),
    "is hidden": lambda: setattr(bpy.data.objects["Sun"], "hide_viewport", True),
    "is another": lambda: setattr(bpy.data.lights["Sun"], "type", "POINT"),
}


@pytest.mark.parametrize("is_rendered", [False, pytest.param(True, marks=pytest.mark.long)])
def test_lamps_that_change_leave_hair_and_surfaces_as_they_were(lit, monkeypatch, is_rendered):
    """After changes of lamps no mesh is read and no visibility measured; lights and maps are those of a whole reading.

    Then a surface that moves is read again.
    """
    bpy.ops.object.light_add(type="SUN")
    bpy.context.view_layer.update()
    shown(is_rendered)
    calls = []
    for owner, name in ((ambient_visibility, "measure"), (drawn_meshes, "read_drawn_meshes")):
        real = getattr(owner, name)
        monkeypatch.setattr(owner, name, lambda *given, real=real, **named: calls.append(1) or real(*given, **named))
    for change in ("moves", "is brighter", "is another"):
        LAMP_CHANGES[change]()
        bpy.context.view_layer.update()
        relit = shown(is_rendered)
        assert not calls, change
        maps = {name: np.array(texture.read()) for name, texture in relit.shadow_maps.samplers.items()}
        viewport.invalidate()
        whole = shown(is_rendered)
        assert calls
        calls.clear()
        assert relit.lights.tobytes() == whole.lights.tobytes()
        for name, texture in whole.shadow_maps.samplers.items():
            np.testing.assert_array_equal(maps[name], np.array(texture.read()))
    lit.data.surface.location.x += 0.1
    LAMP_CHANGES["moves"]()
    bpy.context.view_layer.update()
    LAMP_CHANGES["is hidden"]()
    bpy.context.view_layer.update()
    shown(is_rendered)
    assert calls


def test_hair_whose_style_reads_a_lamp_is_read_again(lit, monkeypatch):
    """Hair that leans along the axis of a lamp is drawn in its new shape as soon as the lamp turns."""
    monkeypatch.setattr(running, "has_window", lambda: True)
    style_items.assign(lit.data.vellus, [lean.Settings(direction="OBJECT", target="Sun")])
    bpy.context.view_layer.update()
    live_hair.write_all()
    bpy.context.view_layer.update()
    before = shown(is_rendered=False).hair[0][0].texture.read()
    LAMP_CHANGES["moves"]()
    bpy.context.view_layer.update()
    followed = shown(is_rendered=False).hair[0][0].texture.read()
    live_hair.write_all()
    assert not np.array_equal(before, followed)
    np.testing.assert_array_equal(followed, hair_cache.strands_on_gpu(lit.data).texture.read())
