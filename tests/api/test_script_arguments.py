# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments of wrong types to the functions for scripts raise one message and do not change the file."""

import math
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Color

from hair_addon import api
from hair_addon.core.geometry.mesh import SurfacePoints, TriMesh
from hair_addon.core.geometry.strands import Strands
from tests.support.dynamics.following import update
from tests.support.reading import everything

TRIANGLE = [[0, 1, 2]]
SMALL = {"width": 16, "height": 12}


def data(name):
    return bpy.data.objects[name]


def removed():
    """Return a reference to an object that was removed."""
    gone = bpy.data.objects.new("Gone", bpy.data.meshes["Icosphere"])
    bpy.data.objects.remove(gone)
    return gone


def elsewhere():
    """Make the mesh object Other in another scene."""
    other = bpy.data.objects.new("Other", bpy.data.meshes["Icosphere"])
    bpy.data.scenes.new("Elsewhere").collection.objects.link(other)
    return other


def foreign():
    """Curves that are not guides."""
    curves = bpy.data.hair_curves.new("Lines")
    curves.add_curves([3])
    curves.surface = bpy.data.objects["Sphere"]
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Lines", curves))


def mesh(vertices=None, triangles=TRIANGLE):
    return api.distribute_guides((np.eye(3) if vertices is None else vertices, triangles), guide_count=3)


def strands():
    return api.distribute_guides((np.eye(3), TRIANGLE), guide_count=3)


def hair_of_arrays(guides, arrays=None):
    return api.interpolate_hair(guides, mesh=(np.eye(3), TRIANGLE) if arrays is None else arrays, strand_count=5)


def masked(masks):
    return api.interpolate_hair(strands(), mesh=(np.eye(3), TRIANGLE), styles=[api.Clump(mask="top")], masks=masks)


def lines_of_arrays(line=TRIANGLE, **changes):
    return api.use_as_guides([line], (np.eye(3), TRIANGLE), **changes)


def simulate(poses, guides=None, triangles=TRIANGLE, **changes):
    return api.simulate(poses, triangles, strands() if guides is None else guides, **changes)


class Tensor:
    """Behaves like a PyTorch tensor with gradients when NumPy converts it."""

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("Can't call numpy() on Tensor that requires grad. Use tensor.detach().numpy() instead.")


def evaluated_curves(name):
    return data(name).evaluated_get(bpy.context.evaluated_depsgraph_get()).data


