# SPDX-License-Identifier: GPL-3.0-or-later
"""Slurm on this machine: a controller and nodes on loopback; tests may crash a node."""

import contextlib
import getpass
import os
import shutil
import socket
import subprocess

from tests.support.farms import farm

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch")
IS_INSTALLED = all(map(shutil.which, PROGRAMS))
NODES = ("farm1", "farm2")

# A lost node is noticed within seconds; on a farm it takes minutes.
_CONFIGURATION = """
ClusterName=vellus
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
StateSaveLocation={folder}/state
SlurmctldPidFile={folder}/controller.pid
SlurmdPidFile={folder}/%n.pid
SlurmdSpoolDir={folder}/%n
ProctrackType=proctrack/linuxproc
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SlurmdTimeout=6
MessageTimeout=5
SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0
NodeName=farm[1-2] NodeHostname={host} NodeAddr=127.0.0.1 Port=[{ports[1]}-{ports[2]}] CPUs=1 RealMemory=500
PartitionName=farm Nodes=ALL Default=YES State=UP MaxTime=INFINITE
"""


@contextlib.contextmanager
def cluster(folder):
    """Context with {node: process of its daemon} of two nodes, and the environment for Slurm's commands."""
    (folder / "munge").mkdir(mode=0o700)
    for name in ("state", *NODES):
        (folder / name).mkdir()
    configuration = folder / "slurm.conf"
    fields = {
        "folder": folder,
        "host": socket.gethostname().partition(".")[0],
        "user": getpass.getuser(),
        "ports": farm.free_ports(3),
    }
    configuration.write_text(_CONFIGURATION.format(**fields))
    variables = {"SLURM_CONF": str(configuration)}
    with contextlib.ExitStack() as daemons:
        daemons.callback(_end_all, variables)
        start = _starter(daemons, folder, variables)
        start("munge", "munged", "--foreground", "--force", *_munge_files(folder / "munge"))
        farm.wait_for((folder / "munge" / "socket").exists, 60)
        start("controller", "slurmctld", "-D", "-f", configuration)
        nodes = {name: start(name, "slurmd", "-D", "-f", configuration, "-N", name) for name in NODES}
        farm.wait_for(lambda: _idle_count(variables) == len(NODES), 120)
        yield nodes, variables


def _munge_files(folder):
    key = folder / "key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o600)
    yield f"--key-file={key}"
    for name in ("socket", "pid", "log", "seed"):
        yield f"--{name}{'' if name == 'socket' else '-file'}={folder / name}"


def _starter(daemons, folder, variables):
    def start(name, *words):
        log = daemons.enter_context(open(folder / f"{name}.log", "wb"))
        given = {"stdout": log, "stderr": log, "env": os.environ | variables}
        process = subprocess.Popen(list(map(str, words)), **given)
        daemons.callback(process.wait)
        daemons.callback(process.kill)
        return process

    return start


def _idle_count(variables):
    words = ["sinfo", "--noheader", "--format=%D %T"]
    told = subprocess.run(words, capture_output=True, text=True, check=False, env=os.environ | variables).stdout
    return sum(int(line.split()[0]) for line in told.splitlines() if line.split()[1] == "idle")


def _end_all(variables):
    """End the remaining child processes of the daemons."""
    for name, value in variables.items():
        farm.kill([*farm.processes_with(name, value)])
