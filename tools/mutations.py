# SPDX-License-Identifier: GPL-3.0-or-later
"""Mutate the dynamics solver and report which laws fail: `python tools/mutations.py [NAME ...]`.

Each mutation is applied to a copy of the checkout, where the tests of its gates run (`pytest.mark.gate`). A mutation
that no gate notices means that a law is missing, or too loose: then the exit status is 1. `--gates V5 V14` runs these
gates instead of those that should notice it; `--list` lists the mutations.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCES = Path("hair_addon", "core", "dynamics")
TESTS = "tests/core/dynamics"
KERNELS = ROOT / "build" / "mutation-kernels"  # Warp's cache, so that each mutation is compiled once
SECONDS = 600  # limit for the tests of a gate
PASSED, FAILED = 0, 1  # exit statuses of pytest


@dataclass(frozen=True)
class Mutation:
    """A mistake: the gates that should notice it, and its edits (file, text that occurs once, replacement)."""

    name: str
    gates: tuple[str, ...]
    edits: tuple[tuple[str, str, str], ...]


_GRADIENT = "const auto bend_gradient = [&](const quaternion& e, const quaternion& middle) {"
_OTHER_GRADIENT = (
    "const auto bend_gradient = [&](const quaternion& bend, const quaternion& middle) {\nconst quaternion e"
)

MUTATIONS = (
    Mutation(
        "sign of the gradient",
        ("V1", "V5"),
        (("rod/rod_rotations.h", _GRADIENT, _OTHER_GRADIENT + "{-bend.x, -bend.y, -bend.z, -bend.w};"),),
    ),
    Mutation(
        "sign of the bend in the gradient",
        ("V5",),
        (("rod/rod_rotations.h", _GRADIENT, _OTHER_GRADIENT + " = conjugate(bend);"),),
    ),
    Mutation(
        "one-sided strain",
        ("V5",),
        (
            (
                "rod/rod_rotations.h",
                "times(back, times(times(conjugate(a), b), back))",
                "times(times(back, back), times(conjugate(a), b))",
            ),
            (
                "rod/rod_newton.h",
                "bend_gradient(e, times(frame_a, half))",
                "bend_gradient(e, times(frame_a, times(half, half)))",
            ),
            (
                "rod/rod_newton.h",
                "bend_gradient(e_next, times(frame_b, half))",
                "bend_gradient(e_next, times(frame_b, times(half, half)))",
            ),
        ),
    ),
    Mutation(
        "no geometric stiffness",
        ("V9",),
        (("rod/rod_newton.h", "const lanes geometric = carried *", "const lanes geometric = 0.0f * carried *"),),
    ),
    Mutation(
        "matrix by the identities of exact rotations",
        ("V14",),
        (
            ("rod/rod_newton.h", "both * dot(G.row[0], G.row[0])", "both * (1.0f - e.x * e.x)"),
            ("rod/rod_newton.h", "both * dot(G.row[1], G.row[0])", "both * (-e.y * e.x)"),
            ("rod/rod_newton.h", "both * dot(G.row[1], G.row[1])", "both * (1.0f - e.y * e.y)"),
            ("rod/rod_newton.h", "both * dot(G.row[2], G.row[0])", "both * (-e.z * e.x)"),
            ("rod/rod_newton.h", "both * dot(G.row[2], G.row[1])", "both * (-e.z * e.y)"),
            ("rod/rod_newton.h", "both * dot(G.row[2], G.row[2])", "both * (1.0f - e.z * e.z)"),
            ("rod/rod_newton.h", "turning * dot(d, d)", "turning"),
        ),
    ),
    Mutation(
        "frames of any lightness",
        ("V14",),
        (("rod/rod_solver.py", '"LEAST_INERTIA": 3e-6', '"LEAST_INERTIA": 1e-8'),),
    ),
    Mutation(
        "drag after gravity",
        ("V1",),
        (("rod/rod_predict.h", "get(inverse_mass, i) * share", "get(inverse_mass, i)"),),
    ),
    Mutation(
        "multipliers missing from the state",
        ("V13",),
        (("rod/rods.py", '"spins", "multipliers", "slips"', '"spins", "slips"'),),
    ),
    Mutation(
        "slips missing from the state",
        ("V13",),
        (("rod/rods.py", '"multipliers", "slips", "roots"', '"multipliers", "roots"'),),
    ),
    Mutation(
        "one side of a notch",
        ("V12",),
        (
            (
                "rod/rod_finish.h",
                "repair(is_inside, plane_rows, found_rows)",
                "repair(is_inside, found_rows, found_rows)",
            ),
        ),
    ),
    Mutation(
        "pinched strands that are torn",
        ("V12",),
        (("rod/rod_finish.h", "(inside < 0.0f) & (is_pinched == 0)", "inside < 0.0f"),),
    ),
    Mutation(
        "contact that holds what is pulled away",
        ("V15",),
        (("rod/rod_contact.h", "(dot(n, n) > 0.5f) & (push > 0.0f)", "(dot(n, n) > 0.5f)"),),
    ),
    Mutation(
        "friction by the way that a point is moved out",
        ("V11",),
        (("rod/rod_contact.h", "friction * higher_of(push, lanes(0.0f))", "friction * higher_of(-gap, lanes(0.0f))"),),
    ),
    Mutation(
        "pressure that does not know the groom",
        ("V20",),
        (("hair_volume.py", "wp.max(wp.max(at_rest, alone), 1.0 / scale)", "wp.max(alone, 1.0 / scale)"),),
    ),
    Mutation(
        "one grid for all regions",
        ("V20",),
        (("hair_cells.py", "return ((region * grid.counts[0] + x)", "return ((0 * region * grid.counts[0] + x)"),),
    ),
    Mutation(
        "a first frame without the multipliers of the equilibrium",
        ("V17",),
        (("rod/rods.py", "self._held * (step.size**2", "self._held * (0.0 * step.size**2"),),
    ),
)


def copy_of_checkout(folder):
    """Copy the tracked files of the working tree into a folder."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True, text=True).stdout
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)


