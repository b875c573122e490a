# SPDX-License-Identifier: GPL-3.0-or-later
"""Use of the installed extension as an artist does, in a Python with only the bpy wheel.

    python -I walk_installed.py install|twice ZIP FOLDER

Prints one line of JSON at the end, which test_install.py checks.
"""

import doctest
import importlib
import json
import math
import os
import re
import runpy
import sys
from pathlib import Path

import bpy
import gpu
import numpy as np

MODULE = "bl_ext.user_default.vellus"
COARSE = Path(__file__).resolve().parents[1] / "child_processes" / "sitecustomize.py"
SCRIPTS = Path(__file__).resolve().parents[3] / "docs" / "scripts.md"
# All files with functions; later examples use what earlier ones made.
API_FILES = (
    "grooms",
    "dynamics",
    "guide_tools",
    "guide_layers",
    "styles",
    "tables",
    "export",
    "library",
    "imports",
    "maps",
    "pictures",
    "cards",
    "systems",
)


def install(zip_path):
    """Install from disk into an empty profile and enable, as the Preferences do."""
    result = bpy.ops.extensions.package_install_files(filepath=zip_path, repo="user_default", enable_on_install=True)
    bpy.ops.wm.save_userpref()
    return {"result": list(result), "enabled": MODULE in bpy.context.preferences.addons}


def install_and_use(zip_path, folder):
    """Install, run operators, then scripts, in one Blender: each start unpacks the wheels of the extension."""
    return {"installed": install(zip_path), **use(folder)}


def use(folder):
    """Run operators, then scripts."""
    gpu.init()
    _draw_coarse_shadows()
    return {"operators": _operators(folder), "scripts": _scripts(folder)}


def _operators(folder):
    """Call operators for everything from mesh to pixels."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    camera = bpy.context.scene.camera
    camera.location, camera.rotation_euler = (0.0, -0.6, 0.0), (math.radians(90.0), 0.0, 0.0)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=0.1)
    results = [
        bpy.ops.vellus.distribute_guides(guide_count=30, relax_iterations=5, length=0.05),
        bpy.ops.vellus.interpolate_hair(strand_count=300),
        bpy.ops.vellus.bake_tables(directory=str(folder)),
        _apply_preset(bpy.data.objects["Hair"]),
        bpy.ops.vellus.render_picture(filepath=str(folder / "picture.png"), width=160, height=120),
        bpy.ops.vellus.add_grooms(),
    ]
    picture = bpy.data.images.load(str(folder / "picture.png"))
    pixels = np.array(picture.pixels[:]).reshape(-1, 4)
    import OpenEXR  # both exist only after Blender has unpacked the extension's wheels
    import warp

    return {
        "results": [list(result) for result in results],
        "curves": {curves.name: len(curves.curves) for curves in bpy.data.hair_curves},
        "finite": all(np.isfinite(_positions(curves)).all() for curves in bpy.data.hair_curves),
        "tables": sorted(path.name for path in folder.glob("*.exr")),
        "cached": [path.name for path in _user_folder().glob("tables/*/n.exr")],
        "grooms": sorted(path.name for path in _library_folder().glob("*.blend")),
        "picture": [*picture.size, float(pixels[:, :3].std())],
        "wheels": [warp.__file__, OpenEXR.__file__],
    }


def _user_folder():
    return Path(bpy.utils.extension_path_user(MODULE))


def _library_folder():
    return Path(bpy.context.preferences.filepaths.asset_libraries["Vellus"].path)


def _apply_preset(hair):
    bpy.context.view_layer.objects.active = hair
    result = bpy.ops.vellus.apply_preset(preset="BLOND")
    look = hair.data.vellus.appearance
    look.random_color = look.random_roughness = 0.0  # the tables of even hair are cached
    return result


def _positions(curves):
    values = np.empty(len(curves.points) * 3, np.float32)
    curves.attributes["position"].data.foreach_get("vector", values)
    return values


def _scripts(folder):
    """Run the code of docs/scripts.md and of docstrings, with the import documented for the extension."""
    api = importlib.import_module(f"{MODULE}.hair_addon.api")
    import warp  # there since the extension was enabled

    warp.config.log_level = warp.LOG_WARNING  # what it says of loaded kernels is no part of an example
    os.chdir(folder)
    ran, names = 0, {}
    for block in re.findall(r"```python\n(.*?)```", SCRIPTS.read_text(encoding="utf-8"), re.DOTALL):
        if "import " in block:  # others continue the block before
            bpy.ops.wm.read_homefile(use_empty=True)
            names = {}
        exec(block.replace("from hair_addon import api", f"from {MODULE}.hair_addon import api"), names)
        ran += 1
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4)
    bpy.context.object.name = "Scalp"
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -6.0, 0.0), (math.radians(90.0), 0.0, 0.0)
    bpy.context.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.scene.vellus.multiple_scattering = "DUAL"  # without tracing light paths, as the code before did
    bpy.ops.wm.save_as_mainfile(filepath="shot.blend")
    failed, runner = [], doctest.DocTestRunner(verbose=False)
    for example in _examples(api):
        reported = []
        example.globs = {"api": api, "bpy": bpy}
        runner.run(example, out=reported.append)
        failed += reported
    return {"blocks": ran, "examples": runner.tries, "failed": failed}


def _draw_coarse_shadows():
    """Make shadow maps coarse, as in other processes of tests: they take longest of all in small pictures."""
    coarse = runpy.run_path(str(COARSE))
    for name, change in coarse["CHANGES"].items():
        change(importlib.import_module(f"{MODULE}.{name}"))


def _examples(api):
    """Yield the doctests of the functions of `api`, file by file."""
    modules = [importlib.import_module(f"{api.__name__}.{name}") for name in API_FILES]
    for module in modules:
        found = doctest.DocTestFinder(exclude_empty=True).find(module, "api")
        yield from sorted(
            (test for test in found if test.examples and test.name != "api"), key=lambda test: test.lineno
        )


def twice(_zip_path, _folder):
    """Compare Blender's state before the add-on is first enabled, and after enabling and disabling it twice."""
    draw_handlers = _count_draw_handlers()
    states = [_state(draw_handlers)]
    for _ in range(2):
        bpy.ops.preferences.addon_enable(module=MODULE)
        states.append(_state(draw_handlers))
        bpy.ops.preferences.addon_disable(module=MODULE)
        states.append(_state(draw_handlers))
    return {"states": states}


