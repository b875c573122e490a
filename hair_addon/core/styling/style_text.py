# SPDX-License-Identifier: GPL-3.0-or-later
"""Constants and generated texts with which .strand files are compiled in C++, CUDA and GLSL.

`#include "bend.numbers"` declares the numbers of a step by their names in `NUMBERS` of its module, and their courses;
`#include "all.strand"` includes the file of each kind of step and chooses among them.
"""

import re
from collections.abc import Iterable

from . import courses, frizz, kinds, program
from .base import Step
from .random_numbers import PURPOSES

_ARRAY = re.compile(r"(\w+)\[(\d+)\]")


def constants() -> dict[str, int]:
    """Return {name: value} for all .strand files: kinds, indices of numbers, purposes of random numbers."""

    def bits(attribute):
        return sum(1 << kinds.STEP_KINDS[step] for step, module in kinds.STEPS.items() if hasattr(module, attribute))

    return {
        **kinds.STEP_KINDS,
        **{f"{name.upper()}_NUMBER": place for place, name in enumerate(program.SHARED)},
        **PURPOSES,
        "COURSE_SAMPLES": courses.SAMPLES,
        "COURSE_BITS": courses.BITS,
        "WAVES": frizz.WAVES_AN_OCTAVE,
        "MOST_OCTAVES": frizz.MOST_OCTAVES,
        "NEEDING_CENTRE": bits("NEEDS_CENTRE"),  # a bit for each kind
        "CHANGING_LENGTHS": bits("CHANGES_LENGTHS"),
    }


def texts(steps: Iterable[str]) -> dict[str, str]:
    """Return {file: text} of the generated files for kinds of steps, of `kinds.STEPS`."""
    present = [step for step in kinds.STEPS if step in set(steps)]
    includes = [f'#include "{step.lower()}.strand"' for step in present]
    choices = [f"  if (kind == {step}) {{\n    {step.lower()}_strand();\n  }}" for step in present]
    chosen = "\n".join([*includes, "", "void apply_step()", "{", *choices, "}", ""])
    return {"all.strand": chosen} | {f"{step.lower()}.numbers": _declarations(step) for step in present}


def ordered(step: Step) -> list[float]:
    """Return a step's own numbers in the order in which kernels read them; arrays if they differ between strands."""
    values = dict(step.numbers)
    found: list[float] = []
    for name in kinds.STEPS[step.kind].NUMBERS:
        array = _ARRAY.fullmatch(name)
        found += values.pop(array[1])[: int(array[2])] if array else [values.pop(name)]
    assert not values, f"{step.kind} does not know {', '.join(values)}"
    return found


def _declarations(step):
    place, varied = len(program.SHARED), kinds.varied_numbers_of(step)
    lines = []
    for name in kinds.STEPS[step].NUMBERS:
        array = _ARRAY.fullmatch(name)
        if name in varied:
            lines.append(f"lanes {name} = varied_number_at({place});")
        elif array is None:
            lines.append(f"float {name} = number_at({place});")
        else:
            lines.append(f"float {name};")
            lines += [f"{array[1]}[{k}] = number_at({place + k});" for k in range(int(array[2]))]
        place += int(array[2]) if array else 1
    # The course of the amount is part of the profile.
    names = courses.names_of(kinds.STEPS[step])
    lines += [f"int {name}_course = course_row({slot});" for slot, name in enumerate(names) if slot > 0]
    return "\n".join(lines) + "\n"
