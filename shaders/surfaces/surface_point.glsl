// SPDX-License-Identifier: GPL-3.0-or-later

// The point of a surface in a sample of a picture.
struct SurfacePoint {
  vec3 position;
  vec3 N;  // on the viewer's side, with the normal map
  float normal_variance;  // within the sample
  vec2 uv;
  vec2 uv_right;  // change of uv to the next samples
  vec2 uv_up;
  vec4 seen_x_y;  // visibility of the world
  vec4 seen_z;
};
