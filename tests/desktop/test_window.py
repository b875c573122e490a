# SPDX-License-Identifier: GPL-3.0-or-later
"""A window of Blender with OpenGL shows hair in place, with its look and its updates; another file tests Vulkan."""

import re
import sysconfig
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import bpy
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from hair_addon.blender.gpu import display_transform
from hair_addon.core.files import table_exr
from tests.desktop import walks

pytestmark = pytest.mark.desktop

SIZE = (960, 640)  # of the window [pixels]: software drivers take their time for each

# Steps with a picture without hair beside the one with it; and what Blender itself draws of hair then.
STEPS = {
    "grown": "BOUNDS",
    "no_overlays": "BOUNDS",
    "standard": "BOUNDS",
    "orthographic": "BOUNDS",
    "mended": "BOUNDS",
    "loaded": "BOUNDS",
    "off": "TEXTURED",
}


# Drawing is tested with both drivers; strokes, undo and files do not depend on the driver.
PARTS = {"opengl": ("groom_and_view", "render_and_mend"), "vulkan": ("grown", "view", "render", "mend")}


def walk_with(backend, desktop, extension, profile):
    """Return the `Walk` with one backend, in a profile of its own."""
    packages = Path(sysconfig.get_paths()["purelib"]).resolve()
    return walks.take(
        *(desktop, "walk", extension, profile, backend),
        parts=PARTS[backend],
        more=[packages],
        folder=backend,
        folders=[packages],
        size=SIZE,
    )


@pytest.fixture(scope="module")
def walk(desktop, extension, tmp_path_factory):
    """Return the `Walk` with OpenGL."""
    return walk_with("opengl", desktop, extension, tmp_path_factory.mktemp("profile"))


def seen(walk, name):
    """Return (height, width, 3) display colors of the screen after a step, 0 to 1, first row at the bottom."""
    image = bpy.data.images.load(str(walk.folder / f"{name}.png"))
    try:
        width, height = image.size
        pixels = np.empty((height, width, 4), np.float32)
        image.pixels.foreach_get(pixels.ravel())
    finally:
        bpy.data.images.remove(image)
    return pixels[..., :3]


def part(picture, rectangle):
    """Return the pixels of a rectangle (left, bottom, width, height)."""
    left, bottom, width, height = rectangle
    return picture[bottom : bottom + height, left : left + width]


def beside_sidebar(walk, name):
    """Return a picture of the screen with a black sidebar, whose list of systems shows which ones are hidden."""
    picture = seen(walk, name).copy()
    part(picture, walk.facts["sidebar"]["rectangle"])[:] = 0.0
    return picture


def test_it_comes_to_its_end(walk):
    walk.assert_done()
    assert [line for line in walk.complaints() if "picture/display.frag" not in line] == []


def test_a_broken_shader_is_reported_once_and_the_viewport_goes_on(walk):
    told = [line for line in walk.complaints() if "picture/display.frag" in line]
    assert len(told) == 1
    assert re.search(r"picture/display_transform\.glsl:8: .*nonsense", told[0])
    view = walk.facts["steps"]["mended"]["view"]
    names = ("broken", "broken_again", "mended_bare")
    broken, again, bare = (part(beside_sidebar(walk, name), view) for name in names)
    np.testing.assert_array_equal(broken, again)
    np.testing.assert_allclose(broken, bare, atol=2.0 / 255.0)


def test_installs_into_a_clean_profile(walk):
    assert walk.facts["installed"] == {"result": ["FINISHED"], "enabled": True}


def test_the_panels_operators_grow_hair(walk):
    assert walk.facts["steps"]["grown"]["results"] == [["FINISHED"], ["FINISHED"]]


def test_the_panel_is_there(walk):
    sidebar = walk.facts["sidebar"]
    assert sidebar["category"] == "Hair"
    before, after = (part(seen(walk, name), sidebar["rectangle"]) for name in ("empty", "grown"))
    assert (np.abs(before - after).max(axis=-1) > 0.02).mean() > 0.05


@pytest.mark.parametrize("step", STEPS)
def test_hair_is_where_it_should_be_and_nowhere_else(walk, step):
    facts = walk.facts["steps"][step]
    assert facts["display_type"] == STEPS[step]
    left, bottom, _width, _height = facts["view"]
    shown, bare = (beside_sidebar(walk, name) for name in (step, f"{step}_bare"))
    changed = np.abs(shown - bare).max(axis=-1) > 3.0 / 255.0
    rows, columns = np.nonzero(part(changed, facts["view"]))
    places = np.stack([columns + left, rows + bottom], axis=-1)
    assert len(places) > 5000
    least, most = np.array(facts["least"]), np.array(facts["most"])
    # Around the strands their shadow darkens the head.
    is_inside = ((places >= least - 3.0) & (places <= most + 3.0)).all(axis=1)
    outside = tuple(places[~is_inside].T[::-1])
    assert (shown[outside] <= bare[outside] + 1.0 / 255.0).all()
    assert (~is_inside).mean() < 0.3
    places = places[is_inside]
    # And it fills what its strands span: they hang down all around.
    np.testing.assert_allclose(np.ptp(places, axis=0), most - least, rtol=0.1)


