// SPDX-License-Identifier: GPL-3.0-or-later
//
// A Newton step on all constraints of the `stepping` lanes; returns the largest |Δθ|² of each lane.
//
// With s_j half of the rest rotation from frame j - 1 to frame j, and e_j = s_j⁻¹ (q_(j-1)⁻¹ q_j) s_j⁻¹:
//
//     stretch, shear  C_s = (x_(j+1) - x_j) / l_j - d_j        α_s = 1 / (EA l_j)
//     bend, twist     C_b = 2 Im e_j                           α_b = b_j diag(1 / EI, 1 / EI, 1 / GJ)
//
// Half of the rotation on either side makes the strain second-order accurate. (J W Jᵀ + α̃) Δλ = -(C + α̃ λ) is block
// tridiagonal, with six rows per segment: C_b of its joint, then C_s. A Cholesky decomposition runs from root to tip,
// the back substitution from tip to root [Deul18]. All blocks of D and U are computed from the same rounded G, d and
// [d]×: simplifying some of them by exact identities could make the matrix indefinite in single precision.
//
// is_first: λ starts at zero; the stored λ is that of the last substep, times `carried`.

const auto newton_step = [&](bool is_first, float carried, ints stepping, bool is_touching) {
  quaternion frame_a = pinned > 0 ? get_frame(q, pinned - 1) : root_frame;
  quaternion before_a = pinned > 0 ? get_frame(q_before, pinned - 1) : frame_before;
  quaternion frame_b = get_frame(q, pinned);
  quaternion half = get_frame(rest, pinned);
  quaternion e = bend_of(frame_a, frame_b, half);
  rows G = bend_gradient(e, times(frame_a, half));
  lanes turning_a = 0.0f;  // w of the previous frame
  vector point_a = get_vector(x, pinned);
  const auto size_of_bend = [&](int j) {
    const vector moment = get_vector(lambda, 2 * j);
    return exact_sqrt_of(dot(moment, moment));
  };
  lanes moment = size_of_bend(pinned);
  lanes L[21], Y[27], y[6];  // L: rows of the lower triangle, diagonal inverted; Y: see `reduce`
  for (int j = pinned; j < segment_count; ++j) {
    if (j + 2 < segment_count) {
      fetch(lambda, 6 * (j + 2), 6);
      fetch(x, 3 * (j + 2), 3);
      fetch(q, 4 * (j + 2), 4);
      fetch(rest, 4 * (j + 2), 4);
      fetch(q_before, 4 * (j + 1), 4);
      fetch(bending, j + 1, 1);
      fetch(inertia, j + 1, 1);
      fetch(stretching, j + 1, 1);
      fetch(length, j + 2, 1);
      fetch(mobility, j + 2, 1);
    }
    // Geometric stiffness [Tournier15] reduces rotations under tension: w = 1 / (I + |λ_s| + ½ (|λ_b| + |λ_b'|)).
    const lanes compliance = get(bending, j);
    const vector tension = get_vector(lambda, 2 * j + 1);
    const lanes next_moment = j + 1 < segment_count ? size_of_bend(j + 1) : lanes(0.0f);
    const lanes geometric = carried * (exact_sqrt_of(dot(tension, tension)) + 0.5f * (moment + next_moment));
    moment = next_moment;
    // A lighter frame would be so stiff that single precision could not resolve its motion relative to its neighbors.
    const lanes least_inertia = damped_inertia / compliance;
    const lanes turning = pins > lanes(static_cast<float>(j))
                              ? lanes(0.0f)
                              : lanes(1.0f / (higher_of(get(inertia, j), least_inertia) + geometric));
    put(kept(j, TURNING), 0, turning);

    const vector d = direction_of(frame_b);
    const lanes inverse_length = 1.0f / get(length, j);
    const vector point_b = get_vector(x, j + 1);
    const vector stretch = (point_b - point_a) * inverse_length - d;
    const quaternion before_b = get_frame(q_before, j);
    const quaternion e_before = bend_of(before_a, before_b, half);
    const lanes per_step = compliance * inverse_square;  // α̃ = α / h²
    const lanes per_twist = per_step * twist_ratio, per_stretch = get(stretching, j) * inverse_square;
    vector kept_b = get_vector(lambda, 2 * j), kept_s = tension;
    if (is_first) kept_b = kept_s = vector{lanes(0.0f), lanes(0.0f), lanes(0.0f)};
    // Kelvin-Voigt damping, γ = τ / h: -(C + α̃ λ + γ (C - C_n)) / (1 + γ).
    lanes R[6] = {-(damped * e.x + undamped * e_before.x + per_step * kept_b.x) * inverse_damping,
                  -(damped * e.y + undamped * e_before.y + per_step * kept_b.y) * inverse_damping,
                  -(damped * e.z + undamped * e_before.z + per_twist * kept_b.z) * inverse_damping,
                  -(stretch.x + per_stretch * kept_s.x), -(stretch.y + per_stretch * kept_s.y),
                  -(stretch.z + per_stretch * kept_s.z)};

    // D_j, lower triangle by rows.
    lanes D[21];
    const lanes both = turning_a + turning;
    D[0] = both * dot(G.row[0], G.row[0]) + per_step * inverse_damping;
    D[1] = both * dot(G.row[1], G.row[0]);
    D[2] = both * dot(G.row[1], G.row[1]) + per_step * inverse_damping;
    D[3] = both * dot(G.row[2], G.row[0]);
    D[4] = both * dot(G.row[2], G.row[1]);
    D[5] = both * dot(G.row[2], G.row[2]) + per_twist * inverse_damping;
    UNROLLED for (int c = 0; c < 3; ++c) {  // (-w G [d]×)ᵀ
      const vector column = cross(d, G.row[c]) * turning;
      D[6 + c] = column.x;
      D[10 + c] = column.y;
      D[15 + c] = column.z;
    }
    const lanes inverse_square_length = inverse_length * inverse_length;
    const lanes moving_a = get(mobility, j) * inverse_square_length;
    const lanes mobility_b = get(mobility, j + 1), moving_b = mobility_b * inverse_square_length;
    const lanes diagonal = moving_a + moving_b + turning * dot(d, d) + per_stretch;
    D[9] = diagonal - turning * d.x * d.x;
    D[13] = -turning * d.x * d.y;
    D[14] = diagonal - turning * d.y * d.y;
    D[18] = -turning * d.x * d.z;
    D[19] = -turning * d.y * d.z;
    D[20] = diagonal - turning * d.z * d.z;
    // Contact filters masses, F = 1 + (a - 1) 1 + (away - a) n nᵀ; both terms are zero without contact.
    vector n_b;
    lanes less_b, normal_b;
    if (is_touching) {
      const auto filter = [&](int i, vector& n, lanes& less, lanes& normal) {
        n = get_vector(contact(i), 0);
        const lanes a = get(contact(i), 3);
        less = a - 1.0f;
        normal = get(contact(i), 7) - a;
      };
      const auto add = [&](const vector& n, lanes less, lanes normal, lanes moving) {
        less *= moving;
        normal *= moving;
        D[9] += less + normal * n.x * n.x;
        D[13] += normal * n.x * n.y;
        D[14] += less + normal * n.y * n.y;
        D[18] += normal * n.x * n.z;
        D[19] += normal * n.y * n.z;
        D[20] += less + normal * n.z * n.z;
      };
      filter(j, n_b, less_b, normal_b);
      add(n_b, less_b, normal_b, moving_a);
      filter(j + 1, n_b, less_b, normal_b);
      add(n_b, less_b, normal_b, moving_b);
    }
#include "rod_reduce.h"
    if (j + 1 == segment_count) break;

    // U_j, then Y = L⁻¹ U: six rows of its first three columns, three of the others, whose upper rows are zero.
    const quaternion frame_c = get_frame(q, j + 1);
    half = get_frame(rest, j + 1);
    const quaternion e_next = bend_of(frame_b, frame_c, half);
    const rows G_next = bend_gradient(e_next, times(frame_b, half));
    UNROLLED for (int c = 0; c < 3; ++c) {
      const vector& g = G_next.row[c];
      UNROLLED for (int r = 0; r < 3; ++r) Y[3 * r + c] = -turning * dot(G.row[r], g);
      const vector shear = cross(d, g) * turning;
      Y[9 + c] = -shear.x;
      Y[12 + c] = -shear.y;
      Y[15 + c] = -shear.z;
    }
    const lanes coupled = -inverse_length / get(length, j + 1) * mobility_b;
    UNROLLED for (int k = 18; k < 27; ++k) Y[k] = 0.0f;
    Y[18] = Y[22] = Y[26] = coupled;
    if (is_touching) {
      const lanes less = less_b * coupled, normal = normal_b * coupled;
      Y[18] += less + normal * n_b.x * n_b.x;
      Y[22] += less + normal * n_b.y * n_b.y;
      Y[26] += less + normal * n_b.z * n_b.z;
      Y[19] = Y[21] = normal * n_b.x * n_b.y;
      Y[20] = Y[24] = normal * n_b.x * n_b.z;
      Y[23] = Y[25] = normal * n_b.y * n_b.z;
    }
    UNROLLED for (int c = 0; c < 3; ++c) {
      UNROLLED for (int r = 0; r < 6; ++r) {
        lanes sum = Y[3 * r + c];
        UNROLLED for (int k = 0; k < r; ++k) sum -= L[r * (r + 1) / 2 + k] * Y[3 * k + c];
        Y[3 * r + c] = sum * L[r * (r + 1) / 2 + r];
      }
      UNROLLED for (int r = 3; r < 6; ++r) {
        lanes sum = Y[9 + 3 * r + c];
        UNROLLED for (int k = 3; k < r; ++k) sum -= L[r * (r + 1) / 2 + k] * Y[9 + 3 * k + c];
        Y[9 + 3 * r + c] = sum * L[r * (r + 1) / 2 + r];
      }
    }
    frame_a = frame_b;
    before_a = before_b;
    frame_b = frame_c;
    turning_a = turning;
    point_a = point_b;
    e = e_next;
    G = G_next;
  }
#include "rod_back.h"
};
