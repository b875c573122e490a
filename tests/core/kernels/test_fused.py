# SPDX-License-Identifier: GPL-3.0-or-later
"""a b + c is rounded once, with or without an instruction of the processor for it."""

from fractions import Fraction

import numpy as np
import pytest
import warp as wp

from hair_addon.core.kernels import native_code

WIDTH = 8
BODY = """
#include "lanes.h"
for (int first = 0; first < out.shape[0]; first += LANES) {
  lanes of_a, of_b, of_c;
  __builtin_memcpy(&of_a, a.data + first, sizeof(lanes));
  __builtin_memcpy(&of_b, b.data + first, sizeof(lanes));
  __builtin_memcpy(&of_c, c.data + first, sizeof(lanes));
  const lanes found = fused(of_a, of_b, of_c);
  __builtin_memcpy(out.data + first, &found, sizeof(lanes));
}
"""


def numbers(rng):
    """Return (3, N) float32 of any size, with sums near the middle between two floats, and too small for 24 bits."""
    signs = rng.choice([-1.0, 1.0], (3, 400))
    any_size = signs * rng.uniform(1.0, 2.0, (3, 400)) * 2.0 ** rng.integers(-12, 12, (3, 400))
    odd = 1.0 + 2.0**-12 * rng.integers(1, 4096, (2, 400))  # products of 24 bits after the point
    aside = signs[2] * 2.0 ** rng.integers(-70, -40, 400)
    between = np.stack([odd[0], odd[1], np.where(rng.integers(0, 4, 400) > 0, aside, 0.0)])
    small = (
        signs
        * rng.uniform(1.0, 2.0, (3, 400))
        * 2.0 ** np.stack([rng.integers(-80, -60, 400)] * 2 + [rng.integers(-149, -126, 400)])
    )
    return np.concatenate([any_size, between, small], axis=1).astype(np.float32)


def nearest_float(exact):
    """Return the float32 nearest to a fraction, the even one of two."""
    near = np.float32(float(exact))
    around = near, np.nextafter(near, np.float32(np.inf)), np.nextafter(near, np.float32(-np.inf))
    return min(around, key=lambda x: (abs(Fraction(float(x)) - exact), int(np.float32(x).view(np.int32)) & 1))


@pytest.mark.parametrize("processor", ["native", "x86-64-v2"])
def test_a_product_and_a_sum_are_rounded_once(rng, tmp_path, monkeypatch, processor):
    flags = wp.config.cpu_compiler_flags
    if processor != "native":
        if wp._src.context._get_cpu_target_triple().split("-")[0] != "x86_64":
            pytest.skip("another kind of processor")
        monkeypatch.setattr(wp.config, "cpu_compiler_flags", flags.replace("-march=native", f"-target-cpu {processor}"))
    (tmp_path / "fuse.cpp").write_text(BODY, encoding="utf-8")

    @wp.func_native(native_code.body(str(tmp_path / "module.py"), "fuse.cpp", WIDTH=WIDTH))
    def fuse(a: wp.array[float], b: wp.array[float], c: wp.array[float], out: wp.array[float]): ...

    @wp.kernel(module="unique", enable_backward=False)
    def fuse_all(a: wp.array[float], b: wp.array[float], c: wp.array[float], out: wp.array[float]):
        fuse(a, b, c, out)

    given = numbers(rng)
    arrays = [wp.array(row, dtype=float, device="cpu") for row in given]
    out = wp.zeros(given.shape[1], dtype=float, device="cpu")
    wp.launch(fuse_all, 1, inputs=arrays, outputs=[out], device="cpu")
    exact = [Fraction(a) * Fraction(b) + Fraction(c) for a, b, c in given.T.astype(float).tolist()]
    np.testing.assert_array_equal(out.numpy(), [nearest_float(value) for value in exact])
    twice = given[0].astype(float) * given[1] + given[2]
    assert (twice.astype(np.float32) != out.numpy()).sum() > 20  # double precision alone rounds these wrongly
