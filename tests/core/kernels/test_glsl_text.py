# SPDX-License-Identifier: GPL-3.0-or-later
"""Warp's functions are translated to GLSL text or refused; tests/blender/gpu/test_kernel_programs.py runs kernels."""

import pytest
import warp as wp

from hair_addon.core.kernels import glsl_text
from tools import translate_kernels


@pytest.mark.parametrize("name", translate_kernels.SHADERS)
def test_translated_shaders_are_those_of_their_source(name):
    """Generated shaders match their sources; if not, run tools/translate_kernels.py."""
    path = translate_kernels.ROOT / "shaders" / name
    assert path.read_text(encoding="utf-8") == translate_kernels.text_of(name)


@wp.func
def _order(a: float, b: float, c: float):
    return a - (b - c) * (a / (b * c)) - -a, a < b + c and not (a == b or -c < a)


def test_parentheses_keep_the_order_of_operations():
    text = glsl_text.function_text(_order)
    assert "returned_0 = a_ - (b_ - c_) * (a_ / (b_ * c_)) - (-a_);" in text
    assert "returned_1 = a_ < b_ + c_ && (!(a_ == b_ || (-c_) < a_));" in text


@wp.kernel
def _with_a_matrix(out_number: wp.array[float]):
    out_number[wp.tid()] = wp.determinant(wp.identity(n=3, dtype=float))


@wp.kernel
def _with_a_random_condition(out_number: wp.array[float]):
    state = wp.rand_init(1, wp.tid())
    while wp.randf(state) < 0.5:
        out_number[wp.tid()] = 1.0


@wp.kernel
def _with_a_sum(out_number: wp.array[float]):
    out_number[wp.tid()] += 1.0


_TWO = wp.constant(wp.vec2(1.0, 2.0))


@wp.func
def _with_a_break(a: float):
    for turn in range(2):
        if a < _TWO[turn]:
            break
        a -= 1.0
    return a


@wp.func
def _with_two_types(a: float):
    b = a
    if a > 0.0:
        b = 1
    return b


@pytest.mark.parametrize(
    ("translated", "what"),
    [
        (lambda: glsl_text.kernel_text(_with_a_matrix), r"wp\.identity"),
        (lambda: glsl_text.kernel_text(_with_a_random_condition), "random number in a condition"),
        (lambda: glsl_text.kernel_text(_with_a_sum), "read and written"),
        (lambda: glsl_text.function_text(_with_a_break), "break in an unrolled loop"),
        (lambda: glsl_text.function_text(_with_two_types), "float before, int here"),
    ],
)
def test_what_cannot_be_translated_is_named_with_its_line(translated, what):
    with pytest.raises(NotImplementedError, match=rf"test_glsl_text\.py:\d+: .*{what}"):
        translated()
