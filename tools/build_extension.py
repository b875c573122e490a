# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's zip, one per platform: `python tools/build_extension.py [linux-x64|windows-x64|macos-arm64|all]`.

With `--kernels` it only compiles the kernels that tests load, which `make test` does before all tests. With `--gpus`
the zip also contains kernels for NVIDIA GPUs, which take many minutes to compile; otherwise Warp compiles them on first
use.

Blender's own builder (blender_ext.py, inside the bpy wheel) builds and validates. It needs all wheels of all
platforms, so it gets a staged copy whose manifest lists one platform and the wheels of that platform.
"""

import argparse
import fnmatch
import hashlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from hair_addon.core.files import file_lock  # noqa: E402
from tools import compile_kernels, manual_pages  # noqa: E402

# Suffix of a wheel's file name → Blender platform.
PLATFORM_TAGS = {"linux-x64": "_x86_64.whl", "windows-x64": "-win_amd64.whl", "macos-arm64": "_arm64.whl"}


class BuildError(Exception):
    """A build error that the user can fix; the message says how."""


def manifest() -> dict:
    """Parse blender_manifest.toml."""
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))


def left_out(folder: str, names: list[str]) -> set[str]:
    """Names in a folder that the manifest's patterns exclude: an `ignore` for `shutil.copytree`."""
    patterns = manifest()["build"]["paths_exclude_pattern"]
    applying = [pattern.strip("/") for pattern in patterns if Path(folder) == ROOT or not pattern.startswith("/")]
    return {name for pattern in applying for name in fnmatch.filter(names, pattern)}


def zip_path(target: str) -> Path:
    """dist/vellus-VERSION-PLATFORM.zip."""
    fields = manifest()
    return ROOT / "dist" / f"{fields['id']}-{fields['version']}-{target}.zip"


def wheels_of(target: str) -> list[Path]:
    """Return the manifest's wheels that run on one platform."""
    wheels = [ROOT / wheel for wheel in manifest()["wheels"]]
    return [wheel for wheel in wheels if wheel.name.endswith(PLATFORM_TAGS[target])]


def lock_entry(package: str) -> str:
    """Return the lines of requirements.lock that pin one package, hashes included."""
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    entry = re.search(rf"^{re.escape(package)}==(?:.*\\\n)*.*\n", lock, re.MULTILINE)
    if entry is None:
        raise BuildError(f"requirements.lock does not pin {package}; run `make lock`.")
    return entry[0]


def is_locked(wheel: Path) -> bool:
    """Whether a wheel exists with the hash of requirements.lock."""
    if not wheel.is_file():
        return False
    with wheel.open("rb") as content:
        digest = hashlib.file_digest(content, "sha256").hexdigest()
    return f"sha256:{digest}" in lock_entry(package_of(wheel))


def package_of(wheel: Path) -> str:
    """warp_lang-1.19.0-….whl → warp-lang."""
    return wheel.name.split("-")[0].replace("_", "-")


def fetch(wheel: Path) -> None:
    """Download one wheel into wheels/; pip refuses it when its hash is not the lock's."""
    _, _, python_tag, _, platform_tag = wheel.stem.split("-")
    python_version = {"py3": "3.13", "cp313": "3.13", "cp314": "3.14"}[python_tag]
    requirement = ROOT / "build" / f"{package_of(wheel)}.txt"
    requirement.parent.mkdir(exist_ok=True)
    requirement.write_text(lock_entry(package_of(wheel)), encoding="utf-8")
    wheel.unlink(missing_ok=True)
    print(f"fetching {wheel.name}", flush=True)
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
    command += ["--require-hashes", "--only-binary=:all:", "--platform", platform_tag, "--python-version"]
    command += [python_version, "--dest", wheel.parent, "--requirement", requirement]
    if subprocess.run(command).returncode != 0:
        raise BuildError(f"{wheel.name} could not be downloaded; see pip's message above.")
    if not is_locked(wheel):
        raise BuildError(f"The manifest names {wheel.name}, which requirements.lock does not pin; correct its wheels.")


def kernel_folder(scope: str = "") -> Path:
    """Return the folder for `compiled_kernels` of the present sources; for tests, the folder without a scope if it
    exists.
    """
    folder = ROOT / "build" / "kernels" / compile_kernels.sources_digest()[:16]
    if not scope or (scope == "tests" and folder.exists()):
        return folder
    return folder.with_name(f"{folder.name}-{scope}")


