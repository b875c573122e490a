# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair is as bright as surfaces in the same lights in Blender's shading modes, separately for each viewport."""

import math
from dataclasses import replace

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.pictures import viewport_shading
from hair_addon.blender.gpu import drawing, studio_lights
from hair_addon.blender.gpu.visibility_buffer import VisibilityBuffer
from hair_addon.blender.host import scene_time
from hair_addon.blender.render import drawn_scene, scene_drawing, solid_hair
from hair_addon.blender.render.viewport import hair_picture, viewport
from tests.support.pictures.rendering import light_up
from tests.support.pictures.viewports import context_of, view3d

SIZE = 40
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
STUDIO_LIGHTS = ("Default", "basic.sl", "outdoor.sl", "paint.sl", "rim.sl", "studio.sl")


def turned(angle):
    """Return the rotation (3, 3) about Z."""
    return np.array(
        [[math.cos(angle), -math.sin(angle), 0.0], [math.sin(angle), math.cos(angle), 0.0], [0.0, 0.0, 1.0]]
    )


def facing(angle=0.0, is_above=False):
    """Return (world to view, view to clip) of a parallel view of the ball, from the front, from the side or from
    above.
    """
    to_view = np.eye(4)
    if not is_above:
        to_view[:3, :3] = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]) @ turned(-angle)
    to_view[2, 3] = -5.0
    to_clip = np.diag([1 / 1.6, 1 / 1.6, -0.1, 1.0])
    return to_view, to_clip


@pytest.fixture
def ball(hair):
    """Return the 3-D view of a ball of short, dense hair without lamps."""
    hair.data.vellus.hair.strand_count, hair.data.vellus.hair.radius = 1500, 0.016
    bpy.data.hair_curves["Guides"].vellus.guides.length = 0.25
    bpy.context.view_layer.update()
    return view3d()


def solid(space, **settings):
    space.shading.type = "SOLID"
    for name, value in settings.items():
        setattr(space.shading, name, value)


def read(space, camera, shown=None):
    """Return (`DrawnScene`, `ViewportShading`) of the ball in a view."""
    context = bpy.context
    shown = shown or viewport_shading.read(space, context.scene, camera[0])
    depsgraph = context.evaluated_depsgraph_get()
    return drawn_scene.read(context.scene, context.view_layer, depsgraph, space, shown=shown), shown


def picture_of(drawn, camera):
    """Return (H, W, 4) light."""
    picture = hair_picture.HairPicture((SIZE, SIZE), 1)
    for _ in range(2):
        picture.add_pass(drawn, *camera)
    return picture.read()


def relit(drawn, light):
    context = bpy.context
    return drawn_scene.relit(drawn, context.scene, context.view_layer, context.evaluated_depsgraph_get(), light)


def mean_of(light):
    return light[..., :3].sum(axis=(0, 1)) / light[..., 3].sum()


def albedo_of(drawn):
    """Return the albedo (3,) of the ball: its radiance in even light."""
    even = viewport_shading.ViewportLight(viewport_shading.STUDIO, ambient=(1.0, 1.0, 1.0))
    return mean_of(picture_of(relit(drawn, even), facing()))


