# SPDX-License-Identifier: GPL-3.0-or-later
"""The unit and axis of curves are given, in the file, or found by the distance of roots from the surface; or
refused.
"""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.files import curve_units
from hair_addon.core.files.curve_file import TO_Z_UP, Convention, CurveFile, CurveSet, join, parsed_unit
from hair_addon.core.geometry.mesh import TriMesh

SIZE, CENTRE = 0.2, np.array([0.3, 0.1, 1.6])  # of a head on a body, in meters, Z up
NOTHING = Convention()


@pytest.fixture
def head(sphere):
    return TriMesh((0.5 * SIZE * sphere.vertices + CENTRE).astype(np.float32), sphere.triangles)


def curves_in(head, meters, up, count=30):
    """Return curves that stand on a head, as a file in some unit and axis has them."""
    roots = head.vertices[:: len(head.vertices) // count].astype(np.float64)
    lines = np.stack([roots, CENTRE + 1.5 * (roots - CENTRE)], axis=1).reshape(-1, 3)
    lines = lines @ TO_Z_UP[up] / meters  # the inverse of a rotation
    return CurveSet("curves", lines, np.full(len(roots), 2), np.zeros(len(roots), bool))


def choose(head, curves, reported=NOTHING, stated=NOTHING):
    file = CurveFile([curves], stated, Convention(0.01, "Y"))
    return curve_units.choose(file, [curves], reported, head, "hair.abc")


@pytest.mark.parametrize("up", ["X", "Y", "Z"])
@pytest.mark.parametrize("unit", ["m", "cm", "mm", "in", "ft"])
def test_unit_and_axis_are_found_that_put_roots_on_the_surface(head, unit, up):
    curves = curves_in(head, parsed_unit(unit), up)
    found = choose(head, curves)
    assert (found.meters, found.up) == (parsed_unit(unit), up)
    (note,) = found.notes
    assert "does not state" in str(note) and f"with {up} up" in str(note)
    points = curves.placed(found.meters, found.up).points
    assert abs(np.linalg.norm(points[::2] - CENTRE, axis=1) - 0.5 * SIZE).max() < 1e-4


def test_what_is_said_or_stated_is_not_guessed(head):
    curves = curves_in(head, 0.01, "Z")
    found = choose(head, curves, stated=Convention(0.01, "Z"))
    assert (found.meters, found.up, found.notes) == (0.01, "Z", [])
    found = choose(head, curves, reported=Convention(0.01), stated=Convention(1.0, "Z"))
    assert (found.meters, found.up, found.notes) == (0.01, "Z", [])


def test_roots_beyond_the_size_of_the_surface_are_refused_with_what_fits(head):
    curves = curves_in(head, 0.01, "Y")
    with pytest.raises(HairError, match="in meters with Y up: they would lie on it in centimeters with Y up"):
        choose(head, curves, reported=Convention(1.0, "Y"))
    with pytest.raises(HairError, match="in centimeters with Z up: they would lie on it in centimeters with Y up"):
        choose(head, curves, stated=Convention(0.01, "Z"))
    with pytest.raises(HairError, match="check the unit, the axis and the surface"):
        choose(head, CurveSet("far", curves.points + 1e4, curves.counts, curves.is_smooth))


def test_curves_that_shrink_into_the_surface_do_not_count_as_on_it(sphere):
    """Curves read as centimeters that would be a speck inside the head do not count as on its surface."""
    head = TriMesh((0.5 * SIZE * sphere.vertices + [0.0, 0.0, 0.5 * SIZE]).astype(np.float32), sphere.triangles)
    roots = head.vertices[::30].astype(np.float64)
    lines = np.stack([roots, 1.3 * roots], axis=1).reshape(-1, 3) @ TO_Z_UP["Y"]
    found = choose(head, CurveSet("curves", lines, np.full(len(roots), 2), np.zeros(len(roots), bool)))
    assert (found.meters, found.up) == (1.0, "Y")


def test_somewhat_off_is_a_note_with_what_fits(head):
    curves = curves_in(head, 0.0254, "Z")
    moved = CurveSet("curves", curves.points, curves.counts, curves.is_smooth)
    found = choose(
        TriMesh(head.vertices - CENTRE.astype(np.float32), head.triangles),
        CurveSet("curves", moved.points - CENTRE / 0.0254, moved.counts, moved.is_smooth),
        reported=Convention(0.01, "Z"),
    )
    assert found.meters == 0.01 and "they would lie on it in inches with Z up" in str(found.notes[0])


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "yards", "", "1e400"])
def test_units_that_are_none_are_refused(text):
    with pytest.raises(HairError, match="is not a unit"):
        parsed_unit(text)


def test_sets_are_joined_with_what_all_of_them_have():
    one = CurveSet("a", np.zeros((2, 3)), np.array([2]), np.array([True]), np.ones(2, np.float32), ids=np.array([7]))
    other = CurveSet("b", np.ones((3, 3)), np.array([3]), np.array([False]))
    made = join([one, other])
    np.testing.assert_array_equal(made.points, [[0.0] * 3] * 2 + [[1.0] * 3] * 3)
    np.testing.assert_array_equal(made.radii, [1, 1, 0, 0, 0])
    assert made.counts.tolist() == [2, 3] and made.is_smooth.tolist() == [True, False] and made.ids is None
