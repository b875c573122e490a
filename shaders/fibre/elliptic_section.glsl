// SPDX-License-Identifier: GPL-3.0-or-later
// Elliptic fibers [Marschner03]: the effective index of the internal reflection depends on the azimuth.

#include "fibre/constants.glsl"

// The section's major axis: a random direction per strand, perpendicular to the fiber. It rotates with the fiber, with a
// seam only where a strand runs along that direction.
vec3 major_axis(vec3 T, float random)
{
  float z = 2.0 * random - 1.0;
  float turn = 2.0 * PI * fract(random * 1021.0);
  vec3 own = vec3(sqrt(1.0 - z * z) * vec2(cos(turn), sin(turn)), z);
  vec3 across = own - dot(own, T) * T;
  return across * inversesqrt(max(dot(across, across), 1e-12));
}

// cos(2 phi_h) = cos(phi_i + phi_o), with azimuths measured from the major axis.
float cos_twice_phi_h(vec3 T, vec3 axis, vec3 L, vec3 V)
{
  vec3 other = cross(T, axis);
  vec2 l = vec2(dot(L, axis), dot(L, other));
  vec2 v = vec2(dot(V, axis), dot(V, other));
  return (l.x * v.x - l.y * v.y) * inversesqrt(max(dot(l, l) * dot(v, v), 1e-12));
}

// Weights of the four indices from eta*_1 to eta*_2.
vec4 layer_weights(float cosine)
{
  float place = 1.5 * (1.0 - cosine);
  return max(vec4(0.0), vec4(1.0) - abs(vec4(place) - vec4(0.0, 1.0, 2.0, 3.0)));
}