def workbench_ball(light, albedo, samples=60):
    """Return the (3,) mean radiance of a ball that Workbench draws from the front, with its default roughness."""
    x, z = np.meshgrid(*[np.linspace(-1.0, 1.0, samples)] * 2)
    inside = x**2 + z**2 < 1.0
    normal = np.stack([x, -np.sqrt(np.maximum(1.0 - x**2 - z**2, 0.0)), z], axis=-1)[inside]
    view = np.array([0.0, -1.0, 0.0])
    mirrored = 2.0 * (normal @ view)[:, None] * normal - view
    diffuse, specular = (np.tile(light.ambient, (len(normal), 1)) for _ in range(2))
    for lamp in light.lights:
        towards, wrap = np.array(lamp.direction), lamp.wrap
        diffuse += wrapped(normal @ towards, wrap)[:, None] * lamp.diffuse
        gloss = 2.0 ** (10.0 * (1.0 - 0.4) * (1.0 - wrap) + 1.0)
        half = (towards + view) / np.linalg.norm(towards + view)
        peak = np.clip(normal @ half, 0.0, 1.0) ** gloss * np.clip(normal @ towards, 0.0, 1.0) * (0.125 * gloss + 1.0)
        around = wrapped(mirrored @ towards, wrap + (1.0 - wrap) * 0.4)
        specular += (peak + wrap**2 * (around - peak))[:, None] * lamp.specular
    fresnel = 0.6 * np.exp2(-8.35 * (normal @ view))[:, None]
    reflectance = 0.05 + 0.95 * fresnel
    if not light.has_highlights:
        reflectance = np.zeros_like(reflectance)
    return (diffuse * albedo * (1.0 - reflectance) + specular * reflectance).mean(axis=0)


def wrapped(cosine, wrap):
    return np.clip((cosine + wrap) / (1.0 + wrap) ** 2, 0.0, 1.0)


# ------------------------------------------------------------------------------------------------- what is read


def test_lights_are_those_of_the_view_or_of_the_world():
    space, (to_view, _to_clip) = view3d(), facing()
    solid(space, light="STUDIO", studio_light="studio.sl", use_world_space_lighting=False)
    blenders = next(light for light in bpy.context.preferences.studio_lights if light.name == "studio.sl")
    used = [light for light in blenders.solid_lights if light.use]
    from_front = viewport_shading.read(space, bpy.context.scene, to_view).light
    assert len(from_front.lights) == len(used) == 3
    for found, light in zip(from_front.lights, used, strict=True):
        assert found.diffuse == tuple(light.diffuse_color) and found.specular == tuple(light.specular_color)
        x, y, z = light.direction
        np.testing.assert_allclose(found.direction, (x, -z, y), atol=1e-3)  # seen along +y
    from_side = viewport_shading.read(space, bpy.context.scene, facing(0.4)[0]).light
    for found, before in zip(from_side.lights, from_front.lights, strict=True):
        np.testing.assert_allclose(found.direction, turned(0.4) @ before.direction, atol=1e-6)
    space.shading.use_world_space_lighting, space.shading.studiolight_rotate_z = True, 0.3
    for angle in (0.0, 0.4):  # the same from everywhere
        of_world = viewport_shading.read(space, bpy.context.scene, facing(angle)[0]).light
        for found, before in zip(of_world.lights, from_front.lights, strict=True):
            np.testing.assert_allclose(found.direction, turned(-0.3) @ before.direction, atol=1e-6)


def test_lights_that_are_edited_replace_the_studio_light():
    space, system = view3d(), bpy.context.preferences.system
    solid(space, light="STUDIO", studio_light="studio.sl")
    system.use_studio_light_edit = True
    try:
        system.light_ambient = (0.1, 0.2, 0.3)
        found = viewport_shading.read(space, bpy.context.scene, facing()[0]).light
        np.testing.assert_allclose(found.ambient, (0.1, 0.2, 0.3), rtol=1e-6)
        assert [light.diffuse for light in found.lights] == [
            tuple(light.diffuse_color) for light in system.solid_lights if light.use
        ]
    finally:
        system.use_studio_light_edit = False