# (call, what the sentence says)
REFUSED = {
    # Settings.
    "None for text": (lambda: api.interpolate_hair(data("Guides"), density_group=None), "Strand mask must be text"),
    "None for a number": (
        lambda: api.interpolate_hair(data("Guides"), neighbour_limit=None),
        "Max guides per strand must be",
    ),
    "text for a number": (
        lambda: api.distribute_guides(data("Sphere"), guide_count="12"),
        "Guide count must be",
    ),
    "a truth for a number": (
        lambda: api.distribute_guides(data("Sphere"), guide_count=True),
        "Guide count must be",
    ),
    "a number for a truth": (lambda: api.distribute_guides(data("Sphere"), symmetric=1), "Symmetric must be True or"),
    "a huge integer": (lambda: api.distribute_guides(data("Sphere"), seed=10**400), "Seed must be between"),
    "a huge length": (lambda: api.distribute_guides(data("Sphere"), length=10**400), "Length must be positive"),
    "no number": (lambda: api.interpolate_hair(data("Guides"), radius=math.nan), "Radius must be positive"),
    "an array": (lambda: api.interpolate_hair(data("Guides"), radius=np.ones(3)), "Radius must be a number"),
    "a complex color": (lambda: api.shade(data("Hair"), color=(1j, 0, 0)), "Color must be a number"),
    "a gray color": (lambda: api.shade(data("Hair"), color=0.5), "Color needs 3 numbers"),
    "a name no .blend can hold": (
        lambda: api.interpolate_hair(data("Guides"), region_group="\udcff"),
        "Region group has",
    ),
    "settings of another class": (
        lambda: api.distribute_guides(data("Sphere"), api.HairSettings()),
        "settings must be",
    ),
    "a dictionary of settings": (lambda: api.interpolate_hair(data("Guides"), {"seed": 1}), "settings must be"),
    "zero for settings": (lambda: api.interpolate_hair(data("Guides"), 0), "settings must be"),
    "settings of a stage": (lambda: api.add_hair(data("Sphere"), api.GuideSettings()), "settings must be"),
    "nothing for a groom": (lambda: api.apply_settings(data("Hair"), None), "settings must be"),
    "text for a groom": (lambda: api.save_settings("a.json", "settings"), "settings must be"),
    "tables of a look": (lambda: api.table_settings(api.Appearance()), "settings must be"),
    "a look of another class": (lambda: api.shade(data("Hair"), api.GuideSettings()), "settings must be"),
    "a number for a look": (lambda: api.shade(data("Hair"), 3), "settings must be"),
    "a list for a model": (lambda: api.shade(data("Hair"), model=["MARSCHNER"]), "Unknown model a value of type list"),
    "a model and a wrong look": (lambda: api.shade(data("Hair"), model="KAJIYA_KAY", melanin=3), "Melanin must be"),
    "a preset of styles": (lambda: api.set_dynamics(data("Guides"), "CURLY"), "Unknown dynamics preset 'CURLY'"),
    "a preset and a wrong weight": (
        lambda: api.set_dynamics(data("Guides"), "WET", weight=0),
        "Weight must be between",
    ),
    "a number for a switch": (
        lambda: api.set_dynamics(data("Guides"), "WET", simulates=1),
        "simulates must be True or",
    ),
    "dynamics of hair": (lambda: api.set_dynamics(data("Hair"), "WET"), "'Hair' is not Vellus guides"),
    "a fraction of a frame to bake": (
        lambda: api.bake_dynamics(data("Guides"), 2.5),
        "last_frame must be a whole number",
    ),
    "a file to bake beside": (lambda: api.bake_dynamics(data("Guides"), 3), "relative to the .blend file"),
    "a last frame before the first": (lambda: api.bake_dynamics(data("Guides"), -3), "begins in frame 1"),
    "hair to bake": (lambda: api.bake_dynamics(data("Hair")), "'Hair' is not Vellus guides"),
    "a number to start over": (
        lambda: api.bake_dynamics(data("Guides"), 3, starts_over=1),
        "starts_over must be True or",
    ),
    "delivery of an unsaved file": (lambda: api.deliver_dynamics(data("Guides")), "save the file first"),
    "no delivery to remove": (lambda: api.remove_delivery(data("Guides")), "plays delivered frames"),
    "a name for hair": (lambda: api.export_groom("a.abc", "Hair"), "hair must be a list"),
    "hair without a list": (lambda: api.export_groom("a.abc", data("Hair")), "hair must be a list"),
    "an array of nothing for hair": (lambda: api.export_groom("a.abc", np.array(None)), "hair must be a list"),
    "guides to export": (lambda: api.export_groom("a.abc", [data("Guides")]), "'Guides' is not Vellus hair"),
    "a mesh's format": (lambda: api.export_groom("a.obj"), "exported as .abc"),
    "a number for hair in a file": (lambda: api.export_groom("a.abc", has_hair=1), "Hair must be True or"),
    "no poses": (lambda: simulate([]), "poses is empty"),
    "a number for poses": (lambda: simulate(3), "poses must be an iterable"),
    "flat poses": (lambda: simulate([np.arange(9.0)]), "A mesh is vertices"),
    "an infinite pose": (lambda: simulate([np.full((3, 3), np.inf)]), "non-finite"),
    "a pose that single precision cannot hold": (
        lambda: [*simulate([np.eye(3), 1e300 * np.eye(3)])],
        "Pose 1 must be",
    ),
    "guides of an object": (lambda: simulate([np.eye(3)], data("Guides")), "guides must be Strands"),
    "guides of another mesh": (lambda: simulate([np.eye(3)], strands(), [[0, 1, 9]]), "uses vertex 9"),
    "no frame rate": (lambda: simulate([np.eye(3)], frame_rate=0), "frame_rate must be"),
    "gravity of two numbers": (lambda: simulate([np.eye(3)], gravity=(0, 1)), "gravity needs 3 numbers"),
    "infinite gravity": (lambda: simulate([np.eye(3)], gravity=(0, 0, -math.inf)), "gravity must be"),
    "regions of other guides": (lambda: simulate([np.eye(3)], regions=range(9)), "regions must be whole numbers"),
    "regions with parts": (lambda: simulate([np.eye(3)], regions=[0.5]), "regions must be whole numbers"),
    "ties of other guides": (lambda: simulate([np.eye(3)], held=[0.5] * 9), "held must be numbers from 0 to 1"),
    "ties behind the tip": (lambda: simulate([np.eye(3)], held=[1.5, 0.0, 0.0]), "held must be numbers from 0 to 1"),
    "a collection for arrays": (lambda: simulate([np.eye(3)], colliders="Body"), "names a collection"),
    "dynamics of another class": (lambda: simulate([np.eye(3)], settings=api.Clump()), "settings must be"),
    "plots of none": (lambda: api.bake_tables("tables", has_plots=None, size=16), "has_plots must be True or False"),
    # Objects.
    "bytes for a surface": (lambda: api.distribute_guides(b"Sphere"), "neither a mesh object"),
    "an array for a surface": (lambda: api.distribute_guides(np.eye(3)), "type ndarray is neither a mesh object"),
    "a mesh for its object": (lambda: api.distribute_guides(data("Sphere").data), "neither a mesh object"),
    "a removed surface": (lambda: api.distribute_guides(removed()), "was removed from the file"),
    "a removed surface of a groom": (lambda: api.add_hair(removed()), "was removed from the file"),
    "a surface elsewhere": (lambda: api.distribute_guides(data("Other")), "not in this scene"),
    "no guides": (lambda: api.interpolate_hair(None), "None is not Vellus guides"),
    "text for guides": (lambda: api.interpolate_hair("Guides"), "'Guides' is not Vellus guides"),
    "removed guides": (lambda: api.interpolate_hair(removed()), "was removed from the file"),
    "removed hair": (lambda: api.shade(removed(), "BLOND"), "was removed from the file"),
    "an array for hair": (
        lambda: api.points(np.zeros((2, 3, 3))),
        "a value of type ndarray is not Vellus guides or hair",
    ),
    "what modifiers made": (lambda: api.points(evaluated_curves("Hair")), "is not Vellus guides or hair"),
    "an object without data": (lambda: api.points(data("Empty")), "is not Vellus guides or hair"),
    "removed curves": (lambda: api.use_as_guides(removed()), "was removed from the file"),
    "an array for curves": (lambda: api.use_as_guides(np.zeros((2, 2))), "type ndarray is not a curves object"),
    "guides for curves": (lambda: api.use_as_guides(data("Guides")), "'Guides' is already guides or hair"),
    "text for every": (lambda: api.use_as_guides(data("Lines"), every="2"), "Keep Every must be a whole number"),
    "every of none": (lambda: lines_of_arrays(every=0), "Keep Every must be at least 1"),
    "no progress of curves": (lambda: api.use_as_guides(data("Lines"), progress=None), "progress must be a function"),
    "no modifiers": (lambda: api.use_as_guides(data("Lines"), applies_modifiers=None), "must be True or False"),
    "no modifiers of hair": (lambda: api.use_as_hair(data("Lines"), applies_modifiers=None), "must be True or False"),
    "text for a switch": (lambda: api.use_as_hair(data("Lines"), follows_guides="no"), "must be True or False"),
    "a picture of no numbers": (
        lambda: api.save_groom(data("Hair"), "a.blend", picture=np.full((2, 2, 4), math.nan)),
        "must be an array (height, width, 4)",
    ),
    # Arrays.
    "a number for masks": (lambda: masked(3), "masks must be a dictionary"),
    "text for a mask": (lambda: masked({"top": "top"}), "must have a finite weight"),
    "a mask that single precision cannot hold": (lambda: masked({"top": [0, 1, 1e300]}), "must have a finite weight"),
    "lines that single precision cannot hold": (lambda: lines_of_arrays(1e300 * np.eye(3)), "No curve can be used"),
    "one array": (lambda: api.distribute_guides([np.eye(3)]), "pair of arrays"),
    "three arrays": (lambda: api.distribute_guides((1, 2, 3)), "pair of arrays"),
    "fractions of vertices": (lambda: mesh(triangles=[[0, 1, 1.5]]), "must be whole numbers"),
    "a vertex that is no number": (lambda: mesh(triangles=[[0, 1, math.nan]]), "must be whole numbers"),
    "an infinite vertex": (lambda: mesh(triangles=[[0, 1, math.inf]]), "must be whole numbers"),
    "a vertex beyond 32 bits": (lambda: mesh(triangles=[[0, 1, 2**32 + 2]]), "uses vertex 4294967298"),
    "a vertex beyond 64 bits": (lambda: mesh(triangles=[[0, 1, 10**30]]), "must be numbers"),
    "a vertex below zero": (lambda: mesh(triangles=[[0, 1, -1]]), "uses vertex -1"),
    "a vertex that wraps": (lambda: mesh(triangles=np.array([[0, 1, 2**64 - 1]], np.uint64)), "uses vertex 1844"),
    "truths for triangles": (lambda: mesh(triangles=np.ones((1, 3), bool)), "must be numbers"),
    "text for vertices": (lambda: mesh([["a", "b", "c"]]), "must be numbers"),
    "objects for vertices": (lambda: mesh([[None, 0, 0]] * 3), "must be numbers"),
    "complex vertices": (lambda: mesh(1j * np.eye(3)), "must be numbers"),
    "ragged vertices": (lambda: mesh([[0, 0, 0], [1, 0]]), "must be an array of numbers"),
    "a tensor for vertices": (lambda: mesh(Tensor()), "must be an array of numbers"),
    "a tensor for a mask": (lambda: masked({"top": Tensor()}), "must have a finite weight"),
    "a tensor for lines": (lambda: lines_of_arrays(Tensor()), "Curves must be a non-empty sequence"),
    "a tensor for a pose": (lambda: [*simulate([np.eye(3), Tensor()])], "Pose 1 must be"),
    "a tensor for regions": (lambda: simulate([np.eye(3)], regions=Tensor()), "regions must be whole numbers"),
    "a tensor for a picture": (
        lambda: api.save_groom(data("Hair"), "a.blend", picture=Tensor()),
        "must be an array (height, width, 4)",
    ),
    "flat vertices": (lambda: mesh(np.arange(9.0)), "A mesh is vertices"),
    "vertices that single precision cannot hold": (lambda: mesh(1e200 * np.eye(3)), "non-finite"),
    "a mesh of lists": (lambda: api.distribute_guides(TriMesh([[None] * 3], TRIANGLE)), "must be numbers"),
    "a mesh of long indices": (
        lambda: api.distribute_guides(TriMesh(np.eye(3), np.array([[0, 1, 2**32]]))),
        "uses vertex 4294967296",
    ),
    "no mesh": (lambda: api.interpolate_hair(strands()), "mesh="),
    "text for the mesh": (lambda: hair_of_arrays(strands(), "mesh"), "pair of arrays"),
    "strands of arrays": (lambda: hair_of_arrays(Strands(np.zeros((1, 4, 3)), None)), "Warp array"),
    "strands without roots": (lambda: hair_of_arrays(Strands(strands().points, None)), "SurfacePoints"),
    "strands of fewer roots": (
        lambda: hair_of_arrays(Strands(strands().points, SurfacePoints(np.zeros(1, np.int32), np.eye(3)[:1]))),
        "SurfacePoints",
    ),
    # Paths, frames, engines, progress.
    "no path": (lambda: api.render(None), "A path must be"),
    "bytes for a path": (lambda: api.render(b"a.png"), "A path must be"),
    "a number for a path": (lambda: api.save_settings(3, api.GroomSettings()), "A path must be"),
    "no path to load": (lambda: api.load_settings(None), "A path must be"),
    "an empty path": (lambda: api.load_settings(""), "A path must be"),
    "a null character": (lambda: api.save_settings("a\0b.json", api.GroomSettings()), "A path must be"),
    "no folder": (lambda: api.bake_tables(None, size=16), "A path must be"),
    "a file name too long": (lambda: api.render("a" * 300 + ".png", **SMALL), "cannot be written"),
    "a file name of surrogates": (lambda: api.render("\udcff.png", **SMALL), "cannot be written"),
    "a file name no system has": (lambda: api.render("\ud800.png", **SMALL), "A path must be"),
    "half a frame": (lambda: api.render("a.png", frame=1.5, **SMALL), "frame must be a whole number"),
    "text for a frame": (lambda: api.render("a.png", frame="1", **SMALL), "frame must be a whole number"),
    "a frame Blender lacks": (lambda: api.render("a.png", frame=10**9, **SMALL), "There is no frame"),
    "a list of engines": (lambda: api.render("a.png", engine=["vellus"]), "Unknown engine a value of type list"),
    "no progress": (lambda: api.distribute_guides(data("Sphere"), progress=None), "progress must be a function"),
    "no progress of a picture": (lambda: api.draw(progress=1, **SMALL), "progress must be a function"),
}


