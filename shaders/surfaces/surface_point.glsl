// SPDX-License-Identifier: GPL-3.0-or-later

// A point of a surface that a sample of a picture shows.
struct SurfacePoint {
  vec3 position;
  vec3 N;  // on the viewer's side, by the normal map
  float normal_variance;  // of it between here and the next samples
  vec2 uv;
  vec2 uv_right;  // its change to the next samples
  vec2 uv_up;
  vec4 seen_x_y;  // visibility of the world
  vec4 seen_z;
};