@pytest.mark.parametrize("wrap", [0.0, 0.3, 0.5, 0.8, 1.0])
def test_a_lamp_has_the_light_and_the_mean_direction_that_wrapping_gives(wrap):
    """A surface that faces the lamp receives pi times its color, and the first moment of the wrapped cosine."""
    light = viewport_shading.StudioLight((0.0, 0.0, 1.0), (0.5, 0.5, 0.5), (0.25, 0.25, 0.25), wrap)
    (lamp,), ambient = studio_lights.lamps_of([light], has_highlights=True)
    cosine = np.linspace(-1.0, 1.0, 20_001)
    total, moment = (2.0 * np.pi * np.trapezoid(0.5 * wrapped(cosine, wrap) * x, cosine) for x in (1.0, cosine))
    power = lamp["power"][0]
    # A surface's irradiance over all normals: a quarter of a sun's, pi of even light; times 4 pi normals, over pi.
    assert power + 4.0 * np.pi * ambient[0] == pytest.approx(total, rel=1e-3)
    mean_cosine = 1.0 - 0.25 * lamp["radius"] ** 2
    assert 2.0 / 3.0 * power * mean_cosine == pytest.approx(moment, rel=1e-3)
    assert power * (1.0 + lamp["highlight_excess"]) == pytest.approx(np.pi * 0.25, rel=1e-5)
    (dull,), _ambient = studio_lights.lamps_of([light], has_highlights=False)
    assert dull["highlight_excess"] == -1.0


def test_an_hdri_may_follow_the_view():
    """An HDRI may follow the view, with its +Y ahead and its +Z up on the screen after its rotation; otherwise it is
    in the world.
    """
    space, rotation = view3d(), 0.3
    space.shading.type, space.shading.studio_light, space.shading.studiolight_rotate_z = (
        "MATERIAL",
        "studio.exr",
        rotation,
    )
    of_view = {}
    for angle, is_above in ((0.0, False), (0.4, False), (0.0, True)):
        to_view = facing(angle, is_above)[0]
        found = {}
        for is_fixed in (True, False):
            space.shading.use_studiolight_view_rotation = is_fixed
            found[is_fixed] = viewport_shading.read(space, bpy.context.scene, to_view).light
        np.testing.assert_allclose(found[True].hdri.to_image, turned(rotation), atol=1e-6)
        to_world = np.linalg.inv(to_view[:3, :3])
        ahead, up, right = (
            found[False].hdri.to_image @ to_world @ axis for axis in (-np.eye(3)[2], np.eye(3)[1], np.eye(3)[0])
        )
        np.testing.assert_allclose(ahead, turned(rotation)[:, 1], atol=1e-6)
        np.testing.assert_allclose(up, (0.0, 0.0, 1.0), atol=1e-6)
        np.testing.assert_allclose(right, turned(rotation)[:, 0], atol=1e-6)
        of_view[angle, is_above] = found[False]
    near = viewport_shading.read(space, bpy.context.scene, facing(0.05)[0]).light
    assert viewport_shading.is_near(near, of_view[0.0, False])
    assert not viewport_shading.is_near(of_view[0.4, False], of_view[0.0, False])
    space.shading.use_studiolight_view_rotation = True
    assert not viewport_shading.is_near(viewport_shading.read(space, bpy.context.scene, facing()[0]).light, near)


def test_workbench_as_render_engine_shows_the_settings_of_the_scene(scene):
    """With Workbench as render engine, light, color, X-ray and color management are those of the scene."""
    space = view3d()
    scene.render.engine, space.shading.type = "BLENDER_WORKBENCH", "RENDERED"
    settings = scene.display.shading
    settings.light, settings.color_type, settings.single_color = "STUDIO", "SINGLE", (0.1, 0.5, 0.2)
    solid(space, light="STUDIO", studio_light=settings.studio_light, color_type="SINGLE", single_color=(0.1, 0.5, 0.2))
    space.shading.use_world_space_lighting = settings.use_world_space_lighting
    as_solid = viewport_shading.read(space, scene, facing()[0])
    space.shading.type, space.shading.light = "RENDERED", "FLAT"
    rendered = viewport_shading.read(space, scene, facing()[0])
    assert rendered == replace(as_solid, management="ALL")
    context = context_of(space)
    assert not viewport.is_drawn_by_engine(context)
    assert viewport._xray(context) is None
    settings.show_xray, settings.xray_alpha = True, 0.25
    assert viewport._xray(context) == 0.25
    settings.light = "FLAT"
    assert viewport_shading.read(space, scene, facing()[0]).light.kind == "FLAT"


