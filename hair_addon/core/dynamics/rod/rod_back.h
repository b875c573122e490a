// SPDX-License-Identifier: GPL-3.0-or-later
//
// Back substitution from tip to root, the end of newton_step: updates λ, points and frames.

  const vector none{lanes(0.0f), lanes(0.0f), lanes(0.0f)};
  vector moment_after = none, pull_after = none;  // Gᵀ Δλ_b and Δλ_s / l of the next segment
  lanes z[6];
  lanes largest = 0.0f;
  for (int j = segment_count - 1; j >= pinned; --j) {
    if (j > pinned) {
      fetch(kept(j - 1, 0), 0, KEPT);
      fetch(lambda, 6 * (j - 1), 6);
      fetch(x, 3 * j, 3);
      fetch(q, 4 * (j - 1), 4);
      fetch(length, j - 1, 1);
      fetch(mobility, j, 1);
    }
    lanes right[6];
    UNROLLED for (int r = 0; r < 6; ++r) right[r] = get(kept(j, RIGHT), r);
    if (j + 1 < segment_count) {
      UNROLLED for (int r = 0; r < 6; ++r) {
        UNROLLED for (int c = 0; c < 3; ++c) right[r] -= get(kept(j + 1, UPPER), 3 * r + c) * z[c];
        if (r >= 3) {
          UNROLLED for (int c = 0; c < 3; ++c) right[r] -= get(kept(j + 1, UPPER), 9 + 3 * r + c) * z[3 + c];
        }
      }
    }
    UNROLLED for (int r = 5; r >= 0; --r) {
      lanes sum = right[r];
      UNROLLED for (int k = r + 1; k < 6; ++k) sum -= get(kept(j, LOWER), k * (k + 1) / 2 + r) * z[k];
      z[r] = sum * get(kept(j, LOWER), r * (r + 1) / 2 + r);
    }
    vector G_row[3];
    UNROLLED for (int r = 0; r < 3; ++r) G_row[r] = get_vector(kept(j, GRADIENT), r);
    const vector moment_here = G_row[0] * z[0] + G_row[1] * z[1] + G_row[2] * z[2];
    const vector shear{z[3], z[4], z[5]};
    const quaternion frame = get_frame(q, j);
    const vector turn = (moment_here - cross(direction_of(frame), shear) - moment_after) * get(kept(j, TURNING), 0);
    largest = higher_of(largest, dot(turn, turn));
    UNROLLED for (int k = 0; k < 6; ++k) {
      const lanes kept = get(lambda, 6 * j + k);
      const lanes value = stepping ? (is_first ? lanes(0.0f) : kept) + z[k] : kept;
      put(lambda, 6 * j + k, pins > lanes(static_cast<float>(j)) ? lanes(0.0f) : value);
    }
    const vector pull = shear * (1.0f / get(length, j));
    vector step = (pull - pull_after) * get(mobility, j + 1);
    if (is_touching) {
      const vector n = get_vector(contact(j + 1), 0);
      const lanes a = get(contact(j + 1), 3);
      step = step * a + n * ((get(contact(j + 1), 7) - a) * dot(n, step));
    }
    const vector point = get_vector(x, j + 1);
    put_vector(x, j + 1, chosen(stepping, point + step, point));
    put_frame(q, j, chosen_rotation(stepping, turned_by(turn, frame), frame));
    moment_after = moment_here;
    pull_after = pull;
  }
  return largest;