def mutate(folder, mutation):
    """Apply a mutation to a copy; returns {path: text before}."""
    before = {}
    for name, old, new in mutation.edits:
        path = folder / SOURCES / name
        text = path.read_text(encoding="utf-8")
        if text.count(old) != 1:
            sys.exit(f"{mutation.name}: {name} has {text.count(old)} times {old!r}, not once. Adapt this script.")
        before.setdefault(path, text)
        path.write_text(text.replace(old, new), encoding="utf-8")
    return before


def failures(folder, gates=()):
    """Return names of failed tests in a copy, of a gate or of all gates; a sentence if pytest did not end."""
    chosen = " or ".join(f'gate(id="{gate}")' for gate in gates) or "gate"
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", chosen, TESTS]
    environment = os.environ | {"WARP_CACHE_PATH": str(KERNELS)}
    try:
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, timeout=SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        return [f"no end within {SECONDS} s"]
    if done.returncode == PASSED:
        return []
    if done.returncode == FAILED:
        return re.findall(r"^FAILED \S+?::(\S+)", done.stdout, re.MULTILINE)
    if done.returncode < 0:
        return [f"ended by signal {-done.returncode}"]
    sys.exit(f"pytest could not run: {done.stdout}{done.stderr}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="of mutations, or a part of it; all without any")
    parser.add_argument("--gates", nargs="+", metavar="ID", help="ask these")
    parser.add_argument("--list", action="store_true", help="only print the names")
    given = parser.parse_args()
    chosen = [one for one in MUTATIONS if not given.names or any(name in one.name for name in given.names)]
    if given.list or not chosen:
        print(*(one.name for one in MUTATIONS), sep="\n")
        return
    unnoticed = []
    with tempfile.TemporaryDirectory(prefix="vellus_mutations_") as temporary:
        folder = Path(temporary)
        copy_of_checkout(folder)
        wanted = sorted(given.gates or {gate for one in chosen for gate in one.gates})
        if failing := failures(folder, wanted):
            sys.exit(f"These fail without a mutation: {', '.join(failing)}")
        for one in chosen:
            before = mutate(folder, one)
            noticed = {gate: failures(folder, [gate]) for gate in given.gates or one.gates}
            for path, text in before.items():
                path.write_text(text, encoding="utf-8")
            if not any(noticed.values()):
                unnoticed.append(one.name)
            for gate, tests in noticed.items():
                print(f"{one.name}: {gate} {', '.join(tests) if tests else 'does not notice'}", flush=True)
    if unnoticed:
        sys.exit(f"Noticed by no gate: {', '.join(unnoticed)}")


if __name__ == "__main__":
    main()