# ------------------------------------------------------------------------------------------------- what is drawn


def test_hair_is_about_as_bright_as_a_ball_that_workbench_draws(ball):
    camera = facing()
    solid(ball, light="STUDIO")
    drawn, _shown = read(ball, camera)
    albedo, ratios = albedo_of(drawn), {}
    for name in STUDIO_LIGHTS:
        for has_highlights in (True, False) if name == "Default" else (True,):
            solid(ball, studio_light=name, show_specular_highlight=has_highlights)
            light = viewport_shading.read(ball, bpy.context.scene, camera[0]).light
            ours = mean_of(picture_of(relit(drawn, light), camera)) @ LUMINANCE
            ratios[name, has_highlights] = ours / (workbench_ball(light, albedo) @ LUMINANCE)
    assert len(ratios) == 7
    assert 0.5 < min(ratios.values()) and max(ratios.values()) < 1.5, ratios


def matcap_ball(layers, albedo):
    """Return the (3,) mean of a ball that Workbench draws by the (H, W, 3) layers of a matcap."""
    diffuse, specular = layers["diffuse"], layers["specular"]
    x, y = np.meshgrid(*[np.linspace(-1.0, 1.0, 100)] * 2)
    inside = x**2 + y**2 < 1.0
    row, column = ((0.496 * place[inside] + 0.5) * 511.0 for place in (y, x))
    return (diffuse[row.astype(int), column.astype(int)] * albedo + specular[row.astype(int), column.astype(int)]).mean(
        axis=0
    )


def test_matcaps_and_flat_shading_are_about_as_bright_as_on_a_ball(ball):
    """Hair by MatCap and Flat is about as bright as a ball, for every third matcap and those with bright rims or
    stripes.
    """
    camera = facing()
    solid(ball, light="FLAT")
    drawn, _shown = read(ball, camera)
    flat = mean_of(picture_of(drawn, camera))
    np.testing.assert_allclose(flat, albedo_of(drawn), rtol=1e-3)  # as in even light
    matcaps = [light for light in bpy.context.preferences.studio_lights if light.type == "MATCAP"]
    chosen = [light for light in matcaps if "rim" in light.name or "reflection" in light.name] + matcaps[::3]
    ratios = {}
    for matcap in chosen:
        solid(ball, light="MATCAP", studio_light=matcap.name)
        shown = viewport_shading.read(ball, bpy.context.scene, camera[0])
        (strands, shading, *place), *_others = drawn.hair
        hair = solid_hair.shown_as(shading, shown, bpy.data.objects["Hair"])
        light = picture_of(replace(drawn, hair=[(strands, hair, *place)]), camera)
        expected = matcap_ball(studio_lights.image_of(matcap.path).layers, flat) @ LUMINANCE
        ratios[matcap.name] = mean_of(light) @ LUMINANCE / expected
    assert len(ratios) > 10
    assert 0.5 < min(ratios.values()) and max(ratios.values()) < 1.5, ratios


def test_matcaps_are_seen_from_the_viewer(ball):
    """Matcaps follow the viewer: the normal's directions on the screen are those of the image, red right and green
    up.
    """
    camera = facing()
    solid(ball, light="MATCAP", studio_light="check_normal+y.exr")
    light = picture_of(read(ball, camera)[0], camera)
    y, x = (np.indices((SIZE, SIZE)) - 0.5 * (SIZE - 1)) / SIZE
    seen = light[..., 3] > 0.5
    red, green = (light[..., channel][seen] / light[..., 3][seen] for channel in (0, 1))
    assert np.corrcoef(red, x[seen])[0, 1] > 0.3 > np.corrcoef(red, y[seen])[0, 1]
    assert np.corrcoef(green, y[seen])[0, 1] > 0.3 > np.corrcoef(green, x[seen])[0, 1]


