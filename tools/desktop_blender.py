# SPDX-License-Identifier: GPL-3.0-or-later
"""A desktop Blender in a virtual display, for machines without one: installed once, run with a script.

    python tools/desktop_blender.py                    install it, or print why that is not possible
    python tools/desktop_blender.py SCRIPT [ARGUMENT]  run a script in its window

Blender comes from Debian's package, into a folder with a Debian of its own, so that the host's libraries do not matter:
Debian or Ubuntu, root, about two minutes and 2 GB. VELLUS_DESKTOP_BLENDER names another folder, or the executable of an
installed Blender, which also needs `xvfb-run` and `import` on the PATH.
"""

import os
import platform
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# Outside the checkout: the next clone finds it again.
DEFAULT_FOLDER = Path("/srv/desktop-blender")
VARIABLE = "VELLUS_DESKTOP_BLENDER"

WINDOW_SIZE = (1280, 800)
BACKENDS = ("opengl", "vulkan")

# Software drivers take minutes to compile a window's shaders: the next clone finds them again beside this Blender.
_SHADERS = Path("/var/cache/mesa")

# Mesa draws on the processor where there is no GPU. The modules are what Debian's Blender runs without and this one
# needs: NumPy for every add-on, OpenColorIO for the display transform.
_PACKAGES = (
    *("blender", "xvfb", "xauth", "imagemagick", "ca-certificates"),
    *("libgl1", "libegl1", "libegl-mesa0", "libgl1-mesa-dri", "mesa-vulkan-drivers"),
    *("python3-cattr", "python3-numpy", "python3-pyopencolorio", "python3-requests", "python3-zstandard"),
)


class Unavailable(Exception):
    """The reason why there is no desktop Blender, in one sentence."""


@dataclass(frozen=True)
class DesktopBlender:
    """A Blender executable, and the folder of its root file system if it is not the host's."""

    executable: Path
    folder: Path | None = None

    def run(
        self, script, arguments=(), *, backend="opengl", profile, folders=(), log=None, limit=1200, size=WINDOW_SIZE
    ):
        """Run a script in a window; returns Blender's exit status, 124 where it ran past `limit` [s].

        profile: a folder for Blender's user files and home; folders: more that the script sees, at the paths that they
        have here; log: a file for all that Blender prints, the terminal without one; size: (width, height) of the
        window in pixels.
        """
        width, height = size
        command = [
            *("env", *self._environment(profile)),
            *("xvfb-run", "--auto-servernum", "--server-args", f"-screen 0 {width}x{height}x24 -nolisten tcp"),
            *("timeout", "--kill-after=10", str(limit)),
            *(self.executable, "--gpu-backend", backend, "--window-geometry", "0", "0", str(width), str(height)),
            # Events of a script replace those of mouse and keyboard, which this option disables.
            *("--enable-event-simulate", "--python-exit-code", "7"),
            *("--python", Path(script).resolve(), "--", *arguments),
        ]
        if self.folder is not None:
            command = _inside(self.folder, command, [ROOT, profile, *folders])
        output = open(log, "wb") if log else None
        try:
            done = subprocess.run(
                command, stdout=output, stderr=subprocess.STDOUT, timeout=limit + 60, env=_inherited()
            )
            return done.returncode
        finally:
            if output:
                output.close()

    def command(self, *arguments, profile, folders=(), limit=1200):
        """Blender without a window, as `blender ARGUMENT …`; returns the finished process. Others as for `run`."""
        command = ["env", *self._environment(profile), "timeout", str(limit), self.executable, *arguments]
        if self.folder is not None:
            command = _inside(self.folder, command, [ROOT, profile, *folders])
        words = list(map(str, command))
        return subprocess.run(words, capture_output=True, text=True, timeout=limit + 60, env=_inherited())

    def _environment(self, profile):
        """Return NAME=VALUE for a Blender with its user files and home in a folder."""
        values = {"HOME": profile, "BLENDER_USER_RESOURCES": profile, "LC_ALL": "C.UTF-8"}
        values["MESA_SHADER_CACHE_DIR"] = _SHADERS if self.folder else ROOT / "build" / "compiled-shaders"
        return [f"{name}={value}" for name, value in values.items()]


