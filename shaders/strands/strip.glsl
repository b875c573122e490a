// SPDX-License-Identifier: GPL-3.0-or-later
// Strands as camera-facing strips, without vertex attributes: everything follows from the index of a vertex.

// Strand, point and side (-1 or +1) of a vertex of the single strip. Each strand has two vertices per point and repeats its
// first and last vertex, so that the triangles between two strands have no area.
void strip_vertex(int index, int point_count, out int strand, out int point, out float side)
{
  int stride = 2 * point_count + 2;
  strand = index / stride;
  int local = clamp(index - strand * stride - 1, 0, 2 * point_count - 1);
  point = local / 2;
  side = float(2 * (local - 2 * point) - 1);
}

// Interval of the strand points that have a texel in the visibility textures.
const int SEEN_STEP = 4;

// Texel of a point: each row of the texture contains `row_strands` whole strands.
ivec2 strand_texel(int strand, int point, int point_count, int row_strands)
{
  int row = strand / row_strands;
  return ivec2((strand - row * row_strands) * point_count + point, row);
}

// Coordinates [texels] in the visibility textures of a position from root 0 to tip 1: neighbors in a row are of one strand.
vec2 seen_texel(int strand, float position, int point_count, int seen_points, int row_strands)
{
  int row = strand / row_strands;
  float point = position * float(point_count - 1) / float(SEEN_STEP);
  return vec2(float((strand - row * row_strands) * seen_points) + point, float(row)) + 0.5;
}

// Unit vector across the strip, facing the viewer; any perpendicular vector if the strand points at the viewer.
vec3 strip_side(vec3 tangent, vec3 to_view)
{
  vec3 side = cross(tangent, to_view);
  float length_squared = dot(side, side);
  if (length_squared > 1e-12) {
    return side * inversesqrt(length_squared);
  }
  vec3 axis = (abs(tangent.x) < 0.5) ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
  return normalize(cross(tangent, axis));
}