def test_hair_has_the_color_of_the_color_type_and_keeps_its_highlight(ball):
    camera, hair = facing(), bpy.data.objects["Hair"]
    solid(ball, light="STUDIO", studio_light="Default")
    color = np.array([0.6, 0.3, 0.1])
    ball.shading.color_type, ball.shading.single_color = "SINGLE", color
    drawn, shown = read(ball, camera)
    ratio = mean_of(picture_of(drawn, camera)) / workbench_ball(shown.light, color)
    assert 0.5 < ratio.min() and ratio.max() < 1.5, ratio
    assert read(ball, camera)[0].hair[0][1] is drawn.hair[0][1]  # pictures are carried on
    ball.shading.single_color = (0.0, 0.0, 0.0)
    black = picture_of(read(ball, camera)[0], camera)
    ball.shading.show_specular_highlight = False
    dull = picture_of(read(ball, camera)[0], camera)
    assert mean_of(black) @ LUMINANCE > 10.0 * mean_of(dull) @ LUMINANCE
    ball.shading.show_specular_highlight, ball.shading.color_type = True, "OBJECT"
    hair.color = (*color, 1.0)
    np.testing.assert_array_equal(picture_of(read(ball, camera)[0], camera), picture_of(drawn, camera))


def test_wires_are_thin_and_in_the_color_of_the_theme(ball):
    camera = facing()
    solid(ball, light="FLAT")
    whole = picture_of(read(ball, camera)[0], camera)
    ball.shading.type = "WIREFRAME"
    drawn, shown = read(ball, camera)
    thin = picture_of(drawn, camera)
    assert 0.2 * whole[..., 3].sum() < thin[..., 3].sum() < 0.8 * whole[..., 3].sum()
    theme = bpy.context.preferences.themes[0].view_3d.wire
    assert shown.color == viewport_shading.HairColor("SINGLE", tuple(theme))
    ball.shading.wireframe_color_type = "RANDOM"
    assert viewport_shading.read(ball, bpy.context.scene, camera[0]).color.kind == "RANDOM"


def test_other_surfaces_cast_no_shadow_in_solid_shading(ball):
    """Other surfaces cast no shadow, as in Workbench; in scene light they do."""
    camera = facing()
    pictures = {}
    for has_roof in (False, True):
        if has_roof:
            bpy.ops.mesh.primitive_cube_add(size=4.0, location=(0.0, 0.0, 4.0))
            bpy.context.view_layer.update()
        for light in ("STUDIO", "FLAT"):
            solid(ball, light=light)
            pictures[light, has_roof] = picture_of(read(ball, camera)[0], camera)
        ball.shading.type = "MATERIAL"
        pictures["HDRI", has_roof] = picture_of(read(ball, camera)[0], camera)
    for light in ("STUDIO", "FLAT"):
        np.testing.assert_array_equal(pictures[light, True], pictures[light, False])
    below, free = (mean_of(pictures["HDRI", has_roof]) @ LUMINANCE for has_roof in (True, False))
    assert below < 0.9 * free


