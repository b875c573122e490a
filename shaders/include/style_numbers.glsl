// SPDX-License-Identifier: GPL-3.0-or-later
// Directions, angles and random numbers of the styles: style_numbers.h and frames.h of core/styling.

// A direction as a unit vector; another one where it is shorter than `least`.
vec3 unit_or(vec3 direction, float least, vec3 other)
{
  float square = dot(direction, direction);
  return (square > least * least) ? direction / sqrt(square) : other;
}

// u, perpendicular to the unit vector a, by the least rotation from a to the unit vector b [Bishop75]. Opposite
// directions have none: u stays.
vec3 turned(vec3 u, vec3 a, vec3 b)
{
  float facing = 1.0 + dot(a, b);
  return (facing > 1e-6) ? u - (a + b) * (dot(u, b) / facing) : u;
}

// Sine and cosine of whole turns, by polynomials of least error over a turn: those of some drivers have few digits.
vec2 sine_and_cosine(float turns)
{
  float x = turns - floor(turns + 0.5);
  float z = x * x;
  float sine = x * (0.25 - z)
               * (25.13273048 + z * (-64.83467865 + z * (67.04389954 + z * (-38.12319565 + z * 12.23330116))));
  float cosine = (0.0625 - z)
                 * (16.0 + z * (-59.82727432 + z * (81.78964233 + z * (-58.57185364 + z * (25.56709099 - z * 6.54000998)))));
  return vec2(sine, cosine);
}

// x to the power e, for x and e from 0 to 1; 0 for x = 0.
float power(float x, float e)
{
  if (x <= 1e-30) {
    return 0.0;
  }
  // x = m 2ⁿ, m from √½ to √2; log2(m) by the series of the inverse hyperbolic tangent.
  int shifted = floatBitsToInt(x) - 0x3f3504f3;
  float m = intBitsToFloat((shifted & 0x007fffff) + 0x3f3504f3);
  float z = (m - 1.0) / (m + 1.0);
  float z2 = z * z;
  float series = z * (2.8853900818 + z2 * (0.9617966939 + z2 * (0.5770780164 + z2 * 0.4121985831)));
  float y = max(e * (float(shifted >> 23) + series), -126.0);
  float nearest = floor(y + 0.5);
  float f = y - nearest;
  float result = 1.5403530e-4 * f + 1.3333558e-3;
  result = result * f + 9.6181291e-3;
  result = result * f + 5.5504109e-2;
  result = result * f + 2.4022651e-1;
  result = result * f + 6.9314718e-1;
  result = result * f + 1.0;
  return result * intBitsToFloat((int(nearest) + 127) << 23);
}

// Random numbers in [0, 1) that follow from an identity, a seed and a purpose; lowbias32 [Wellons18].
float random_number(int identity, int seed, int purpose)
{
  uint x = (uint(identity) ^ (uint(seed) * 0x9e3779b9u)) + uint(purpose) * 0x85ebca6bu;
  x ^= x >> 16u;
  x *= 0x7feb352du;
  x ^= x >> 15u;
  x *= 0x846ca68bu;
  x ^= x >> 16u;
  return float(x >> 8u) * 5.9604644775390625e-8;
}

// Part of its amount that a style has along a strand.
struct Course {
  float at_root;
  float at_tip;
  float exponent;
  float from;
  float is_flipped;
  float least;  // x up to which it rises straight: a power would begin vertically, and points jump
  float slope;  // until there
};

// ends: the profile at root and tip; bent: its exponent, whether it is flipped, its start.
Course course_of(vec2 ends, vec3 bent, int point_count)
{
  Course made;
  made.at_root = ends.x;
  made.at_tip = ends.y;
  made.exponent = bent.x;
  made.is_flipped = bent.y;
  made.from = bent.z;
  made.least = 0.5 / float(point_count - 1);
  made.slope = 1.0 / power(made.least, 1.0 - made.exponent);
  return made;
}

// The profile at x of the strand's length.
float profile(Course course, float x)
{
  if (course.at_root == course.at_tip) {
    return course.at_root;
  }
  // x of the tip is 1 but for rounding, which steep profiles are sensitive to.
  float y = clamp((1.000001 * x - course.from) / (1.0 - course.from), 0.0, 1.0);
  if (course.is_flipped != 0.0) {
    y = 1.0 - power(1.0 - y, course.exponent);
  }
  else if (course.exponent != 1.0) {
    y = (y < course.least) ? y * course.slope : power(y, course.exponent);
  }
  return course.at_root + (course.at_tip - course.at_root) * y;
}

// The reference of frames across a normal, continuous everywhere but straight below. axes: from the coordinates
// of the normal to the surface's own.
vec3 reference(vec3 surface_normal, mat4 axes)
{
  vec3 n = (axes * vec4(surface_normal, 0.0)).xyz;
  float above = max(1.0 + n.z, 1e-6);
  return (vec4(1.0 - n.x * n.x / above, -n.x * n.y / above, -n.x, 0.0) * axes).xyz;
}
