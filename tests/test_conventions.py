# SPDX-License-Identifier: GPL-3.0-or-later
"""Conventions of CONTRIBUTING.md: which file may import which, and which package code belongs to."""

import ast
import functools
import gc
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.each_file import ROOT, each_file
from tests.support.syntax import nodes_of

ADDON = ROOT / "hair_addon"
MODULES = sorted(ADDON.rglob("*.py"))
NATIVE = sorted(path for path in ADDON.rglob("*") if path.suffix in {".cpp", ".h", ".strand"})
SHADERS = sorted(path for path in (ROOT / "shaders").rglob("*") if path.suffix in {".glsl", ".frag", ".vert", ".comp"})
SCRIPTS = [path for name in ("tests", "tools", "blend_samples") for path in sorted((ROOT / name).rglob("*.py"))]
SCRIPTS += [ROOT / "__init__.py", ROOT / "tools" / "bootstrap.sh", ROOT / ".ci" / "run"]
CODE = MODULES + NATIVE + SHADERS + SCRIPTS


def name_of(path):
    """Return the path inside the add-on as CONTRIBUTING.md writes it: core/geometry/mesh.py."""
    return path.relative_to(ADDON).as_posix()


@pytest.fixture(autouse=True, scope="module")
def no_garbage_collection():
    """Parse without garbage collection, which would visit a million nodes of syntax again and again."""
    gc.disable()
    yield
    gc.enable()


@functools.cache
def syntax(path):
    return ast.parse(path.read_text(encoding="utf-8"), path)


@functools.cache
def nodes(tree):
    """Return all nodes of a file's syntax, walked once for all rules."""
    return nodes_of(tree)


def listed_packages():
    """Return CONTRIBUTING.md's list of packages, top to bottom."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return [line.split()[0] for line in re.search(r"## Packages.*?```\n(.*?)```", text, re.DOTALL)[1].splitlines()]


PACKAGES = listed_packages()
# Of which nobody imports anything: the add-on itself, and `python -m`.
ROOTS = {"__init__", "__main__"}


def package_of(path):
    """Return the listed package that a file is in."""
    name = name_of(path).removesuffix(".py")
    if name in ROOTS:
        return ""
    return name.rpartition("/")[0]


@functools.cache
def imports(path):
    """Return every import of a file, also nested: (line, absolute dotted name or None, file inside the add-on or
    None).
    """
    found = []
    for node in nodes(syntax(path)):
        if isinstance(node, ast.Import):
            found += ((node.lineno, alias.name, None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found += ((node.lineno, f"{node.module}.{alias.name}", None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            found += ((node.lineno, None, _imported_file(base, alias.name)) for alias in node.names)
    return found


@functools.cache
def _imported_file(base, name):
    """Return the file from which `from base import name` takes the name."""
    candidates = [base / f"{name}.py", base / name / "__init__.py", base.with_suffix(".py")]
    return next(filter(Path.is_file, candidates), base / "__init__.py")


def outside_imports(path):
    """Return (line, dotted name) of what a file imports from outside the add-on."""
    return [(line, name) for line, name, _ in imports(path) if name is not None]


# -------------------------------------------------------------------------------------------------- the packages


def test_every_package_is_listed_and_says_what_lives_in_it():
    packages = {package_of(path) for path in MODULES} - {""}
    assert packages == set(PACKAGES)
    for package in packages - {"api"}:
        assert len(ast.get_docstring(syntax(ADDON / package / "__init__.py"))) > 20


@each_file(MODULES)
def test_a_package_imports_only_packages_above_it(path):
    package = package_of(path)
    if not package:
        return
    below = PACKAGES[PACKAGES.index(package) + 1 :]
    for line, _, target in imports(path):
        assert target is None or package_of(target) not in {*below, ""}, (
            f"{name_of(path)}:{line} imports {name_of(target)}, whose package stands below its own"
        )


@each_file(MODULES)
def test_no_import_stands_in_a_function(path):
    """No import is in a function: late imports belong in a package that imports its modules on first use."""
    tree = syntax(path)
    functions = [node for node in nodes(tree) if isinstance(node, ast.FunctionDef)]
    late = [node.lineno for function in functions for node in ast.walk(function) if isinstance(node, ast.ImportFrom)]
    assert name_of(path).removesuffix(".py") in ROOTS or not [line for line in late if line_is_ours(path, line)]


def line_is_ours(path, line):
    return any(number == line and target is not None for number, _, target in imports(path))


@each_file(MODULES)
def test_the_addon_imports_itself_relatively(path):
    """The add-on imports itself relatively, as Blender installs it as bl_ext.<repository>.vellus."""
    assert [(line, name) for line, name in outside_imports(path) if name.split(".")[0] == "hair_addon"] == []


# ------------------------------------------------------------------------------- which package code belongs to


def attribute_lines(tree, *chains):
    """Return the lines of attribute chains such as `bpy.props` or, for any object, `.foreach_get`."""
    for line, chain in _attribute_chains(tree):
        if any(chain == wanted or (wanted[0] == "." and f".{chain}".endswith(wanted)) for wanted in chains):
            yield line


@functools.cache
def _attribute_chains(tree):
    return [(node.lineno, _chain(node)) for node in nodes(tree) if isinstance(node, ast.Attribute)]


def _chain(node):
    """Return names joined by dots; what is neither a name nor an attribute, such as a call, becomes `()`."""
    if isinstance(node, ast.Attribute):
        return f"{_chain(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else "()"


def import_lines(path, *names):
    """Return the lines that import one of these packages, or anything in them."""
    return [line for line, name in outside_imports(path) if any(f"{name}.".startswith(f"{n}.") for n in names)]


def array_lines(path):
    """Return the lines where arrays of geometry pass between Blender and NumPy; a picture's pixels are not geometry."""
    tree = syntax(path)
    pixels = attribute_lines(tree, ".pixels.foreach_get", ".pixels.foreach_set", ".rect.foreach_set")
    return sorted({*attribute_lines(tree, ".foreach_get", ".foreach_set", ".attributes.new")} - {*pixels})