@pytest.mark.parametrize("light", ["STUDIO", "FLAT"])
def test_hair_darkens_the_surface_that_it_grows_on(ball, light):
    """In Solid shading the hair's own surface is black with the blocked light as alpha; X-ray and wires are not."""
    hair, camera = bpy.data.objects["Hair"], facing()
    hair.data.vellus.hair.strand_count, hair.data.vellus.hair.radius = 500, 0.01
    place = {"location": (0.0, 0.9, 0.0), "rotation": (math.pi / 2, 0.0, 0.0)}
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=40, y_subdivisions=40, size=4.0, **place)
    bpy.context.view_layer.objects.active = hair
    bpy.context.view_layer.update()
    solid(ball, light=light)
    drawn = read(ball, camera)[0]
    assert viewport._is_shadowed(context_of(ball), drawn)
    plain, dark, seen_through = (hair_picture.HairPicture((SIZE, SIZE), 2) for _ in range(3))
    for _ in range(2):
        plain.add_pass(drawn, *camera)
        dark.add_pass(drawn, *camera, is_shadowed=True)
        seen_through.add_pass(drawn, *camera, True, is_shadowed=True)
    plain, dark, seen_through = (picture.read() for picture in (plain, dark, seen_through))
    np.testing.assert_allclose(dark[..., :3], plain[..., :3], atol=2e-3)
    y, x = (np.indices((SIZE, SIZE)) - 0.5 * (SIZE - 1)) / SIZE * 3.2
    is_bare = plain[..., 3] < 1e-3
    is_skin, is_plane = is_bare & (x**2 + y**2 < 0.8), is_bare & (x**2 + y**2 > 1.1)
    assert is_skin.sum() > 100 and is_plane.sum() > 100
    blocked = dark[..., 3][is_skin]
    assert (dark[..., 3][is_plane] == 0.0).all()
    assert 0.03 < blocked.mean() < 0.8 and blocked.max() <= 1.001, (blocked.mean(), blocked.max())
    assert not seen_through[..., 3][is_plane].any()
    # As much as the pass Hair Shadow of a render in these lights, which spreads light over more of the surface.
    view = drawing.pass_record(*camera, (SIZE, SIZE))
    buffer = VisibilityBuffer(SIZE, SIZE)
    passed = np.array(scene_drawing.draw_hair_shadow(drawn, view, buffer).read(), np.float32).reshape(SIZE, SIZE, 4)
    assert blocked.mean() == pytest.approx(1.0 - passed[is_skin][:, :3].mean(), rel=0.25)
    ball.shading.type = "WIREFRAME"
    assert not viewport._is_shadowed(context_of(ball), read(ball, camera)[0])
    ball.shading.type = "MATERIAL"
    assert not viewport._is_shadowed(context_of(ball), read(ball, camera)[0])


def test_hair_turns_with_its_lights(ball, fine_world):
    """The bright side of the ball turns with its lights, seen from above."""
    camera = facing(is_above=True)
    solid(ball, light="STUDIO", studio_light="studio.sl", use_world_space_lighting=True)
    drawn, _shown = read(ball, camera)
    azimuths = []
    for rotation in (0.0, 0.6, 1.2):
        ball.shading.studiolight_rotate_z = rotation
        light = picture_of(relit(drawn, viewport_shading.read(ball, bpy.context.scene, camera[0]).light), camera)
        y, x = np.indices((SIZE, SIZE)) - 0.5 * (SIZE - 1)
        weights = light[..., :3] @ LUMINANCE
        azimuths.append(math.atan2((weights * y).sum(), (weights * x).sum()))
    np.testing.assert_allclose(np.diff(np.unwrap(azimuths)), -0.6, atol=0.15)  # clockwise, as Blender's meshes


# ------------------------------------------------------------------------------------------------- each for itself


