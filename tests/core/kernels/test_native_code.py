# SPDX-License-Identifier: GPL-3.0-or-later
"""C++ of kernels is read from files with the constants of Python and with headers as part of the source."""

import pytest
import warp as wp

from hair_addon.core.kernels import native_code

HEADER = "const auto twice = [](float value) { return 2.0f * value; };\n"
BODY = '// SPDX\n\n#include "shared.h"\n\nfor (int i = 0; i < COUNT; ++i) out.data[i] = twice(SCALE * i);\n'


@pytest.fixture
def module_file(tmp_path):
    (tmp_path / "shared.h").write_text(HEADER, encoding="utf-8")
    (tmp_path / "fill.cpp").write_text(BODY, encoding="utf-8")
    return str(tmp_path / "module.py")


def test_a_body_is_compiled_with_its_constants_and_headers(module_file):
    @wp.func_native(native_code.body(module_file, "fill.cpp", COUNT=3, SCALE=1.5))
    def fill(out: wp.array[float]): ...

    @wp.kernel(module="unique", enable_backward=False)
    def fill_all(out: wp.array[float]):
        fill(out)

    out = wp.zeros(4, dtype=float, device="cpu")
    wp.launch(fill_all, 1, outputs=[out], device="cpu")
    assert out.numpy().tolist() == [0.0, 3.0, 6.0, 0.0]


def test_a_constant_in_scientific_notation_is_a_float(module_file):
    assert "constexpr float SCALE = 1e+36f;" in native_code.body(module_file, "fill.cpp", SCALE=1e36)


def test_a_change_of_a_header_changes_the_body(module_file, tmp_path):
    """A changed header changes the text from which Warp computes the module's hash."""
    before = native_code.body(module_file, "fill.cpp")
    (tmp_path / "shared.h").write_text(HEADER.replace("2.0f", "3.0f"), encoding="utf-8")
    assert native_code.body(module_file, "fill.cpp") != before
