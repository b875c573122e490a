// SPDX-License-Identifier: GPL-3.0-or-later
// Clipping by planes: world positions below any plane are clipped.

const bool IS_CLIPPED = true;

// Whether a world position is clipped.
bool is_cut_off(vec3 place)
{
  for (int i = 0; i < 6; i++) {
    if (dot(clipping.planes[i], vec4(place, 1.0)) < 0.0) {
      return true;
    }
  }
  return false;
}

// Remaining part of a line between two world positions: its start and end as fractions of the line. If nothing remains, the
// end is not greater than the start.
vec2 part_left(vec3 start, vec3 end)
{
  vec2 part = vec2(0.0, 1.0);
  for (int i = 0; i < 6; i++) {
    vec2 above = vec2(dot(clipping.planes[i], vec4(start, 1.0)), dot(clipping.planes[i], vec4(end, 1.0)));
    if (max(above.x, above.y) < 0.0) {
      return vec2(0.0);
    }
    if (min(above.x, above.y) < 0.0) {
      float crossing = above.x / (above.x - above.y);
      part = (above.x < 0.0) ? vec2(max(part.x, crossing), part.y) : vec2(part.x, min(part.y, crossing));
    }
  }
  return part;
}