LAYOUT = [f"layout.{part}" for part in ("prop", "prop_search", "row", "column", "box", "label", "operator", "split")]

OWNERS = {
    "bpy": (lambda path: import_lines(path, "bpy", "mathutils", "bmesh", "bl_ui", "bpy_extras"), r"blender/.*"),
    "gpu": (lambda path: import_lines(path, "gpu", "gpu_extras"), r"blender/(gpu|render)/.*"),
    "bpy.props": (
        lambda path: [*attribute_lines(syntax(path), "bpy.props"), *import_lines(path, "bpy.props")],
        r"blender/settings/.*",
    ),
    "Blender's arrays": (array_lines, r"blender/(data/.*|ui/look_previews\.py)"),
    "layout": (
        lambda path: list(attribute_lines(syntax(path), *LAYOUT)),
        r"blender/(ui/.*|settings/preferences\.py)",
    ),
    # A redo panel's layout is handed on to setting_rows.py, which draws what the panels draw.
    ".layout": (
        lambda path: list(attribute_lines(syntax(path), ".layout")),
        r"blender/(ui/.*|settings/preferences\.py)",
    ),
    "self.report": (
        lambda path: list(attribute_lines(syntax(path), "self.report")),
        r"blender/(ui/operators/.*|render/frames/engine\.py)",
    ),
    "wp.kernel": (lambda path: list(attribute_lines(syntax(path), "wp.kernel", "wp.func")), r"core/.*"),
    "kernels": (
        lambda path: list(
            attribute_lines(syntax(path), "wp.launch", "wp.force_load", "wp.load_module", "wp.init", "wp.config")
        ),
        r"core/kernels/.*",
    ),
    "which frame it is": (
        lambda path: list(
            attribute_lines(
                syntax(path),
                *(".frame_current", ".frame_current_final", ".frame_subframe", ".frame_float"),
                *("blender_scene.frame_set", "scene.frame_set", "depsgraph.mode"),
            )
        ),
        r"blender/host/scene_time\.py",
    ),
    "OpenEXR": (lambda path: import_lines(path, "OpenEXR"), r"core/files/.*"),
}


