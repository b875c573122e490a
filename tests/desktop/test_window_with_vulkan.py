# SPDX-License-Identifier: GPL-3.0-or-later
"""A window of Blender with Vulkan passes the tests of test_window.py that depend on the driver."""

import pytest

from tests.desktop.test_window import (  # noqa: F401 (tests)
    test_a_broken_shader_is_reported_once_and_the_viewport_goes_on,
    test_a_click_on_hair_selects_it_and_one_beside_it_what_is_there,
    test_a_file_brings_its_hair_back,
    test_f12_renders_beside_the_window,
    test_hair_is_where_it_should_be_and_nowhere_else,
    test_installs_into_a_clean_profile,
    test_it_comes_to_its_end,
    test_our_engine_draws_surfaces_and_hair_in_the_window,
    test_selected_hair_is_outlined_by_its_silhouette,
    test_shader_functions_equal_their_twins,
    test_the_panel_is_there,
    test_the_panels_operators_grow_hair,
    test_the_window_shows_what_is_drawn_offscreen,
    walk_with,
)

pytestmark = pytest.mark.desktop


@pytest.fixture(scope="module")
def walk(desktop, extension, tmp_path_factory):
    """Return the `Walk` with Vulkan."""
    return walk_with("vulkan", desktop, extension, tmp_path_factory.mktemp("profile"))