def test_viewports_of_other_shading_leave_each_other_alone(ball, monkeypatch):
    """Viewports of different shading do not affect each other: redraws read nothing and draw no map, in any order."""
    other = next(
        a.spaces.active for s in bpy.data.screens for a in s.areas if a.type == "VIEW_3D" and a.spaces.active != ball
    )
    solid(ball, light="STUDIO", studio_light="Default")
    other.shading.type, other.shading.use_scene_lights, other.shading.use_scene_world = "MATERIAL", True, False
    viewport.view_cache.clear()
    work = []
    for module, name in ((drawn_scene, "read"), (drawn_scene, "relit"), (drawn_scene, "visibility")):
        real = getattr(module, name)
        monkeypatch.setattr(
            module, name, lambda *given, _real=real, _name=name, **more: (work.append(_name), _real(*given, **more))[1]
        )
    contexts = [context_of(ball, 1), context_of(ball, 2), context_of(other, 3)]
    views = [facing(0.0), facing(1.0), facing(0.0)]
    for context, matrices in zip(contexts, views, strict=True):
        context.region_data = type("View", (), dict(zip(("view_matrix", "window_matrix"), matrices, strict=True)))

    def shown():
        return [viewport.drawn_scene_of(context) for context in contexts]

    first = shown()
    assert work.count("read") == 2 and work.count("relit") == 1
    assert first[0].shadow_maps is not first[1].shadow_maps
    assert first[0].hair_visibility is first[1].hair_visibility
    work.clear()
    for _ in range(2):
        assert all(one is before for one, before in zip(shown(), first, strict=True))
    assert not work
    ball.shading.studio_light = "rim.sl"
    again = shown()
    assert work == ["relit", "relit"] and again[2] is first[2]
    assert again[0].shadow_maps is first[0].shadow_maps  # drawn over
    work.clear()
    before = again[0]
    for angle in np.radians([2.0, 4.0, 6.0, 8.0, 10.0]):  # lights follow in steps
        contexts[0].region_data.view_matrix = facing(angle)[0]
        again = shown()
    assert work == ["relit"] and again[0] is not before and again[1:] == shown()[1:]
    assert work == ["relit", "relit"]  # and exactly where the view rests
    exact = viewport_shading.read(ball, bpy.context.scene, facing(np.radians(10.0))[0]).light
    assert shown()[0].light == exact and len(work) == 2
    contexts[2].region_data.view_matrix = facing(0.7)[0]
    work.clear()
    assert shown()[2] is first[2] and not work  # an HDRI does not follow the view


def test_white_hair_is_lit_by_lights_without_a_size(ball):
    """White hair is lit by lights without a size, from a point whose reflected light has no spread to divide by."""
    bpy.data.objects["Hair"].data.vellus.appearance.melanin = 0.0
    camera = facing()
    solid(ball, light="STUDIO")
    sun = viewport_shading.StudioLight((0.0, -0.6, 0.8), (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), wrap=0.0)
    drawn, _shown = read(
        ball,
        camera,
        viewport_shading.ViewportShading(viewport_shading.ViewportLight(viewport_shading.STUDIO, lights=(sun,))),
    )
    light = picture_of(drawn, camera)
    assert np.isfinite(light).all() and mean_of(light).min() > 0.1


@pytest.mark.parametrize("kind", ["MATERIAL", "RENDERED"])
def test_the_scene_lights_hair_as_far_as_the_viewport_asks(ball, kind):
    """Lamps, world, both or neither light hair; the studio light's image, rotation and strength replace the world's."""
    bpy.ops.object.light_add(type="SUN", rotation=(0.5, 0.3, 0.0))
    bpy.context.view_layer.objects.active = bpy.data.objects["Hair"]
    light_up((0.2, 0.3, 0.4))
    ball.shading.type, ball.shading.studio_light = kind, "studio.exr"
    ball.shading.studiolight_intensity, camera, ending = 0.5, facing(), "_render" if kind == "RENDERED" else ""
    drawn, shown = None, {}
    for lights, world in ((True, True), (False, True), (True, False), (False, False)):
        setattr(ball.shading, f"use_scene_lights{ending}", lights)
        setattr(ball.shading, f"use_scene_world{ending}", world)
        light = viewport_shading.read(ball, bpy.context.scene, camera[0]).light
        drawn = relit(drawn, light) if drawn else read(ball, camera)[0]
        shown[lights, world] = drawn
    assert shown[True, True].light == viewport_shading.SCENE_LIGHT
    assert [len(shown[lights, True].lamps.lamps) for lights in (True, False)] == [1, 0]
    np.testing.assert_allclose(shown[False, True].lights["world"][:, :3], [(0.2, 0.3, 0.4)] * 6, rtol=1e-6)
    suns = [shown[lights, False].lights["light"]["axis"][: shown[lights, False].lights["count"]] for lights in (1, 0)]
    assert len(suns[0]) == len(suns[1]) + 1 > 1
    total = total_of(shown[False, False])
    ball.shading.studiolight_intensity, ball.shading.studiolight_rotate_z = 1.0, 0.4
    turned_light = relit(drawn, viewport_shading.read(ball, bpy.context.scene, camera[0]).light)
    np.testing.assert_allclose(total_of(turned_light), 2.0 * total, rtol=0.02)
    brightest = turned_light.lights["light"]["axis"][0, :3]
    # A direction turned by the rotation is the image's: light comes from the other side.
    np.testing.assert_allclose(brightest, turned(-0.4) @ suns[1][0, :3], atol=1e-4)


