// SPDX-License-Identifier: GPL-3.0-or-later
// The nearest triangle that a ray hits, as `wp.mesh_query_ray` finds it: through a tree of boxes
// (core/geometry/search/triangle_tree.py) at given.boxes_first, with its triangles from given.corners_first on.

struct MeshQueryRay {
  bool result;
  float t;
  float u;
  float v;
  int face;
  vec3 normal;
};

// Whether a ray enters a box before a distance. inverse: reciprocals of the ray's direction.
bool is_box_hit(int node, vec3 origin, vec3 inverse, float end)
{
  vec3 one = (vec3_at(given.boxes_first + 2 * node) - origin) * inverse;
  vec3 other = (vec3_at(given.boxes_first + 2 * node + 1) - origin) * inverse;
  vec3 near_side = min(one, other);
  vec3 far_side = max(one, other);
  float enter = max(max(near_side.x, near_side.y), max(near_side.z, 0.0));
  float leave = min(min(far_side.x, far_side.y), min(far_side.z, end));
  return enter <= leave * 1.0000005;
}

// Watertight intersection [Woop13]: (hit, distance, barycentric coordinates of the first two corners).
bool is_triangle_hit(vec3 a, vec3 b, vec3 c, ivec3 axes, vec3 shear, out float t, out float u, out float v)
{
  vec2 first = vec2(a[axes.x], a[axes.y]) - shear.xy * a[axes.z];
  vec2 second = vec2(b[axes.x], b[axes.y]) - shear.xy * b[axes.z];
  vec2 third = vec2(c[axes.x], c[axes.y]) - shear.xy * c[axes.z];
  float of_a = third.x * second.y - third.y * second.x;
  float of_b = first.x * third.y - first.y * third.x;
  float of_c = second.x * first.y - second.y * first.x;
  float total = of_a + of_b + of_c;
  t = 0.0;
  u = 0.0;
  v = 0.0;
  if (min(min(of_a, of_b), of_c) < 0.0 && max(max(of_a, of_b), of_c) > 0.0) {
    return false;
  }
  if (total == 0.0) {
    return false;
  }
  t = shear.z * (of_a * a[axes.z] + of_b * b[axes.z] + of_c * c[axes.z]) / total;
  u = of_a / total;
  v = of_b / total;
  return true;
}

MeshQueryRay mesh_query_ray(vec3 origin, vec3 direction, float end)
{
  MeshQueryRay hit;
  hit.result = false;
  hit.t = end;
  hit.u = 0.0;
  hit.v = 0.0;
  hit.face = -1;
  hit.normal = vec3(0.0);
  vec3 size = abs(direction);
  int z = (size.x > size.y) ? ((size.x > size.z) ? 0 : 2) : ((size.y > size.z) ? 1 : 2);
  ivec3 axes = ivec3((z + 1) % 3, (z + 2) % 3, z);
  vec3 shear = vec3(direction[axes.x], direction[axes.y], 1.0) / direction[z];
  vec3 inverse = 1.0 / vec3(size.x < 1e-20 ? 1e-20 : direction.x,
                            size.y < 1e-20 ? 1e-20 : direction.y,
                            size.z < 1e-20 ? 1e-20 : direction.z);
  int node = 1;
  while (node > 0) {
    bool is_hit = is_box_hit(node, origin, inverse, hit.t);
    if (is_hit && node < given.leaf_count) {
      node *= 2;
    } else {
      int place = given.corners_first + 3 * LEAF_TRIANGLES * (node - given.leaf_count);
      for (int turn = 0; is_hit && turn < LEAF_TRIANGLES; turn++) {
        vec4 corner = vec4_at(place);
        vec3 a = corner.xyz - origin;
        vec3 b = vec3_at(place + 1) - origin;
        vec3 c = vec3_at(place + 2) - origin;
        float t, u, v;
        if (is_triangle_hit(a, b, c, axes, shear, t, u, v) && t >= 0.0 && t < hit.t) {
          hit.result = true;
          hit.t = t;
          hit.u = u;
          hit.v = v;
          hit.face = int(corner.w);
          hit.normal = unit_of(cross(b - a, c - a));
        }
        place += 3;
      }
      // The next node that is not below this one; node 0 after the last.
      while ((node & 1) == 1) {
        node /= 2;
      }
      node += (node > 0) ? 1 : 0;
    }
  }
  return hit;
}
