# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of hair in USD: a preview surface for every program, and a MaterialX network for renderers."""

from ....core.shading import appearance, materialx

# Settings of a look that a material carries: name → type.
_HAIR_INPUTS = {
    "melanin": "Float",
    "redness": "Float",
    "tint": "Color3f",
    "roughness": "Float",
    "radial_roughness": "Float",
    "coat": "Float",
    "ior": "Float",
    "cuticle_angle": "Float",
    "random_color": "Float",
    "random_roughness": "Float",
}

_TYPES = {"float": "Float", "color3": "Color3f", "vector2": "Float2", "vector3": "Float3", "BSDF": "Token"}


def define_material(stage, path, look):
    """Define the `UsdShade.Material` of a look, whose settings are also inputs for other hair shaders."""
    from pxr import Sdf, UsdShade

    material = UsdShade.Material.Define(stage, path)
    for name, kind in _HAIR_INPUTS.items():
        value = getattr(look, name)
        material.CreateInput(name, getattr(Sdf.ValueTypeNames, kind)).Set(tuple(value) if kind == "Color3f" else value)
    material.CreateInput("absorption", Sdf.ValueTypeNames.Float3).Set(appearance.sigma_a(look))
    shader = UsdShade.Shader.Define(stage, f"{path}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    color = tuple(map(float, appearance.mean_color(look)))
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(color)
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(look.roughness)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    _define_network(stage, material, look)
    return material


def _define_network(stage, material, look):
    """Add the nodes of `materialx.network`, connected to the output mtlx:surface of a material."""
    from pxr import Sdf, UsdShade

    prim = material.GetPrim()
    prim.AddAppliedSchema("MaterialXConfigAPI")
    prim.CreateAttribute("config:mtlx:version", Sdf.ValueTypeNames.String, custom=False).Set(materialx.VERSION)
    shaders = {}
    for name, node in materialx.network(look).items():
        shader = shaders[name] = UsdShade.Shader.Define(stage, prim.GetPath().AppendChild(name))
        shader.CreateIdAttr(node.definition)
        for input_name, (kind, value) in node.values.items():
            shader.CreateInput(input_name, _type(kind)).Set(value)
        for input_name, (kind, source, output) in node.links.items():
            made = shaders[source].CreateOutput(output, _type(kind))
            shader.CreateInput(input_name, _type(kind)).ConnectToSource(made)
    result = shaders[materialx.SURFACE].CreateOutput("out", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput("mtlx").ConnectToSource(result)


def _type(kind):
    """Return the USD type of a type of MaterialX."""
    from pxr import Sdf

    return getattr(Sdf.ValueTypeNames, _TYPES[kind])