def shown(light, transform):
    """Return (N, 3) display colors of the covered pixels of (N, 4) premultiplied linear light."""
    view, look, exposure, gamma = transform
    settings = display_transform.DisplayTransform("sRGB", view, "" if look == "None" else look, gamma, "Linear Rec.709")
    colors = 2.0**exposure * light[:, :3] / np.maximum(light[:, 3:], 1e-6)
    return np.clip(display_transform.apply(settings, colors.astype(np.float32)), 0.0, 1.0)


def test_the_window_shows_what_is_drawn_offscreen(walk):
    """The window shows what is drawn offscreen: covered pixels agree in the scene's view transform up to noise."""
    view = walk.facts["steps"]["grown"]["view"]
    window, bare = (part(seen(walk, name), view) for name in ("grown", "grown_bare"))
    light = np.load(walk.folder / "offscreen.npy")
    is_hair = light[..., 3] > 0.05
    light, window, bare = light[is_hair], window[is_hair], bare[is_hair]
    alpha = light[:, 3:]
    expected = (alpha * shown(light, walk.facts["transform"]) ** 2.2 + (1.0 - alpha) * bare**2.2) ** (1.0 / 2.2)
    np.testing.assert_allclose(window.mean(axis=0), expected.mean(axis=0), atol=2.0 / 255.0)
    assert np.abs(window - expected).mean() < 8.0 / 255.0
    # The bare picture, which nobody shaded, is much further away.
    assert np.abs(window - bare).mean() > 30.0 / 255.0


def test_hair_follows_a_stroke_of_the_comb(walk):
    moved = walk.facts["combed"]
    assert moved["guides moved"] > 0.005
    assert moved["hair moved"] > 0.005


@pytest.mark.parametrize("step", ["undo", "redo"])
def test_a_stroke_is_undone_and_redone(walk, step):
    assert walk.facts[step] == {"guides": 0.0, "hair": 0.0}


def test_a_file_brings_its_hair_back(walk):
    assert walk.facts["loaded"] == {"hair": 0.0}


@pytest.mark.parametrize("tool", ["builtin.select_box", "builtin.select"])
def test_a_click_on_hair_selects_it_and_one_beside_it_what_is_there(walk, tool):
    assert walk.facts["clicks"][tool] == [["Hair"], ["Head"], ["Hair"]]


def test_shader_functions_equal_their_twins(walk):
    suite = ElementTree.parse(walk.folder / "twins.xml").getroot()[0]
    wrong = [case.get("name") for case in suite if len(case)]  # failed, or not run
    assert wrong == []
    assert int(suite.get("tests")) > 30
    assert walk.facts["twins"] == 0


def test_pictures_and_tables_are_written_while_the_window_lives_on(walk):
    assert np.ptp(seen(walk, "picture")) > 0.1
    folder = walk.folder / "tables"
    assert Path(walk.facts["table_folder"]) == folder
    assert table_exr.read_tables(folder).settings == table_exr.read_dual_tables(folder).settings


def test_selected_hair_is_outlined_by_its_silhouette(walk):
    """Selected hair has an outline in the theme's orange around its silhouette only, and none without Outline
    Selected.
    """
    view = walk.facts["steps"]["grown"]["view"]
    names = ("selected", "not_outlined", "not_outlined_bare")
    outlined, plain, bare = (part(seen(walk, name), view) for name in names)
    is_line = np.abs(outlined - plain).max(axis=-1) > 0.1
    red, green, blue = outlined[is_line].T
    assert ((red > green) & (green > blue)).mean() > 0.9
    assert np.count_nonzero(is_line) > 500
    distance = distance_transform_edt(np.load(walk.folder / "not_outlined_hair.npy") < 0.01)
    # Before the head hair that it hides is outlined too, and hair that is seen there has gaps.
    is_background = np.abs(bare - np.median(bare, axis=(0, 1))).max(axis=-1) <= 2.0 / 255.0
    # The outline of hidden hair reaches over the rim of the head by its width.
    is_off_head = distance_transform_edt(is_background) > 3.0
    assert distance[is_line & is_off_head].max() < 6.0
    assert is_line[is_background & (np.abs(distance - 3.0) < 0.2)].mean() > 0.8


def test_our_engine_draws_surfaces_and_hair_in_the_window(walk):
    """Our engine draws surfaces and hair in the window: the lit head is neither black nor the background."""
    facts = walk.facts["steps"]["grown"]
    drawn, bare = (part(seen(walk, name), facts["view"]) for name in ("engine", "engine_bare"))
    assert (np.abs(drawn - bare).max(axis=-1) > 10.0 / 255.0).mean() > 0.02
    assert np.ptp(bare.mean(axis=-1)) > 0.3


def test_f12_renders_beside_the_window(walk):
    assert walk.facts["windows"] == 2
    assert np.ptp(seen(walk, "rendered")) > 0.3
