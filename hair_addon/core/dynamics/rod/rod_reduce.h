// SPDX-License-Identifier: GPL-3.0-or-later
//
// L Lᵀ = D_j - Yᵀ Y and y = L⁻¹ (R - Yᵀ y) of a segment, in newton_step: Y and y are those of the previous segment.

if (j > pinned) {
  const auto y_at = [&](int r, int c) { return c < 3 ? Y[3 * r + c] : Y[9 + 3 * r + c - 3]; };
  UNROLLED for (int r = 0; r < 6; ++r) {
    const int from = r < 3 ? 0 : 3;
    UNROLLED for (int c = 0; c <= r; ++c) {
      lanes sum = D[r * (r + 1) / 2 + c];
      UNROLLED for (int k = from; k < 6; ++k) sum -= y_at(k, r) * y_at(k, c);
      D[r * (r + 1) / 2 + c] = sum;
    }
    lanes sum = R[r];
    UNROLLED for (int k = from; k < 6; ++k) sum -= y_at(k, r) * y[k];
    R[r] = sum;
  }
  UNROLLED for (int k = 0; k < 27; ++k) put(kept(j, UPPER), k, Y[k]);
}
UNROLLED for (int r = 0; r < 6; ++r) {
  UNROLLED for (int c = 0; c <= r; ++c) {
    lanes sum = D[r * (r + 1) / 2 + c];
    UNROLLED for (int k = 0; k < c; ++k) sum -= L[r * (r + 1) / 2 + k] * L[c * (c + 1) / 2 + k];
    if (r == c) {
      L[r * (r + 1) / 2 + r] = 1.0f / exact_sqrt_of(higher_of(sum, lanes(1.0e-30f)));
    } else {
      L[r * (r + 1) / 2 + c] = sum * L[c * (c + 1) / 2 + c];
    }
  }
  lanes sum = R[r];
  UNROLLED for (int k = 0; k < r; ++k) sum -= L[r * (r + 1) / 2 + k] * y[k];
  y[r] = sum * L[r * (r + 1) / 2 + r];
}
UNROLLED for (int k = 0; k < 21; ++k) put(kept(j, LOWER), k, L[k]);
UNROLLED for (int k = 0; k < 6; ++k) put(kept(j, RIGHT), k, y[k]);
UNROLLED for (int r = 0; r < 3; ++r) {
  put(kept(j, GRADIENT), 3 * r, G.row[r].x);
  put(kept(j, GRADIENT), 3 * r + 1, G.row[r].y);
  put(kept(j, GRADIENT), 3 * r + 2, G.row[r].z);
}