def _inherited():
    """Return this process's original environment: bpy adds paths that another Blender cannot read."""
    return dict(os.environ)


def find_or_install():
    """Return the `DesktopBlender` of this machine, installed if it is not there yet. Raises `Unavailable`."""
    place = Path(os.environ.get(VARIABLE, DEFAULT_FOLDER))
    if place.is_file():
        missing = [tool for tool in ("xvfb-run", "import") if shutil.which(tool) is None]
        if missing:
            raise Unavailable(f"Blender's window needs {' and '.join(missing)}: install xvfb and imagemagick.")
        return DesktopBlender(place)
    if not _is_installed(place):
        _check_installable()
        place.mkdir(parents=True, exist_ok=True)
        with open(place.with_name(f".{place.name}.lock"), "w") as lock:
            import fcntl  # not on Windows, which does not get as far as this

            fcntl.flock(lock, fcntl.LOCK_EX)  # open until closed
            if not _is_installed(place):
                _install(place)
    return DesktopBlender(Path("/usr/bin/blender"), place)


def _stamp(folder):
    return folder / ".packages"


def _is_installed(folder):
    stamp = _stamp(folder)
    return stamp.is_file() and stamp.read_text().split() == list(_PACKAGES)


def _check_installable():
    if platform.system() != "Linux" or shutil.which("apt-get") is None:
        raise Unavailable(f"A desktop Blender is installed on Debian or Ubuntu only: set {VARIABLE} to one of yours.")
    if os.geteuid() != 0:
        raise Unavailable(f"Only root can install a desktop Blender: set {VARIABLE} to one of yours.")
    if subprocess.run(["unshare", "--mount", "true"], capture_output=True).returncode != 0:
        raise Unavailable(f"This container may not mount what a desktop Blender needs: set {VARIABLE} to one of yours.")


def _install(folder):
    print(f"Installing a desktop Blender into {folder} …", file=sys.stderr)
    apt = ["apt-get", "--quiet", "--option", "Acquire::Retries=5", "--option", "DPkg::Lock::Timeout=300"]
    install = [*apt, "install", "--yes", "--no-install-recommends"]
    environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
    try:
        if shutil.which("debootstrap") is None:
            _call([*apt, "update"], environment)
            _call([*install, "debootstrap"], environment)
        if not (folder / "usr/bin/apt-get").exists():
            _call(["debootstrap", "--variant=minbase", "sid", str(folder)], environment)
        try:
            _call(_inside(folder, [*install, *_PACKAGES], []), environment)
        except subprocess.CalledProcessError:  # outdated package lists name removed packages
            _call(_inside(folder, [*apt, "update"], []), environment)
            _call(_inside(folder, [*install, *_PACKAGES], []), environment)
    except subprocess.CalledProcessError as error:
        words = (error.stdout or b"").decode(errors="replace").split("\n")
        reason = next((word for word in reversed(words) if word.strip()), str(error))
        raise Unavailable(f"A desktop Blender could not be installed: {reason.strip()}.") from error
    _stamp(folder).write_text("\n".join(_PACKAGES) + "\n")


def _call(command, environment):
    subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def _inside(folder, command, shared):
    """Return a command with `folder` as its root, where it sees the folders `shared` at their own paths.

    Its mounts are private, and removed when it ends.
    """
    mounts = [f'mount -t proc proc "{folder}/proc"', f'mount --rbind /dev "{folder}/dev"']
    for path in shared:
        mounts += [f'mkdir -p "{folder}{path}"', f'mount --bind "{path}" "{folder}{path}"']
    script = "\n".join(["set -e", *mounts, 'exec chroot "$@"'])
    return ["unshare", "--mount", "sh", "-c", script, "sh", str(folder), *map(str, command)]


def main(arguments):
    """Install, or run a script; returns the exit status."""
    try:
        blender = find_or_install()
    except Unavailable as error:
        print(error, file=sys.stderr)
        return 1
    if not arguments:
        print(f"{blender.executable} in {blender.folder or 'the host'}")
        return 0
    profile = ROOT / "build" / "desktop-profile"
    profile.mkdir(parents=True, exist_ok=True)
    return blender.run(arguments[0], arguments[1:], profile=profile)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
