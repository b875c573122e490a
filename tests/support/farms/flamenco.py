# SPDX-License-Identifier: GPL-3.0-or-later
"""Flamenco on this machine [Flamenco26]: jobs compiled by a mock or by its manager, and its workers."""

import contextlib
import datetime
import json
import os
import shutil
import subprocess
import urllib.error
import urllib.request
from pathlib import Path

from tests.support.farms import farm

SCRIPT = farm.DOCS / "vellus-render.js"
MANAGER = Path(__file__).parents[2] / "command_line" / "flamenco.js"
FOLDER = os.environ.get("VELLUS_FLAMENCO")  # with the programs of a release
WORKERS = ("worker1", "worker2")

_CONFIGURATION = """
_meta: {{version: 3}}
listen: "127.0.0.1:{port}"
autodiscoverable: false
shared_storage_path: {folder}/shared
local_manager_storage_path: {folder}/local
shaman: {{enabled: false}}
variables:
  blender:
    values: [{{platform: linux, value: {blender}}}]
"""


def compiled(*jobs, created="2026-01-02T03:04:05", identity="abcd"):
    """Return the mock manager's answer to each submitted job: {status, message} or {status, tasks, settings}."""
    jobs = [{"settings": job, "created": created, "jobID": f"{identity}0000"} for job in jobs]
    words = ["node", str(MANAGER), str(SCRIPT)]
    given = {"input": json.dumps(jobs), "capture_output": True, "text": True, "timeout": 60}
    return json.loads(subprocess.run(words, check=True, **given).stdout)


class Manager:
    """A running manager and requests to it."""

    def __init__(self, address, local):
        self._address, self._local = address, local

    def ask(self, path, values=None):
        """Send a request; returns (status, answer). values: posted as JSON."""
        body = None if values is None else json.dumps(values).encode()
        request = urllib.request.Request(f"{self._address}/api/v3/{path}", body, {"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=30) as answer:
                return answer.status, json.loads(answer.read() or "null")
        except urllib.error.HTTPError as error:
            with error:
                return error.code, json.loads(error.read())

    def submit(self, settings, **more):
        """Submit a job as Flamenco's add-on does; returns (status, job or error)."""
        job = {"name": "a job", "type": "vellus-render", "submitter_platform": "linux", "settings": settings}
        return self.ask("jobs", job | more)

    def tasks(self, job):
        """Return the tasks of a job with their commands, in order."""
        found = self.ask(f"jobs/{job['id']}/tasks")[1]["tasks"]
        return [self.ask(f"tasks/{task['id']}")[1] for task in found]

    def status(self, job):
        """Return the status of a job."""
        return self.ask(f"jobs/{job['id']}")[1]["status"]

    def wait(self, job, seconds=300):
        """Wait until a job has ended; returns its status."""
        farm.wait_for(lambda: self.status(job) in {"completed", "failed", "canceled"}, seconds)
        return self.status(job)

    def log(self, job):
        """Return the output of all commands of a job."""
        logs = sorted(self._local.rglob(f"{job['id']}/task-*"))
        return "\n".join(log.read_text() for log in logs)


def identity_of(job):
    """Return the options of `compiled` for a job that a manager has made."""
    created = datetime.datetime.fromisoformat(job["created"][:19] + "+00:00")
    return {"created": created.isoformat(), "identity": job["id"][:4]}


@contextlib.contextmanager
def manager(folder, blender):
    """Context with a `Manager` that has the job type, whose workers use a `blender`."""
    (port,) = farm.free_ports(1)
    (folder / "scripts").mkdir()
    shutil.copy(SCRIPT, folder / "scripts")
    shutil.copy(Path(FOLDER) / "flamenco-manager", folder)  # it looks for the folder of scripts beside itself
    configuration = _CONFIGURATION.format(port=port, folder=folder, blender=blender)
    (folder / "flamenco-manager.yaml").write_text(configuration)
    with _running(folder / "flamenco-manager", folder):
        made = Manager(f"http://127.0.0.1:{port}", folder / "local")
        farm.wait_for(lambda: _answers(made), 60)
        yield made


def _answers(made):
    with contextlib.suppress(urllib.error.URLError):
        return made.ask("version")[0] == 200


@contextlib.contextmanager
def worker(asked, home):
    """Context with the process of a worker; with the same folder it is the same worker again."""
    home.mkdir(exist_ok=True)
    program = Path(FOLDER).resolve() / "flamenco-worker"
    with _running(program, home, "-manager", asked._address, FLAMENCO_HOME=home) as process:
        yield process
        farm.kill([*farm.processes_with("FLAMENCO_HOME", home)])


@contextlib.contextmanager
def _running(program, folder, *words, **variables):
    environment = os.environ | {name: str(value) for name, value in variables.items()}
    with open(folder / "output.log", "ab") as log:
        process = subprocess.Popen([program, *words], cwd=folder, env=environment, stdout=log, stderr=log)
        try:
            yield process
        finally:
            process.kill()
            process.wait()