def compiled_kernels(scope: str = "") -> Path:
    """Compile this platform's kernels if the sources have changed, which takes a minute. Returns their folder.

    Of several processes that ask for them at once, one compiles and the others wait.
    scope: "tests" to compile half of the kernels, "gpus" to add kernels for GPUs, as by options of compile_kernels.py.
    """
    folder = kernel_folder(scope)
    folder.parent.mkdir(parents=True, exist_ok=True)
    while not compile_kernels.are_up_to_date(folder):
        with file_lock.claim(folder) as is_ours:
            if not is_ours:
                time.sleep(0.2)
            elif not compile_kernels.are_up_to_date(folder):
                _compile_kernels(folder, scope)
    return folder


def _compile_kernels(folder: Path, scope: str) -> None:
    print("compiling kernels", flush=True)
    partial = folder.with_name(f"{folder.name}-{os.getpid()}")  # the folder appears whole
    options = [f"--{scope}"] if scope else []
    if subprocess.run([sys.executable, compile_kernels.__file__, partial, *options]).returncode != 0:
        raise BuildError("The kernels could not be compiled; see Warp's message above.")
    try:
        partial.rename(folder)
    except OSError:
        if not compile_kernels.are_up_to_date(folder):
            raise
        shutil.rmtree(partial)  # another process was first, on a file system without locks


def stage(target: str, scope: str = "") -> Path:
    """Stage the zip's content with a manifest for one platform. Returns its folder."""
    folder = ROOT / "build" / f"extension-{target}"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(ROOT, folder, ignore=left_out)
    if target == compile_kernels.this_platform() and target in compile_kernels.PROCESSORS:
        shutil.copytree(compiled_kernels(scope), folder / "kernels")
    else:
        print(
            f"{target}: its kernels are not compiled on another platform; Blender compiles them when Vellus is enabled"
        )
    (folder / "wheels").mkdir()
    for wheel in wheels_of(target):
        (folder / "wheels" / wheel.name).hardlink_to(wheel)
    manual_pages.write(folder / "manual")
    text = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    text = re.sub(r"^platforms = .*$", f'platforms = ["{target}"]', text, flags=re.MULTILINE)
    lines = text.splitlines(keepends=True)
    kept = [line for line in lines if ".whl" not in line or PLATFORM_TAGS[target] in line]
    (folder / "blender_manifest.toml").write_text("".join(kept), encoding="utf-8")
    return folder


def blender_ext(*arguments: str | Path) -> None:
    """Run Blender's extension tool."""
    # Find bpy without importing it: the import starts Blender.
    bpy = Path(importlib.util.find_spec("bpy").origin).parent
    (tool,) = bpy.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    if subprocess.run([sys.executable, tool, *arguments]).returncode != 0:
        raise BuildError(f"Blender's extension tool refused: {' '.join(map(str, arguments))}")


def build(target: str, scope: str = "") -> Path:
    """Build and validate the zip of one platform; raises BuildError. scope: as in `compiled_kernels`."""
    for wheel in wheels_of(target):
        if not is_locked(wheel):
            fetch(wheel)
    folder = stage(target, scope)
    output = zip_path(target)
    output.parent.mkdir(exist_ok=True)
    blender_ext("build", "--source-dir", folder, "--output-filepath", output)
    blender_ext("validate", output)
    return output


def main() -> None:
    """Run the command line."""
    platforms = manifest()["platforms"]
    parser = argparse.ArgumentParser(description="Build the extension's zip.")
    parser.add_argument("platform", nargs="?", default=compile_kernels.this_platform(), choices=[*platforms, "all"])
    parser.add_argument(
        "--kernels", action="store_true", help="only compile the kernels that tests load, if this platform has any"
    )
    parser.add_argument("--gpus", action="store_true", help="add kernels for NVIDIA GPUs; takes many minutes")
    arguments = parser.parse_args()
    chosen = arguments.platform
    try:
        if arguments.kernels:
            if compile_kernels.this_platform() in compile_kernels.PROCESSORS:
                compiled_kernels("tests")
            return
        for target in platforms if chosen == "all" else [chosen]:
            output = build(target, "gpus" if arguments.gpus else "")
            print(f"{output.relative_to(ROOT)}  {output.stat().st_size / 1e6:.0f} MB")
    except BuildError as error:
        sys.exit(f"build: {error}")


if __name__ == "__main__":
    main()
