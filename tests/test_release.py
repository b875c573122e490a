# SPDX-License-Identifier: GPL-3.0-or-later
"""A release has the locked versions in manifest and lock file, and nothing of one machine."""

import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.support.each_file import ROOT, each_file
from tools import build_extension

MANIFEST = build_extension.manifest()
GROUPS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["dependency-groups"]
REQUIREMENTS = {group: [Requirement(line) for line in lines] for group, lines in GROUPS.items()}
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")
# One entry a package: its pin, its hashes, and the comment that says who asked for it.
LOCKED = {entry.split("==")[0]: entry for entry in re.split(r"\n(?=\S)", LOCK)}

TEXT_FOLDERS = ["hair_addon", "shaders", "tests", "tools", "blend_samples", ".ci"]
TEXT_SUFFIXES = {"", ".py", ".sh", ".md", ".toml", ".txt", ".lock", ".glsl", ".frag", ".vert", ".comp"}
TEXT_SUFFIXES |= {".cpp", ".h", ".strand"}
TEXTS = [path for folder in TEXT_FOLDERS for path in sorted((ROOT / folder).rglob("*"))] + sorted(ROOT.glob("*"))
TEXTS = [path for path in TEXTS if path.is_file() and path.suffix in TEXT_SUFFIXES and path != Path(__file__)]


def version_of(package):
    return re.match(r"[\w-]+==([^\s;\\]+)", LOCKED[package])[1]


@each_file(TEXTS)
def test_no_registry_address(path):
    """The checkout has no registry address, as each machine chooses its own package sources."""
    text = path.read_text(encoding="utf-8")
    registries = r"https?://\S*(pypi|pythonhosted|/simple\b|artifact)"
    options = r"(?<!emit-)\b(extra-)?index-url\b|--find-links|--index\b|--trusted-host"
    assert re.search(f"{registries}|{options}", text) is None


@each_file(TEXTS)
def test_no_path_of_one_machine(path):
    found = re.search(r"(?<![\w.~}/])/(root|home|Users|work)/|[A-Z]:\\Users", path.read_text(encoding="utf-8"))
    assert found is None, found


@each_file(TEXTS)
def test_version_stands_only_in_the_manifest(path):
    if path.name in {"blender_manifest.toml", "CHANGELOG.md"}:
        return
    literal = rf"(?<![\d.]){re.escape(MANIFEST['version'])}(?![\d.])"
    # Other people's versions may be the same number: the lock's pins carry two equal signs.
    text = re.sub(r"==\S+", "", path.read_text(encoding="utf-8"))
    assert re.search(literal, text) is None


def test_changelog_has_the_version():
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(rf"^## \[{re.escape(MANIFEST['version'])}\]", changelog, re.MULTILINE)


@pytest.mark.parametrize("package", LOCKED)
def test_lock_pins_and_hashes(package):
    entry = LOCKED[package]
    assert version_of(package)
    assert re.search(r"--hash=sha256:[0-9a-f]{64}", entry)
    assert "://" not in entry and " @ " not in entry


@pytest.mark.parametrize("group", sorted(set(REQUIREMENTS) - {"bench"}))
def test_lock_is_in_step_with_pyproject(group):
    for requirement in REQUIREMENTS[group]:
        assert requirement.specifier.contains(version_of(canonicalize_name(requirement.name)))
    asked_for = {package for package, entry in LOCKED.items() if f"(pyproject.toml:{group})" in entry}
    assert asked_for == {canonicalize_name(requirement.name) for requirement in REQUIREMENTS[group]}


def test_peers_are_pinned_apart():
    """Peers, which only `make bench` needs, are pinned in a lock of their own, in the same versions as the main
    lock.
    """
    text = (ROOT / "requirements-bench.lock").read_text(encoding="utf-8")
    pins = dict(re.findall(r"^([\w-]+)==([^\s;\\]+)", text, re.MULTILINE))
    assert {canonicalize_name(requirement.name) for requirement in REQUIREMENTS["bench"]} <= set(pins)
    assert all(version_of(package) == pins[package] for package in set(pins) & set(LOCKED))


@pytest.mark.parametrize("platform", MANIFEST["platforms"])
def test_each_platform_has_its_wheels(platform):
    """Each platform has its wheels in the locked versions: Warp for any Python, OpenEXR for Python 3.13 and 3.14."""
    wheels = [wheel.name.split("-")[:3] for wheel in build_extension.wheels_of(platform)]
    openexr, warp = version_of("openexr"), version_of("warp-lang")
    assert sorted(wheels) == [["openexr", openexr, "cp313"], ["openexr", openexr, "cp314"], ["warp_lang", warp, "py3"]]


def test_a_foreign_wheel_is_refused(tmp_path):
    wheel = tmp_path / build_extension.wheels_of("linux-x64")[0].name
    wheel.write_bytes(b"something else")
    assert not build_extension.is_locked(wheel)
    with pytest.raises(build_extension.BuildError, match="does not pin"):
        build_extension.lock_entry("something-else")
