# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking: a light's rules, compared with Cycles."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.pictures import light_linking
from hair_addon.blender.data.pictures.drawn_meshes import owner_of

PLACES = ("plain", "inner", "instanced", "other")


@pytest.fixture
def tiles(scene):
    """Return white tiles side by side under a sun, rendered by Cycles from above; an empty instances the third."""
    mesh = bpy.data.meshes.new("Tile")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], [(0, 1, 2, 3)])
    held = bpy.data.collections.new("Held")
    for index, name in enumerate(PLACES):
        tile = bpy.data.objects.new(name, mesh)
        (held if name == "instanced" else scene.collection).objects.link(tile)
        if name != "instanced":
            tile.location.x = index
    instancer = bpy.data.objects.new("instancer", None)
    instancer.instance_type, instancer.instance_collection, instancer.location.x = "COLLECTION", held, 2
    child, deeper = bpy.data.collections.new("Child"), bpy.data.collections.new("Deeper")
    child.children.link(deeper)
    deeper.objects.link(bpy.data.objects["inner"])
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", 4.0
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.location = 2.0, 0.5, 3.0
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    for new in (instancer, scene.camera, sun):
        scene.collection.objects.link(new)
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 16, 4
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.cycles.samples, scene.cycles.max_bounces, scene.cycles.filter_width = 1, 0, 0.01
    scene.cycles.use_denoising = False
    sun.light_linking.receiver_collection = bpy.data.collections.new("Receivers")
    return sun


# Objects and collections that receivers are linked to, by name, with the state of each link.
RULES = {
    "nothing": {},
    "one included": {"plain": "INCLUDE"},
    "one excluded": {"plain": "EXCLUDE"},
    "both": {"plain": "INCLUDE", "other": "EXCLUDE"},
    "a collection included": {"Child": "INCLUDE"},
    "a collection excluded": {"Child": "EXCLUDE"},
    "one in an excluded collection included": {"Child": "EXCLUDE", "inner": "INCLUDE"},
    "one in an included collection excluded": {"Child": "INCLUDE", "inner": "EXCLUDE"},
    "the instanced included": {"instanced": "INCLUDE"},
    "the instanced excluded": {"instanced": "EXCLUDE"},
    "the instancer included": {"instancer": "INCLUDE"},
    "the instancer excluded": {"instancer": "EXCLUDE"},
    "the instancer excluded, the instanced included": {"instancer": "EXCLUDE", "instanced": "INCLUDE"},
}


@pytest.mark.parametrize("name", RULES)
def test_rules_hold_as_in_cycles(tiles, tmp_path, name):
    receivers = tiles.light_linking.receiver_collection
    for linked, state in RULES[name].items():
        if linked in bpy.data.objects:
            receivers.objects.link(bpy.data.objects[linked])
            item = receivers.collection_objects[len(receivers.collection_objects) - 1]
        else:
            receivers.children.link(bpy.data.collections[linked])
            item = receivers.collection_children[len(receivers.collection_children) - 1]
        item.light_linking.link_state = state
    render = bpy.context.scene.render
    render.filepath = str(tmp_path / "tiles.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath)
    row = np.array(image.pixels[:]).reshape(4, 4, 4, 4)[..., 0].mean(axis=(0, 2))
    lit, _blocking = light_linking.read_links(tiles)
    owners = {
        instance.object.name: owner_of(instance)[1::-1]
        for instance in bpy.context.evaluated_depsgraph_get().object_instances
        if instance.object.type == "MESH"
    }
    assert {place: lit.has(owners[place]) for place in PLACES} == dict(zip(PLACES, row > 0.01, strict=True))
