// SPDX-License-Identifier: GPL-3.0-or-later
// Nearest rotation of a matrix, its orthogonal polar factor, by Newton's iteration [Higham86]:
// core/geometry/nearest_rotation.py in single precision.

const int ROTATION_STEPS = 16;
const float LAST_CHANGE = 1.0e-4;  // convergence is quadratic: the remaining error is its square
const float FLAT_VOLUME = 1.0e-6;  // of a matrix of size one that counts as flat: rounding decides the sign

float matrix_size(mat3 given)
{
  return sqrt(dot(given[0], given[0]) + dot(given[1], given[1]) + dot(given[2], given[2]));
}

mat3 unturned()
{
  return mat3(vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0));
}

// U V^T of U S V^T: mirrored if the matrix mirrors. For a flat matrix the rotation is chosen over the equally near mirrored
// one; for a zero matrix or a line, the identity if no rotation is nearest.
mat3 nearest_rotation(mat3 given)
{
  float size = matrix_size(given);
  if (!(size > 0.0)) {
    return unturned();
  }
  mat3 found = given * (1.0 / size);
  for (int turn = 0; turn < ROTATION_STEPS; turn++) {
    // The inverse transpose is the cofactors divided by the volume. Errors of a volume near zero do not matter, as the next
    // steps correct them.
    mat3 cofactors = mat3(cross(found[1], found[2]), cross(found[2], found[0]), cross(found[0], found[1]));
    float volume = dot(found[0], cofactors[0]);
    volume = (abs(volume) < FLAT_VOLUME) ? max(abs(volume), 1.0e-12) : volume;
    mat3 inverted = cofactors * (1.0 / volume);
    float inverted_size = matrix_size(inverted);
    if (!(inverted_size > 0.0)) {
      return unturned();
    }
    float scale = sqrt(inverted_size / matrix_size(found));
    mat3 refined = found * (0.5 * scale) + inverted * (0.5 / scale);
    float change = matrix_size(refined - found);
    found = refined;
    if (change < LAST_CHANGE) {
      break;
    }
  }
  return found;
}
