# SPDX-License-Identifier: GPL-3.0-or-later
"""In each engine, lone strands with a map have the color of hair with this single color."""

import itertools

import bpy
import numpy as np
import pytest
from mathutils import Vector

from hair_addon import api
from hair_addon.blender.data.maps import strand_maps
from hair_addon.blender.settings import map_items
from hair_addon.core.maps.map_settings import MapSettings
from hair_addon.core.shading.appearance import Appearance
from tests.support.pictures import rendering

COLORS = ((0.6, 0.25, 0.1), (0.1, 0.2, 0.5), (0.03, 0.02, 0.02))
COUNT, SIZE, WIDTH = 3, 64, 0.16
PITCH, DEPTH = 0.05, 3.0  # [m] between strands, across and along the view: they hardly light each other
# [m]: strands lie on centers of pixels. With a filter of size 0, EEVEE samples only centers, and leaves out strands
# between them, Blender's own curves too.
SHIFT = 0.5 * WIDTH / SIZE


@pytest.fixture
def strands(scene):
    """Return Curves of upright strands, side by side in the picture, with the attribute `own` of colors."""
    x = SHIFT + PITCH * (np.arange(COUNT) - 0.5 * (COUNT - 1))
    points = np.zeros((COUNT, 9, 3), np.float32)
    points[..., 0], points[..., 1] = x[:, None], DEPTH * np.arange(COUNT)[:, None]
    points[..., 2] = np.linspace(-0.6, 0.6, 9)
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([9] * COUNT)
    curves.set_types(type="POLY")
    curves.attributes["position"].data.foreach_set("vector", points.ravel())
    radius = curves.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(9 * COUNT, 0.001, np.float32))
    own = curves.attributes.new("own", "FLOAT_VECTOR", "CURVE")
    own.data.foreach_set("vector", np.float32([COLORS[strand % 3] for strand in range(COUNT)]).ravel())
    scene.collection.objects.link(bpy.data.objects.new("Hair", curves))
    curves.vellus.kind = "HAIR"
    rendering.add_orthographic_camera(scene)
    scene.camera.data.ortho_scale = WIDTH
    return curves


def light(scene, lamp):
    """Light the scene evenly, or by one lamp from the side."""
    rendering.light_up((0.0, 0.0, 0.0) if lamp else (0.8, 0.8, 0.8))
    if lamp:
        sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
        sun.data.energy, sun.data.angle = 8.0, 0.0
        sun.rotation_euler = Vector((0.5, 0.8, -0.4)).to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(sun)


def drawn(scattering):
    bpy.context.scene.vellus.multiple_scattering = scattering
    return api.draw(width=SIZE, height=SIZE, samples_per_side=2, is_transparent=True)


def frame_of(engine, folder):
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.seed = 64, False, 1
    scene.eevee.taa_render_samples, scene.render.hair_type = 4, "STRIP"
    settings = {"engine": engine, "film_transparent": True, "resolution_x": SIZE, "resolution_y": SIZE}
    return rendering.rendered(folder, **settings)["Combined"]


def averaged(found):
    """Return a picture of traced paths, which differ in single pixels: each strand has the mean of its pixels."""
    for columns in columns_of_strands():
        some = found[:, columns]
        some[some[..., 3] > 0.0] = some[some[..., 3] > 0.0].mean(axis=0)
    return found


ENGINES = {
    "Kajiya-Kay": ("KAJIYA_KAY", lambda _folder: drawn("DUAL")),
    "Marschner": ("MARSCHNER", lambda _folder: drawn("DUAL")),
    "paths": ("MARSCHNER", lambda _folder: averaged(drawn("GRID"))),
    "engine": ("MARSCHNER", lambda folder: frame_of("VELLUS", folder)),
    "Cycles": ("MARSCHNER", lambda folder: averaged(frame_of("CYCLES", folder))),
    "EEVEE": ("MARSCHNER", lambda folder: frame_of("BLENDER_EEVEE", folder)),
}
SHARE = {("Marschner", False)}
CASES = [
    pytest.param(name, lamp, marks=() if (name, lamp) in SHARE else pytest.mark.long)
    for name in ("Kajiya-Kay", "Marschner", "paths", "engine")
    for lamp in (False, True)
]
CASES += [pytest.param(name, lamp, marks=pytest.mark.farm) for name in ("Cycles", "EEVEE") for lamp in (False, True)]


def columns_of_strands():
    ends = np.round((PITCH * (np.arange(COUNT + 1) - 0.5 * COUNT) / WIDTH + 0.5) * SIZE).astype(int)
    return [slice(*pair) for pair in itertools.pairwise(ends)]


@pytest.mark.parametrize(("name", "lamp"), CASES)
def test_lone_strands_have_the_color_of_their_own_hair(strands, scene, tmp_path, name, lamp):
    """Pictures of strands with three colors by a map equal pictures of hair of each color within 1/255."""
    model, picture = ENGINES[name]
    light(scene, lamp)
    alone = []
    for color in COLORS:
        api.shade(strands, Appearance(parametrization="COLOR", color=color, random_color=0.0), model=model)
        strands.vellus.marschner.size = 32
        bpy.context.view_layer.update()
        alone.append(picture(tmp_path))
    map_items.keep(strands.vellus, MapSettings(setting="look.color", kind="CURVES", source="own"))
    strands.update_tag()
    bpy.context.view_layer.update()
    assert len(strand_maps.read_looks(strands)) == COUNT
    found, seen = picture(tmp_path), 0
    for strand, columns in enumerate(columns_of_strands()):
        its, others = alone[strand % 3][:, columns], alone[(strand + 1) % 3][:, columns]
        np.testing.assert_allclose(found[:, columns], its, atol=1.0 / 255.0)
        seen += np.abs(its - others).max() > 0.5 / 255.0
    assert seen == COUNT