def test_normals_of_surfaces_are_read_for_shadows_and_light_paths(ball, monkeypatch):
    """In Material Preview normals, which Blender computes for each pose, are read for light paths at rest and for
    shadows on surfaces; after playback, the scene at rest has normals again.
    """
    ball.shading.type, ball.shading.use_scene_lights, ball.shading.use_scene_world = "MATERIAL", True, True
    context, state, is_playing = context_of(ball), bpy.context.scene.vellus, [True]
    monkeypatch.setattr(scene_time, "is_playing", lambda: is_playing[0])
    corners, state.multiple_scattering = [], "GRID"

    def have(is_new=True):
        if is_new:
            viewport.invalidate()
        found = viewport.drawn_scene_of(context).blockers
        corners.append(tuple(id(one.surface.corners) for one in found))
        return [blocker.source.normals is not None for blocker in found]

    have()
    assert not any(have())
    is_playing[0] = False
    assert all(have(is_new=False))
    assert all(have())
    state.multiple_scattering = "DUAL"
    assert not any(have())
    state.has_preview_shadow = True
    assert all(have())
    assert len(set(corners)) == 1  # nothing else is uploaded again


def test_an_hdri_that_follows_the_view_lights_the_same_side_of_the_screen(ball):
    """An HDRI that follows the view lights the same side of the screen from all views; a fixed HDRI does not."""
    ball.shading.type, ball.shading.studio_light = "MATERIAL", "sunset.exr"
    sides, drawn = {}, None
    for is_fixed in (True, False):
        ball.shading.use_studiolight_view_rotation = is_fixed
        for angle in (0.0, 2.0):
            camera = facing(angle)
            light = viewport_shading.read(ball, bpy.context.scene, camera[0]).light
            drawn = relit(drawn, light) if drawn else read(ball, camera)[0]
            weights = picture_of(drawn, camera)[..., :3] @ LUMINANCE
            y, x = (np.indices((SIZE, SIZE)) - 0.5 * (SIZE - 1)) / SIZE
            sides[is_fixed, angle] = np.array([(weights * x).sum(), (weights * y).sum()]) / weights.sum()
    apart = {is_fixed: np.abs(sides[is_fixed, 2.0] - sides[is_fixed, 0.0]).max() for is_fixed in (True, False)}
    assert apart[False] < 0.02 and apart[True] > 3.0 * apart[False], sides


def total_of(drawn):
    """Return the irradiance of a small ball from all sides."""
    record = drawn.lights
    return record["light"]["power"][: record["count"], :3].sum(axis=0) + 4 * np.pi * record["world"][:, :3].mean(axis=0)


def test_color_management_is_what_blender_applies(ball):
    scene_view = bpy.context.scene.view_settings
    scene_view.view_transform, scene_view.exposure = "AgX", 1.0
    kinds = {}
    for kind in ("SOLID", "WIREFRAME", "MATERIAL"):
        ball.shading.type = kind
        kinds[kind] = viewport_shading.read(ball, bpy.context.scene, facing()[0]).management
    assert kinds == {"SOLID": "NO_SETTINGS", "WIREFRAME": "NO_SETTINGS", "MATERIAL": "VIEW_TRANSFORM"}
    ball.shading.use_scene_lights = True
    assert viewport_shading.read(ball, bpy.context.scene, facing()[0]).management == "ALL"