def _state(draw_handlers):
    """Return everything that an add-on can extend, by name."""
    types = {name: dir(getattr(bpy.types, name)) for name in dir(bpy.types)}
    handlers = {
        name: value for name in dir(bpy.app.handlers) if isinstance(value := getattr(bpy.app.handlers, name), list)
    }
    keymaps = bpy.context.window_manager.keyconfigs.addon.keymaps
    return {
        "types": sorted(types),
        "attributes": sorted(f"{name}.{attribute}" for name, attributes in types.items() for attribute in attributes),
        "operators": sorted(dir(bpy.ops.vellus)),
        "handlers": sorted(f"{name}: {function!r}" for name, functions in handlers.items() for function in functions),
        "draw handlers": sorted(map(repr, draw_handlers)),
        "keymaps": sorted(f"{keymap.name}: {item.idname}" for keymap in keymaps for item in keymap.keymap_items),
        "modules": sorted(name for name in sys.modules if name.startswith(MODULE)),
        "path": sys.path,
        "drivers": sorted(bpy.app.driver_namespace),
        "data": sorted(repr(block) for block in bpy.data.user_map()),
    }


def _count_draw_handlers():
    """Handles that SpaceView3D holds: Blender gives no list, so its two functions are wrapped."""
    space, handles = bpy.types.SpaceView3D, []
    add, remove = space.draw_handler_add, space.draw_handler_remove

    def counting_add(*arguments):
        handles.append(add(*arguments))
        return handles[-1]

    def counting_remove(handle, region):
        remove(handle, region)
        handles.remove(handle)

    space.draw_handler_add, space.draw_handler_remove = counting_add, counting_remove
    return handles


if __name__ == "__main__":
    verb, zip_argument, folder_argument = sys.argv[1:]
    verbs = {"install": install_and_use, "twice": twice}
    outcome = verbs[verb](zip_argument, Path(folder_argument))
    print(json.dumps(outcome))
