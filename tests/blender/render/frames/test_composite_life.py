# SPDX-License-Identifier: GPL-3.0-or-later
"""Composite Hair holds if its scenes are copied or deleted, its hair is linked, or the add-on is disabled."""

import bpy
import numpy as np
import pytest

import hair_addon
from hair_addon.blender.host import running
from hair_addon.blender.live import handlers, refused_hair
from hair_addon.blender.render.frames import composite
from hair_addon.blender.ui import menus
from tests.support.interface.layout import draw
from tests.support.pictures.rendering import configure


@pytest.fixture
def composited(lit):
    """Return the hairy sphere in a scene of Cycles, with Composite Hair on."""
    bpy.context.scene.render.engine = "CYCLES"
    bpy.ops.vellus.toggle_composite()
    return lit


def copied(kind):
    """Copy the scene and make the copy active, with another first frame."""
    bpy.ops.scene.new(type=kind)
    scene = bpy.context.scene
    scene.frame_start = 7
    bpy.context.view_layer.update()
    handlers.before_reading()  # as a render and a save do
    return scene


def node_of(scene):
    return next(n for n in scene.compositing_node_group.nodes if n.name == "Vellus Hair")


@pytest.mark.parametrize("kind", ["LINK_COPY", "FULL_COPY"])
def test_a_copied_scene_has_hair_of_its_own(composited, kind):
    scene = bpy.context.scene
    hair_scene = scene.vellus.hair_scene
    copy = copied(kind)
    assert copy.vellus.hair_scene.background_set == copy and node_of(copy).scene == copy.vellus.hair_scene
    assert (hair_scene.background_set, hair_scene.frame_start) == (scene, scene.frame_start)
    assert scene.vellus.hair_scene == node_of(scene).scene == hair_scene
    assert copy.vellus.hair_scene.frame_start == 7
    bpy.ops.vellus.toggle_composite()
    assert copy.vellus.hair_scene is None and len(bpy.data.scenes) == 3
    assert scene.vellus.hair_scene == hair_scene and not composited.visible_camera


def test_a_copy_that_only_a_change_of_its_frame_shows_is_repaired_soon(composited):
    """A window may show a copied scene by changing its frame alone: a timer repairs it, without another update."""
    copy = bpy.context.scene.copy()
    if bpy.app.timers.is_registered(composite.repair):
        bpy.app.timers.unregister(composite.repair)
    copy.frame_set(5)
    assert bpy.app.timers.is_registered(composite.repair)
    bpy.app.timers.unregister(composite.repair)
    assert composite.needs_repair(copy)
    assert composite.repair() is None
    assert not composite.needs_repair(copy)


def test_a_scene_with_copied_settings_alone_leaves_the_hair_s_scene_to_the_other(composited):
    scene = bpy.context.scene
    empty = copied("EMPTY")
    assert empty.vellus.hair_scene is None
    assert scene.vellus.hair_scene.frame_start == scene.frame_start


def test_it_is_turned_off_after_the_render_that_runs(composited, monkeypatch):
    """The thread of a render reads the nodes, so they are removed after its end."""
    scene = bpy.context.scene
    bpy.data.scenes.remove(scene.vellus.hair_scene)
    with monkeypatch.context() as patch:
        patch.setattr(running, "is_rendering", lambda: True)
        assert composite.repair() > 0.0
    assert node_of(scene)
    assert composite.repair() is None
    assert scene.compositing_node_group is None and composited.visible_camera


def test_deleting_the_hair_s_scene_turns_it_off(composited):
    scene = bpy.context.scene
    bpy.data.scenes.remove(scene.vellus.hair_scene)
    bpy.context.view_layer.update()
    handlers.before_reading()
    assert composited.visible_camera and scene.compositing_node_group is None


def test_a_file_hides_linked_hair_as_soon_as_it_is_open(composited, tmp_path):
    """Linked hair is hidden as soon as a file is opened, because the file does not store its ray visibility."""
    bpy.ops.vellus.toggle_composite()
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {composited})
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_there, here):
        here.objects = ["Hair"]
    linked = here.objects[0]
    bpy.context.scene.collection.objects.link(linked)
    bpy.ops.vellus.toggle_composite()
    assert not linked.visible_camera
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    hair = [o for o in bpy.data.objects if o.name == "Hair"]
    assert len(hair) == 2 and not any(o.visible_camera for o in hair)


def test_without_the_add_on_engines_render_their_own_hair(composited):
    scene = bpy.context.scene
    hair_addon.unregister()
    try:
        assert composited.visible_camera and node_of(scene).mute
    finally:
        hair_addon.register()
    handlers._take_over()  # Blender's timer, which does not run without a window
    assert not composited.visible_camera and not node_of(scene).mute


