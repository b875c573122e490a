# SPDX-License-Identifier: GPL-3.0-or-later
"""The rules of the house (CONTRIBUTING.md): which file may use which, and which room a line belongs to."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
ADDON = ROOT / "hair_addon"
MODULES = sorted(ADDON.rglob("*.py"))
SHADERS = sorted(path for path in (ROOT / "shaders").rglob("*") if path.suffix in {".glsl", ".frag", ".vert", ".comp"})
SCRIPTS = [path for name in ("tests", "tools", "blend_samples") for path in sorted((ROOT / name).rglob("*.py"))]
SCRIPTS += [ROOT / "__init__.py", ROOT / "tools" / "bootstrap.sh", ROOT / ".ci" / "run"]
CODE = MODULES + SHADERS + SCRIPTS


def name_of(path):
    """Path inside the add-on, as CONTRIBUTING.md writes it: core/mesh.py."""
    return path.relative_to(ADDON).as_posix()


def each(paths):
    """Parametrize a test over files."""
    return pytest.mark.parametrize("path", paths, ids=lambda path: path.relative_to(ROOT).as_posix())


def syntax(path):
    return ast.parse(path.read_text(encoding="utf-8"), path)


def page_order():
    """CONTRIBUTING.md's tree as a list of files, top to bottom; `*.py` stands for a folder's other files."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    tree = re.search(r"## The page order.*?```\n(.*?)```", text, re.DOTALL)[1]
    order, folders = [], []
    for line in tree.splitlines()[1:]:  # the first is hair_addon/ itself
        depth = (len(line) - len(line.lstrip())) // 2 - 1
        name = line.split()[0]
        folders[depth:] = [name] if name.endswith("/") else []
        if not name.endswith("/"):
            order.append("".join(folders) + name)
    return order


ORDER = page_order()


def rank(name):
    """Place in the page order. A package's `__init__` stands at its folder's end, as it may use all that is in it."""
    folder, _, file = name.rpartition("/")
    if name in ORDER:
        return ORDER.index(name)
    if file == "__init__.py":
        return max(place for place, entry in enumerate(ORDER) if entry.startswith(f"{folder}/"))
    assert f"{folder}/*.py" in ORDER, f"give {name} its line in CONTRIBUTING.md, The page order"
    return ORDER.index(f"{folder}/*.py")