@each_file(MODULES)
def test_code_is_in_its_package(path):
    others = {rule: row for rule, row in OWNERS.items() if not re.fullmatch(row[1], name_of(path))}
    found = {f"{rule} belongs in {places}": lines_of(path) for rule, (lines_of, places) in others.items()}
    assert {rule: lines for rule, lines in found.items() if lines} == {}


@each_file(MODULES)
def test_native_code_stands_in_files(path):
    """C++ and CUDA are in a file beside the module that declares the function."""
    calls = [node for node in nodes(syntax(path)) if isinstance(node, ast.Call)]
    sources = [ast.unparse(call.args[0]) for call in calls if _chain(call.func) == "wp.func_native"]
    assert [source for source in sources if not source.startswith("native_code.body(__file__,")] == []


@each_file(NATIVE)
def test_native_code_fits_the_columns_of_python(path):
    assert max(map(len, path.read_text(encoding="utf-8").splitlines())) <= 120


OPERATORS = ADDON / "blender" / "ui" / "operators"


@each_file(OPERATORS.glob("*.py"))
def test_tuples_name_every_operator_and_every_file_of_operators(path):
    """Tuples name every operator and every file of operators, as Blender registers only these."""
    tuples = [
        node for node in nodes(syntax(path)) if isinstance(node, ast.Assign) and isinstance(node.value, ast.Tuple)
    ]
    named = {ast.unparse(element) for node in tuples for element in node.value.elts}
    if path.stem == "__init__":
        assert named == {file.stem for file in path.parent.glob("[a-z]*.py")}
    else:
        operators = {node.name for node in nodes(syntax(path)) if isinstance(node, ast.ClassDef)}
        assert {name for name in operators if name.startswith("VELLUS_OT_")} <= named


# -------------------------------------------------------------------------------------------------------- types


def public_functions(body):
    """Return public functions and methods, and methods that operators call, such as __len__, without kernels."""
    for node in body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from public_functions(node.body)
        elif isinstance(node, ast.FunctionDef) and re.match(r"[^_]|__", node.name):
            if not any(ast.unparse(decorator).startswith("wp.") for decorator in node.decorator_list):
                yield node


@each_file([path for path in MODULES if re.match(r"core/|api|blender/groom/", name_of(path))])
def test_public_functions_have_type_annotations(path):
    for function in public_functions(syntax(path).body):
        given = function.args
        arguments = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
        untyped = [a.arg for a in arguments if a and a.annotation is None and a.arg not in {"self", "cls"}]
        assert untyped == [] and function.returns is not None, f"{name_of(path)}:{function.lineno} {function.name}"


# ------------------------------------------------------------------------------------- what runs, and what may not


def run_python(program, **environment):
    """Run a program in a fresh interpreter at the checkout; returns what it printed."""
    inherited = os.environ | environment
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, env=inherited)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_core_imports_without_blender():
    names = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in MODULES if "core" in path.parts]
    run_python(
        "import importlib, sys\n"
        "for name in ('bpy', 'gpu', 'mathutils', 'bmesh'): sys.modules[name] = None\n"
        f"for name in {names}: importlib.import_module(name)\n"
    )


def test_register_is_light():
    """Registering imports neither Warp nor what is used later, as Blender registers add-ons while it starts.

    The time is a benchmark (test_registering.py).
    """
    source = (
        "import sys, bpy\n"
        "before = set(sys.modules)\n"
        "import hair_addon\n"
        "hair_addon.register()\n"
        "print(*(set(sys.modules) - before))\n"
        "hair_addon.unregister()\n"
    )
    imported = set(run_python(source).splitlines()[-1].split())
    assert not imported & {"warp", "scipy", "pxr", "asyncio", "multiprocessing"}
    assert len([name for name in imported if name.split(".")[0] != "hair_addon"]) < 40, sorted(imported)
    # Files are written and read long after the start.
    assert not [
        name for name in imported if name.startswith(("hair_addon.blender.io.", "hair_addon.core.files.alembic."))
    ]
    # With kernels comes Warp.
    kernels = [path for path in MODULES if "@wp.kernel" in path.read_text(encoding="utf-8")]
    assert kernels and not imported & {".".join(path.relative_to(ROOT).with_suffix("").parts) for path in kernels}


