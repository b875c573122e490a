# SPDX-License-Identifier: GPL-3.0-or-later
"""State between calls is a cache named in blender/live/invalidation.py, or a listed handle, job or lock."""

import ast

from tests.test_conventions import MODULES, name_of, no_garbage_collection, nodes, syntax  # noqa: F401 (a fixture)

# State that is no cache → the event that resets it.
STATE = {
    "blender/data/scene.py: _read_once": "the end of reading a viewport's scene, a context",
    "blender/data/whole_changes.py: _open": "the end of each step of a change, a context",
    "blender/groom/guides/brushes.py: _fitted": "nobody: Blender's brushes and what was set in them outlive a file",
    "blender/groom/dynamics/guide_baking.py: _baking": "the end of baking, on every way out",
    "blender/host/background_process.py: _running": "unregister",
    "blender/host/cli_command.py: _command": "unregister",
    "blender/host/memory.py: _asks": "asking, a context",
    "blender/host/running.py: _job": "end",
    "blender/host/running.py: _work": "end",
    "blender/host/running.py: _timer": "end",
    "blender/live/first_setup.py: _job": "unregister",
    "blender/live/evaluation.py: _evaluated": "Curves during their evaluation",
    "blender/live/handlers.py: _is_opening": "the first update after a file was opened",
    "blender/live/handlers.py: _is_undone": "the first update after an undo",
    "blender/live/hidden_previews.py: _handles": "unregister",
    "blender/render/frames/engine.py: _listener": "listening, a context",
    "blender/render/late_layers.py: _jobs": "the end of each thread, at the latest unregister",
    "blender/render/viewport/live_light.py: _jobs": "the end of each share, at the latest unregister",
    "blender/render/viewport/viewport.py: _handles": "unregister",
    "blender/ui/brush_circle.py: _held": "the end of changing a brush by the mouse, on every way out",
    "blender/ui/look_previews.py: _previews": "unregister",
    # Kernels stay loaded as long as Python runs.
    "core/kernels/kernel_cache.py: _choosing": "nobody: a lock",
    "core/kernels/kernel_cache.py: _loaded": "nobody",
    "core/kernels/kernel_cache.py: _locks": "nobody",
    "core/kernels/kernel_setup.py: _under_way": "the end of each loading, at the latest Python's",
    "blender/gpu/drawing.py: ALONE": "nobody: a lock",
}

# Functions of their arguments alone, and of what the extension was installed with: what they return is never stale.
PURE = {
    "blender/gpu/drawing.py: _parts",
    "blender/gpu/surface_textures.py: _row_of",
    "blender/gpu/programs/uniforms.py: settings_block",
    "blender/host/paths.py: addon_version",
    "blender/host/system_memory.py: _host",
    "blender/settings/setting_properties.py: _settings_of",
    "blender/settings/setting_properties.py: as_stored",
    "blender/settings/translations.py: _patterns",
    "blender/settings/translations.py: _sentences",
    "blender/settings/translations.py: _taken_apart",
    "blender/live/updates.py: _collection_of",
    "core/dynamics/rod/stiffness_advice.py: tip_sink",
    "core/geometry/curves/bspline.py: basis_matrix",
    "core/geometry/curves/bspline.py: _device_matrix",
    "core/geometry/curves/bspline.py: _controls_matrix",
    "core/kernels/compiled_kernels.py: _fitting",
    "core/kernels/compiled_kernels.py: _fitting_gpu",
    "core/maps/pixels.py: _linear_bytes",
    "core/maps/varied_settings.py: all_varied",
    "core/maps/varied_settings.py: of_styles",
    "core/maps/varied_settings.py: with_course",
    "core/params.py: _declared",
    "core/shading/appearance.py: _mean_reflectance",
    "core/shading/appearance.py: neutral",
    "core/shading/appearance.py: strand_settings",
    "core/shading/appearance.py: table_settings",
    "core/shading/appearance.py: wetted",
    "core/shading/tables/surface_albedo.py: table",
    "core/styling/kinds.py: varied_numbers_of",
}

_DISPLAYS = (ast.Dict, ast.DictComp, ast.List, ast.ListComp, ast.Set, ast.SetComp)
_CONTAINERS = {"dict", "list", "set"}
_HELD = {"defaultdict", "deque", "Counter", "OrderedDict", "WeakKeyDictionary", "WeakSet", "WeakValueDictionary"}
_HELD |= {"Lock", "RLock", "Condition", "Event", "Queue"}
_CHANGING = {
    "append",
    "add",
    "update",
    "pop",
    "popitem",
    "clear",
    "remove",
    "discard",
    "extend",
    "insert",
    "setdefault",
}


def called(node):
    """Return the name of what an expression calls, without its module; empty if it calls nothing."""
    return ast.unparse(node.func).rpartition(".")[2] if isinstance(node, ast.Call) else ""


def module_values(tree):
    """Return {name: value} of what a module assigns at its top."""
    assigned = [node for node in tree.body if isinstance(node, ast.Assign | ast.AnnAssign)]
    pairs = [(t, node) for node in assigned for t in (node.targets if isinstance(node, ast.Assign) else [node.target])]
    return {target.id: node.value for target, node in pairs if isinstance(target, ast.Name)}


def changed_in_place(tree):
    """Return names that are written to by key, or by a method that changes its object."""
    for node in nodes(tree):
        is_written = isinstance(node, ast.Subscript) and not isinstance(node.ctx, ast.Load)
        if is_written or (isinstance(node, ast.Attribute) and node.attr in _CHANGING):
            yield ast.unparse(node.value)


def state_of(tree):
    """Return names of a module whose values may change while it is loaded, except caches."""
    found = {name for node in nodes(tree) if isinstance(node, ast.Global) for name in node.names}
    changed = set(changed_in_place(tree))
    for name, value in module_values(tree).items():
        is_container = isinstance(value, _DISPLAYS) or called(value) in _CONTAINERS
        if called(value) in _HELD or (is_container and (name in changed or not name.isupper())):
            found.add(name)
    return found - {"__all__"}


def cached_functions(tree):
    """Return names of functions under `functools.cache` or `lru_cache`."""
    for node in nodes(tree):
        if isinstance(node, ast.FunctionDef):
            names = {ast.unparse(decorator).partition("(")[0].rpartition(".")[2] for decorator in node.decorator_list}
            if names & {"cache", "lru_cache"}:
                yield node.name


def found_by(search):
    return {f"{name_of(path)}: {name}" for path in MODULES for name in search(syntax(path))}


def test_whatever_changes_at_module_level_is_listed():
    assert found_by(state_of) == set(STATE)


def test_functions_whose_results_are_kept_are_listed():
    assert found_by(cached_functions) == PURE


def test_caches_stand_at_the_top_of_a_module():
    """Caches are at the top of a module, where `invalidation.CACHES` can name them."""
    for path in MODULES:
        tree = syntax(path)
        made = sorted(node.lineno for node in nodes(tree) if called(node) == "Cache")
        assert made == [value.lineno for value in module_values(tree).values() if called(value) == "Cache"], path
