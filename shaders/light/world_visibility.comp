// SPDX-License-Identifier: GPL-3.0-or-later
// Visibility of the world: one texel per point, the sum over the directions of the opacity maps.

#include "shadows/shadow.glsl"
#include "strands/packed_strand.glsl"
#include "light/visibility_bytes.glsl"
#include "surfaces/vertex_position.glsl"
#include "light/write_visibility_sums.glsl"

// World position of a strand's point, or of a surface's vertex; first: its first texel.
vec3 place_of(ivec2 first, int point)
{
  point = clamp(point, 0, view.point_count - 1);
  vec3 place = (view.point_count > 1) ? packed_place(places, first, packed_head(places, first), point) :
                                        vertex_place(places, first.y * view.row_strands + first.x);
  return (view.object_to_world * vec4(place, 1.0)).xyz;
}

void main()
{
  ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(cell, imageSize(seen_x_y).xy))) {
    return;
  }
  int strand = cell.x / view.seen_points;
  int point = min((cell.x - strand * view.seen_points) * SEEN_STEP, view.point_count - 1);
  bool is_strand = view.point_count > 1;
  ivec2 first = is_strand ? ivec2(strand * (HEAD_TEXELS + view.point_count - 1), cell.y) : ivec2(strand, cell.y);
  vec3 position = place_of(first, point);
  vec3 along = place_of(first, point + 1) - place_of(first, point - 1);
  vec3 T = along * inversesqrt(max(dot(along, along), 1e-20));
  vec3 root = place_of(first, 1) - place_of(first, 0);
  vec3 R = root * inversesqrt(max(dot(root, root), 1e-20));
  // Surfaces have no radii.
  bool is_shared = view.radius_strands == 1;
  ivec2 texel = is_shared ? ivec2(point, 0) : ivec2(strand * view.point_count + point, cell.y);
  float radius = is_strand ? texelFetch(strand_radii, texel, 0).r * view.radius_unit * view.object_scale : 0.0;
  Seen sums;
  sums.x_y = vec4(0.0);
  sums.z = vec4(0.0);
  sums.surface = vec4(0.0);
  sums.channels = vec4(0.0);
  sums.color = vec4(0.0);
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    vec3 at;
    float depth;
    float weight = light.power.x;  // six times the direction's fraction of the sphere
    float open = weight;  // fraction that passes surfaces
    float past_hair = 1.0;
    float left = 1.0;
    float beyond = 0.0;
    vec3 past_hair_channels = vec3(1.0);
    if (shadow_place(light, position, at, depth)) {
      float bias = is_strand ? strand_bias(R, -light.axis.xyz) : SURFACE_BIAS;
      vec3 normal;
      vec4 color;
      beyond = weight * surface_beyond(light, at, depth, -light.axis.xyz, normal, color);
      float behind;
      float front = crossed_strands(at, depth, own_count(light, position, radius), behind);
      open *= lit_part(at, depth, bias);
      float crossed = is_strand ? front : crossed_before_surface(at, depth);
      past_hair = exp(-view.seen_opacity * crossed);
      past_hair_channels = transmitted(crossed, view.hair_forward.rgb);
      left = exp(-view.seen_opacity * behind);
      // Through the hair to the surface, and back.
      sums.surface += beyond * left * left * vec4(light.axis.xyz, 1.0);
      sums.color += beyond * left * left * color / max(color.a, 1e-6);
    }
    float seen = open * past_hair;
    vec3 share = seen * light.axis.xyz * light.axis.xyz;
    vec3 plus = share * vec3(lessThan(light.axis.xyz, vec3(0.0)));  // lights shine along their axis
    vec3 minus = share * vec3(greaterThan(light.axis.xyz, vec3(0.0)));
    sums.x_y += vec4(plus.x, minus.x, plus.y, minus.y);
    // For strands: attenuated by the hair behind them, and weighted by P2 of sin(theta_i). For surfaces: all directions
    // without and with hair.
    vec2 others = is_strand ? seen * vec2(left, legendre_2(dot(T, light.axis.xyz))) : open * vec2(1.0, past_hair);
    // Surfaces block all channels equally, strands do not. Alpha: surfaces, without the hair in front of them.
    sums.channels += vec4(open * past_hair_channels, beyond);
    sums.z += vec4(plus.z, minus.z, others);
  }
  put_seen(cell, sums);
}
