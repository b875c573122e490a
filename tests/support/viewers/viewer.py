# SPDX-License-Identifier: GPL-3.0-or-later
"""Khronos' validator, and three.js with three-vrm in a browser without a window."""

import base64
import functools
import html
import http.server
import json
import os
import re
import shutil
import subprocess
import threading
from pathlib import Path

HERE = Path(__file__).resolve().parent
NODE = shutil.which("node")
BROWSER = next(filter(None, map(shutil.which, ("chromium-headless-shell", "chromium", "google-chrome"))), None)
FOLDER = os.environ.get("VELLUS_VIEWERS")  # contains node_modules, made by `make viewers`
MISSING = "needs Node.js, Chromium, and VELLUS_VIEWERS, the folder that make viewers installs"
IS_THERE = bool(NODE and BROWSER and FOLDER)

_SECONDS = 200
_SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def issues_of(path):
    """Return the issues that Khronos' validator finds in a file: {"numErrors": ..., "messages": [...], ...}."""
    command = [NODE, str(HERE / "validate.js"), FOLDER, str(path)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, timeout=_SECONDS).stdout)


def seen_by_three(path, folder):
    """Return what view.js finds in a file, with the path of its picture; folder: for temporary files."""
    site = folder / "site"
    site.mkdir()
    for name in ("view.html", "view.js"):
        shutil.copy(HERE / name, site)
    shutil.copy(path, site / "model.glb")
    (site / "node_modules").symlink_to(Path(FOLDER).resolve() / "node_modules")
    handler = functools.partial(_Quiet, directory=str(site))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page = _page(f"http://127.0.0.1:{server.server_port}/view.html", folder)
        server.shutdown()
    found = json.loads(html.unescape(re.search(r'<pre id="found">(.*?)</pre>', page, re.DOTALL)[1]))
    assert "error" not in found, found
    picture = folder / "seen.png"
    picture.write_bytes(base64.b64decode(found.pop("picture").split(",")[1]))
    return {**found, "picture": picture}


def _page(address, folder):
    options = ["--headless", "--no-sandbox", f"--user-data-dir={folder / 'profile'}", "--virtual-time-budget=60000"]
    command = [BROWSER, *options, *_SOFTWARE, "--dump-dom", address]
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=_SECONDS).stdout


class _Quiet(http.server.SimpleHTTPRequestHandler):
    extensions_map = http.server.SimpleHTTPRequestHandler.extensions_map | {".js": "text/javascript"}

    def log_message(self, *_given):
        """Write nothing."""