def test_hair_is_laid_over_the_view_layer_that_it_is_rendered_with(composited):
    """Hair is composited over the first view layer, which is what Blender renders of a background scene."""
    bpy.ops.vellus.toggle_composite()
    scene = bpy.context.scene
    first = scene.view_layers[0].name
    scene.view_layers.new("Front")
    tree = scene.compositing_node_group = bpy.data.node_groups.new("Layers", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    over, output = tree.nodes.new("CompositorNodeAlphaOver"), tree.nodes.new("NodeGroupOutput")
    for layer, socket in (("Front", "Foreground"), (first, "Background")):
        node = tree.nodes.new("CompositorNodeRLayers")
        node.scene, node.layer = scene, layer
        tree.links.new(node.outputs["Image"], over.inputs[socket])
    tree.links.new(over.outputs["Image"], output.inputs["Image"])
    bpy.ops.vellus.toggle_composite()
    shaded = next(link for link in tree.links if link.to_node.name == "Vellus Hair Shadow" and not link.is_muted)
    assert shaded.from_node.layer == first


def test_the_first_view_layer_that_is_rendered_has_the_surfaces(composited):
    bpy.ops.vellus.toggle_composite()
    scene = bpy.context.scene
    scene.view_layers.new("Front")
    scene.view_layers[0].use = False
    assert scene.compositing_node_group is None
    bpy.ops.vellus.toggle_composite()
    nodes = scene.compositing_node_group.nodes
    (rendered,) = [n for n in nodes if n.bl_idname == "CompositorNodeRLayers" and n.scene == scene]
    assert rendered.layer == "Front"


def test_frames_that_are_not_baked_are_refused_in_the_hair_s_scene_too(composited, tmp_path, capfd):
    """Frames that are not baked are refused in the hair's scene as well; a window shows the message after the
    render.
    """
    scene = bpy.context.scene
    bpy.data.objects["Guides"].data.vellus.simulates = True
    configure(engine="CYCLES", resolution_x=8, resolution_y=6, film_transparent=True, use_compositing=True)
    scene.cycles.samples, scene.frame_start, scene.frame_end = 1, 1, 2
    bpy.data.objects["Sphere"].hide_render = True  # what Cycles sees is empty: the picture is the hair
    scene.render.filepath = str(tmp_path / "frame_")
    bpy.ops.render.render(animation=True)
    refusal = 'Frame 2 of the guides "Guides" is not baked: bake their dynamics first.'
    assert refusal in "".join(capfd.readouterr())
    assert bpy.app.timers.is_registered(refused_hair.offer)
    bpy.app.timers.unregister(refused_hair.offer)
    assert draw(menus.VELLUS_MT_refused_hair).texts == [refusal]
    found = [bpy.data.images.load(str(tmp_path / f"frame_000{frame}.png")) for frame in (1, 2)]
    first, second = (np.reshape(image.pixels, (-1, 4))[:, 3].max() for image in found)
    assert first > 0.1 and second == 0.0


def test_a_scene_of_an_artist_is_never_deleted_or_changed(composited):
    """A scene without the add-on's mark is never deleted or changed, whatever the setting points to."""
    scene = bpy.context.scene
    own = bpy.data.scenes.new("Own")
    own.background_set, own.frame_start = scene, 3
    own.collection.objects.link(bpy.data.objects["Sphere"])
    scene.vellus.hair_scene = own
    bpy.context.view_layer.update()
    handlers.before_reading()
    bpy.ops.vellus.toggle_composite()
    assert bpy.data.scenes.get("Own") == own and own.frame_start == 3 and len(own.objects) == 1


def test_objects_that_are_put_into_the_hair_s_scene_stay_in_it(composited):
    scene = bpy.context.scene
    hair_scene = scene.vellus.hair_scene
    lamp = bpy.data.objects.new("Rim", bpy.data.lights.new("Rim", "AREA"))
    hair_scene.collection.objects.link(lamp)
    bpy.ops.vellus.toggle_composite()
    assert lamp.users_scene == (hair_scene,) and scene.vellus.hair_scene is None
    bpy.ops.vellus.toggle_composite()
    assert scene.vellus.hair_scene != hair_scene
    bpy.ops.vellus.toggle_composite()
    assert len(bpy.data.scenes) == 2 and [*hair_scene.objects] == [lamp]


@pytest.mark.parametrize("is_other", [False, True])
def test_another_background_set_makes_no_scenes(composited, is_other):
    scene = bpy.context.scene
    hair_scene, other = scene.vellus.hair_scene, bpy.data.scenes.new("Other")
    for _ in range(3):
        hair_scene.background_set = other if is_other else None
        bpy.context.view_layer.update()
        handlers.before_reading()
    assert len(bpy.data.scenes) == 3 and scene.vellus.hair_scene == hair_scene
    assert hair_scene.background_set == scene
    bpy.ops.vellus.toggle_composite()
    assert {*bpy.data.scenes} == {scene, other}
