# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported hair has a MaterialX network with the absorption and the lobes of its look."""

import math

import bpy
import numpy as np
import pytest

from hair_addon.blender.io.usd import usd_materials
from hair_addon.core.shading import appearance
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.shading.fibre import energy_conserving, principled

LOOKS = {
    "melanin": Appearance(melanin=0.6, redness=0.4, cuticle_angle=math.radians(3.0), ior=1.5),
    "dyed": Appearance(melanin=0.2, tint=(0.3, 1.0, 0.05), roughness=0.45, radial_roughness=0.6),
    "color": Appearance(parametrization="COLOR", color=(0.3, 0.1, 0.02), radial_roughness=0.2),
    "absorption": Appearance(parametrization="ABSORPTION", absorption=(0.1, 0.7, 20.0)),
    "black dye": Appearance(tint=(0.0, 0.0005, 0.2)),
    "coated": Appearance(coat=0.6, roughness=0.5),
    "wet": Appearance(wetness=0.7),
}


def melanin(melanin_concentration, melanin_redness, eumelanin_color, pheomelanin_color):
    amount = -math.log(max(1.0 - melanin_concentration, 1e-4))
    eumelanin, pheomelanin = -np.log(eumelanin_color), -np.log(pheomelanin_color)
    return {"absorption": amount * ((1.0 - melanin_redness) * eumelanin + melanin_redness * pheomelanin)}


def absorption_from_color(color, azimuthal_roughness):
    b = azimuthal_roughness
    fit = 5.969 - 0.215 * b + 2.532 * b**2 - 10.73 * b**3 + 5.574 * b**4 + 0.245 * b**5
    return {"absorption": np.square(np.log(np.clip(color, 1e-3, 1.0)) / fit)}


def roughness(longitudinal, azimuthal):
    v = np.square(0.726 * longitudinal + 0.812 * longitudinal**2 + 3.7 * longitudinal**20)
    s = 0.265 * azimuthal + 1.194 * azimuthal**2 + 5.372 * azimuthal**22
    return {"roughness_R": (v, s), "roughness_TT": (0.25 * v, s), "roughness_TRT": (4.0 * v, s)}


# The definitions of MaterialX's nodes, as its shaders compute them.
NODES = {
    "ND_deon_hair_absorption_from_melanin": melanin,
    "ND_chiang_hair_absorption_from_color": absorption_from_color,
    "ND_chiang_hair_roughness": roughness,
    "ND_add_vector3": lambda in1, in2: {"out": np.add(in1, in2)},
}


def inputs_of(shader):
    """Return {input: value} of a shader, computed by the nodes that it is connected to."""
    values = {}
    for one in shader.GetInputs():
        source = one.GetConnectedSources()[0]
        if not source:
            values[one.GetBaseName()] = one.Get()
            continue
        before = type(shader)(source[0].source.GetPrim())
        made = NODES[before.GetIdAttr().Get()](**inputs_of(before))
        values[one.GetBaseName()] = made[source[0].sourceName]
    return values


@pytest.fixture(params=LOOKS)
def material(request):
    """Return (look, material) on a stage in memory."""
    bpy.utils.expose_bundled_modules()
    from pxr import Usd

    stage = Usd.Stage.CreateInMemory()
    look = LOOKS[request.param]
    yield look, usd_materials.define_material(stage, "/look", look)
    del stage


def hair_node(material):
    """Return the hair's node of a material's MaterialX network."""
    surface, _name, _kind = material.ComputeSurfaceSource("mtlx")
    assert surface.GetIdAttr().Get() == "ND_surface"
    source = surface.GetInput("bsdf").GetConnectedSources()[0][0]
    assert source.sourceName == "out"
    hair = type(surface)(source.source.GetPrim())
    assert hair.GetIdAttr().Get() == "ND_chiang_hair_bsdf"
    return hair


def test_materialx_has_the_absorption_and_the_lobes_of_the_look(material):
    """A network's absorption per radius, refractive index, and center and width of each lobe are those of the look."""
    look, made = material
    found = inputs_of(hair_node(made))
    settings = appearance.table_settings(look)
    np.testing.assert_allclose(found["absorption_coefficient"], appearance.sigma_a(look), rtol=1e-5, atol=1e-7)
    assert found["ior"] == pytest.approx(settings.eta)
    tilt = found["cuticle_angle"] * math.pi - 0.5 * math.pi
    scale = principled.scale_from_radial_roughness(look.radial_roughness)
    lobes = energy_conserving.lobes(settings)
    for path, name in enumerate(("R", "TT", "TRT")):
        center, variance = lobes[path]
        v, s = found[f"roughness_{name}"]
        assert (3 * path - 2) * tilt == pytest.approx(center, abs=1e-6)
        assert v == pytest.approx(variance, rel=1e-5)
        assert math.sqrt(math.pi / 8.0) * s == pytest.approx(scale, rel=1e-5)


def test_materialx_has_inputs_of_its_definitions(material):
    """Each input and each connected output of a network exists in MaterialX's definition of the node with this type."""
    _look, made = material
    from pxr import Sdr, UsdShade

    hair = hair_node(made)
    shaders = [UsdShade.Shader(prim) for prim in made.GetPrim().GetChildren() if prim.GetName() != "surface"]
    assert hair.GetPath() in [shader.GetPath() for shader in shaders]
    for shader in shaders:
        definition = Sdr.Registry().GetShaderNodeByIdentifier(shader.GetIdAttr().Get())
        for one in shader.GetInputs():
            wanted = definition.GetShaderInput(one.GetBaseName())
            assert wanted.GetTypeAsSdfType().GetSdfType() == one.GetTypeName(), one.GetFullName()
        for one in shader.GetOutputs():
            wanted = definition.GetShaderOutput(one.GetBaseName())
            assert wanted.GetTypeAsSdfType().GetSdfType() == one.GetTypeName(), one.GetFullName()