def imports(path):
    """Every import of a file, nested ones too: (line, absolute dotted name or None, file inside the add-on or None)."""
    for node in ast.walk(syntax(path)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name, None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield from ((node.lineno, f"{node.module}.{alias.name}", None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            for alias in node.names:
                candidates = [base / f"{alias.name}.py", base / alias.name / "__init__.py", base.with_suffix(".py")]
                yield node.lineno, None, next(filter(Path.is_file, candidates), base / "__init__.py")


def outside_imports(path):
    """(line, dotted name) of what a file imports from outside the add-on."""
    return [(line, name) for line, name, _ in imports(path) if name is not None]


# ---------------------------------------------------------------------------------------------- the page order


@each(MODULES)
def test_file_has_a_place_in_the_page_order(path):
    rank(name_of(path))


def test_page_order_lists_only_what_exists():
    assert [entry for entry in ORDER if not list(ADDON.glob(entry))] == []


@each(MODULES)
def test_imports_point_up_the_page(path):
    for line, _, target in imports(path):
        if target is None:
            continue
        is_its_folder = path.name == "__init__.py" and target.is_relative_to(path.parent)
        assert is_its_folder or rank(name_of(target)) < rank(name_of(path)), (
            f"{name_of(path)}:{line} imports {name_of(target)}, which stands below it in the page order"
        )


@each(MODULES)
def test_the_addon_imports_itself_relatively(path):
    """Blender installs it as bl_ext.<repository>.vellus: no other name of it can be known."""
    assert [(line, name) for line, name in outside_imports(path) if name.split(".")[0] == "hair_addon"] == []


# --------------------------------------------------------------------------------- does a line know its room?


def attribute_lines(tree, *chains):
    """Lines of attribute chains such as `bpy.props` or, for any object, `.foreach_get`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            chain = ast.unparse(node)
            if any(chain == wanted or (wanted[0] == "." and f".{chain}".endswith(wanted)) for wanted in chains):
                yield node.lineno


def import_lines(path, *names):
    """Lines that import one of these packages, or anything in them."""
    return [line for line, name in outside_imports(path) if any(f"{name}.".startswith(f"{n}.") for n in names)]


def array_lines(path):
    """Where arrays of geometry pass between Blender and NumPy; a picture's pixels are not geometry."""
    tree = syntax(path)
    pixels = attribute_lines(tree, ".pixels.foreach_get", ".pixels.foreach_set", ".rect.foreach_set")
    return sorted({*attribute_lines(tree, ".foreach_get", ".foreach_set", ".attributes.new")} - {*pixels})


LAYOUT = [".layout", *(f"layout.{part}" for part in ("prop", "row", "column", "box", "label", "operator", "split"))]

ROOMS = {
    "bpy": (lambda path: import_lines(path, "bpy", "mathutils", "bmesh", "bl_ui", "bpy_extras"), r"blender/.*"),
    "gpu": (
        lambda path: import_lines(path, "gpu", "gpu_extras"),
        r"blender/(uniforms|shaders|render_programs|strand_textures|hair_shading|drawing|hair_buffer|shadows|visibility"
        r"|surroundings|hair_picture|viewport|render|film)\.py",
    ),
    "bpy.props": (
        lambda path: [*attribute_lines(syntax(path), "bpy.props"), *import_lines(path, "bpy.props")],
        r"blender/(properties|preferences)\.py",
    ),
    "Blender's arrays": (array_lines, r"blender/(scene|partings|attributes|curves)\.py"),
    "layout": (
        lambda path: list(attribute_lines(syntax(path), *LAYOUT)),
        r"blender/(panels/.*|menus\.py|preferences\.py)",
    ),
    "self.report": (
        lambda path: list(attribute_lines(syntax(path), "self.report")),
        r"blender/(operators/.*|engine\.py)",
    ),
    "wp.kernel": (lambda path: list(attribute_lines(syntax(path), "wp.kernel", "wp.func")), r"core/.*"),
    "OpenEXR": (lambda path: import_lines(path, "OpenEXR"), r"core/exr\.py"),
}


@pytest.mark.parametrize("rule", ROOMS)
@each(MODULES)
def test_a_line_knows_its_room(path, rule):
    lines_of, rooms = ROOMS[rule]
    if not re.fullmatch(rooms, name_of(path)):
        assert lines_of(path) == [], f"{rule} belongs in {rooms}"


@pytest.mark.parametrize("folder", [entry.removesuffix("*.py") for entry in ORDER if entry.endswith("*.py")])
def test_folder_tuple_names_every_file(folder):
    """What grows without end is found by its folder's tuple, one line each."""
    files = {path.stem for path in (ADDON / folder).glob("*.py") if name_of(path) not in ORDER} - {"__init__"}
    tree = syntax(ADDON / folder / "__init__.py")
    imported = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    file_of = {alias.asname or alias.name: node.module or alias.name for node in imported for alias in node.names}
    tuples = [node for node in ast.walk(tree) if isinstance(node, ast.Tuple)]
    assert files == {file_of[ast.unparse(element)] for node in tuples for element in node.elts}


# ------------------------------------------------------------------------------------- what runs, and what may not


def run_python(program):
    """Run a program in a fresh interpreter at the checkout; returns what it printed."""
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
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
    """Blender registers add-ons while an artist waits for it to start: no Warp (0.6 s), so no compiling either."""
    printed = run_python(
        "import bpy, sys, time\n"
        "start = time.process_time()\n"
        "import hair_addon\n"
        "hair_addon.register()\n"
        "seconds = time.process_time() - start\n"
        "heavy = [name for name in ('warp', 'scipy') if name in sys.modules]\n"
        "assert not heavy, heavy\n"
        "hair_addon.unregister()\n"
        "print(seconds)\n"
    )
    assert float(printed.split()[-1]) < 0.3


# RELIABILITY: somebody hostile supplies the .blend; and an extension has no business on the network.
FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__"}
FORBIDDEN_MODULES = ("pickle", "marshal", "shelve", "socket", "urllib", "http", "requests", "ctypes", "subprocess")


@each(MODULES)
def test_nothing_from_a_file_can_become_code(path):
    tree = syntax(path)
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    assert [ast.unparse(call) for call in calls if ast.unparse(call.func) in FORBIDDEN_CALLS] == []
    assert [
        ast.unparse(call) for call in calls if any(keyword.arg == "allow_pickle" for keyword in call.keywords)
    ] == []
    # Words that start processes come from the user's own command line, in one place.
    forbidden = set(FORBIDDEN_MODULES) - ({"subprocess"} if name_of(path) == "command_line/helpers.py" else set())
    assert import_lines(path, *forbidden) == []
    assert list(attribute_lines(tree, ".driver_namespace")) == []


# ------------------------------------------------------------------------------------------------------ the pages


@each(CODE)
def test_file_names_its_licence_first(path):
    first = next(line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#!"))
    assert first.lstrip("#/ ") == "SPDX-License-Identifier: GPL-3.0-or-later"


@each(CODE)
def test_file_is_one_room(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400


# [Key] or [Key, section]; after a word or a bracket it would be a subscript.
KEY = re.compile(r"(?<![\w\])])\[([A-Z][A-Za-z]+\d\d[a-z]?)(?:, [^\]]+)?\]")


def test_every_source_is_cited_and_every_citation_has_a_source():
    references = (ROOT / "REFERENCES.md").read_text(encoding="utf-8").splitlines()
    sources = {match[1] for line in references if (match := re.match(r"\W*\[(\w+)\]", line))}
    cited = {key for path in CODE for key in KEY.findall(path.read_text(encoding="utf-8"))}
    assert cited == sources