CLOCKS = re.compile(r"\b(perf_counter|process_time|thread_time|timeit)\b|time\.time\(|monotonic\(\) - ")
TESTS = sorted((ROOT / "tests").rglob("test_*.py"))
BENCHMARKS = [path for path in TESTS if path.parent.name == "benchmarks"]


@each_file(path for path in TESTS if path not in {*BENCHMARKS, Path(__file__)})
def test_no_test_but_benchmarks_holds_a_clock_to_a_limit(path):
    """No test except benchmarks has a time limit, as it would fail on a busy machine; tests count operations."""
    assert not CLOCKS.search(path.read_text(encoding="utf-8"))


@each_file(BENCHMARKS)
def test_every_benchmark_is_long(path):
    """Every benchmark is `long`, except those of memory, which `make test` runs as other work does not change them."""
    tests = [node for node in syntax(path).body if getattr(node, "name", "").startswith("test_")]
    unmarked = [test.name for test in tests if not any("mark.long" in ast.unparse(d) for d in test.decorator_list)]
    assert tests and not unmarked, unmarked


@each_file(NATIVE)
def test_no_compiler_fuses_as_it_likes(path):
    """No compiler fuses operations implicitly, so a strand has the same bits on every processor; `fused` in lanes.h
    fuses.
    """
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"#pragma (clang fp|STDC|float_control)", text)
    assert path.name == "lanes.h" or not re.search(r"fmaf?\b", text)


# RELIABILITY: somebody hostile supplies the .blend; and an extension has no business on the network.
FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__"}
FORBIDDEN_MODULES = ("pickle", "marshal", "shelve", "socket", "urllib", "http", "requests", "ctypes", "subprocess")


@each_file(MODULES)
def test_nothing_from_a_file_can_become_code(path):
    tree = syntax(path)
    calls = [node for node in nodes(tree) if isinstance(node, ast.Call)]
    assert [ast.unparse(call) for call in calls if _chain(call.func) in FORBIDDEN_CALLS] == []
    assert [
        ast.unparse(call) for call in calls if any(keyword.arg == "allow_pickle" for keyword in call.keywords)
    ] == []
    # Words that start processes come from the user's own command line, or from this package, in one place each.
    # And the system is asked for its free memory in one, by calls in which nothing is from a file.
    allowed = {"command_line/helpers.py": {"subprocess"}, "blender/host/background_process.py": {"subprocess"}}
    allowed |= {"blender/host/system_memory.py": {"ctypes"}}
    forbidden = set(FORBIDDEN_MODULES) - allowed.get(name_of(path), set())
    assert import_lines(path, *forbidden) == []
    assert list(attribute_lines(tree, ".driver_namespace")) == []


# ----------------------------------------------------------------------------------------- files and their sources


@each_file(CODE)
def test_file_names_its_licence_first(path):
    first = next(line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#!"))
    assert first.lstrip("#/ ") == "SPDX-License-Identifier: GPL-3.0-or-later"


@each_file(CODE)
def test_files_stay_below_700_lines(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 700


FOLDERS = sorted({path.parent for path in CODE if path.suffix == ".py"})


@each_file(FOLDERS)
def test_folders_have_25_modules_at_most(folder):
    assert len(list(folder.glob("*.py"))) <= 25


# [Key] or [Key, section]; after a word or a bracket it would be a subscript.
KEY = re.compile(r"(?<![\w\])])\[([A-Z][A-Za-z]+\d\d[a-z]?)(?:, [^\]]+)?\]")


def test_every_source_is_cited_and_every_citation_has_a_source():
    references = (ROOT / "REFERENCES.md").read_text(encoding="utf-8").splitlines()
    sources = {match[1] for line in references if (match := re.match(r"\W*\[(\w+)\]", line))}
    cited = {key for path in CODE for key in KEY.findall(path.read_text(encoding="utf-8"))}
    assert cited == sources