def assert_all_goes_on(folder):
    """Assert that the file can be saved and drawn, and that an undo works."""
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "saved.blend"))
    assert np.isfinite(api.draw(width=16, height=12, samples_per_side=1)).all()


def test_wrong_arguments_are_one_sentence_and_change_nothing(lit, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    elsewhere(), bpy.data.objects.new("Empty", None), foreign()
    model, before = lit.data.vellus.model, everything()
    for name, (call, reported) in REFUSED.items():
        with pytest.raises(api.HairError) as refused:
            call()
        sentence = str(refused.value)
        assert reported in sentence and "\n" not in sentence and len(sentence) < 500, name
        assert (everything(), lit.data.vellus.model, [*tmp_path.iterdir()]) == (before, model, []), name
    assert_all_goes_on(tmp_path)


def test_numbers_of_any_kind_are_settings(lit, tmp_path):
    guides = api.distribute_guides(data("Sphere"), guide_count=np.int64(20), length=1, gravity=1, symmetric=np.True_)
    hair = api.interpolate_hair(guides, strand_count=50.0, neighbour_limit=4.0, radius=np.float32(0.004))
    assert (hair.vellus.hair.neighbour_limit, len(hair.curves)) == (4, 50)
    api.shade(hair, parametrization="COLOR", color=Color((0.2, 0.3, 0.4)))
    assert api.settings_of(hair).appearance.color == (0.2, 0.3, 0.4)
    expected = api.GuideSettings(guide_count=20, length=1.0, gravity=1.0, symmetric=True)
    assert api.settings_of(hair).guides == expected
    assert_all_goes_on(tmp_path)


def test_arrays_of_any_numbers_are_a_mesh():
    expected = mesh().numpy()
    for vertices, triangles in [
        (np.eye(3, dtype=np.int16), np.array(TRIANGLE, np.uint64)),
        (np.eye(3).tolist(), [[0.0, 1.0, 2.0]]),
        (np.asfortranarray(np.eye(3)), np.array([[0, 1, 2, 3]])[:, :3]),
    ]:
        np.testing.assert_array_equal(mesh(vertices, triangles).numpy(), expected)


def test_evaluated_copies_stand_for_their_originals(lit):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    guides = api.distribute_guides(data("Sphere").evaluated_get(depsgraph), guide_count=10)
    assert guides.surface == data("Sphere")
    hair = api.interpolate_hair(guides.evaluated_get(bpy.context.evaluated_depsgraph_get()), strand_count=20)
    assert hair.vellus.guide_curves == guides
    update()
    its_object = next(o for o in bpy.data.objects if o.data == hair)
    evaluated = its_object.evaluated_get(bpy.context.evaluated_depsgraph_get())
    np.testing.assert_array_equal(api.points(evaluated), api.points(hair))


FEW = api.GroomSettings(api.GuideSettings(guide_count=10), api.HairSettings(strand_count=30))
STOPPED = {
    "distribute_guides": lambda progress: api.distribute_guides(data("Sphere"), guide_count=10, progress=progress),
    "interpolate_hair": lambda progress: api.interpolate_hair(data("Guides"), strand_count=30, progress=progress),
    "add_hair": lambda progress: api.add_hair(data("Sphere"), FEW, progress=progress),
    "bake_tables": lambda progress: api.bake_tables("tables", size=16, progress=progress),
    "draw": lambda progress: api.draw(progress=progress, **SMALL),
    "render": lambda progress: api.render("a.png", progress=progress, **SMALL),
    "render in Cycles": lambda progress: api.render(
        "a.png", engine="cycles", sample_count=1, progress=progress, **SMALL
    ),
}


@pytest.mark.parametrize("name", STOPPED)
def test_progress_that_raises_leaves_nothing_half_made(lit, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    render = bpy.context.scene.render
    before = everything(), render.engine, render.filepath, render.resolution_x, bpy.context.scene.frame_current
    for call_count in (0, *(2**power for power in range(12))):
        left = iter(range(call_count))

        def progress(_step, _part, left=left):
            if next(left, None) is None:
                raise LookupError("enough")

        try:
            STOPPED[name](progress)
        except (LookupError, api.HairError) as error:
            assert "enough" in str(error)
        else:
            break  # it is told no more often than that
        after = everything(), render.engine, render.filepath, render.resolution_x, bpy.context.scene.frame_current
        assert after == before and not [path for path in tmp_path.rglob("*") if path.is_file()]
    assert call_count > 0
    assert_all_goes_on(tmp_path)


def test_a_path_may_be_a_path(lit, tmp_path):
    assert api.render(tmp_path / "a_##.png", frame=np.int32(2), **SMALL) == Path(tmp_path / "a_02.png")
