// SPDX-License-Identifier: GPL-3.0-or-later
// The main function of all shading models: the sum over the scene's lights plus the world's light, for each sample of a
// picture in which a strand of this hair is nearest. Models define
//
// vec3 hair_radiance(vec3 T, vec3 L, vec3 V, float front, float behind, float blur)
//     light leaving the fiber towards V for unit irradiance from around L outside the hair, with a mean of `front` strands
//     in front of it and `behind` strands behind it; blur: variance of the light's direction along an axis [rad²]
// void hair_return(float sin_theta_o, out vec3 returned, out vec3 towards, out vec3 zonal_1, out vec3 zonal_2)
//     the fiber's response to uniform light: the integral over phi, the integral weighted with the cosine of phi, and the
//     responses to light that varies as P1 and P2 of sin(theta_i)
// vec3 returned_from_behind(float sin_theta_o, float behind)
//     light that `behind` strands add to `returned`

#include "light/strand_irradiance.glsl"
#include "fibre/drawn_lobes.glsl"
#include "fibre/fibre.glsl"
#include "fibre/light_highlight.glsl"
#include "fibre/shown_light.glsl"
#include "light/light_grid.glsl"
#include "light/visibility_bytes.glsl"
#include "light/strand_visibility.glsl"
#include "visibility/strand_hit.glsl"
#include "light/world.glsl"

const float LEAST_IRRADIANCE = 1e-4;  // [W/m²]; less is not visible
const float LEAST_LIGHT = 1e-7;  // of voxels, to which parts of light are relative

struct SeenStrand {
  vec3 T;
  vec3 V;
  vec3 root;  // `root_direction`
  vec3 returned;  // results of `hair_return`
  vec3 towards;
  vec3 zonal_1;
  vec3 zonal_2;
};

// Direction in which most of the world is visible from the strand: about that of a surface around the hair. Unnormalized.
vec3 open_direction;

// The strand at the result of `find_place`.
SeenStrand seen_strand()
{
  SeenStrand strand;
  strand.T = strand_tangent;
  strand.V = view.is_perspective != 0 ? normalize(view.eye.xyz - drawn_position) : view.eye.xyz;
  strand.root = root_direction(strand_index);
  hair_return(dot(strand.T, strand.V), strand.returned, strand.towards, strand.zonal_1, strand.zonal_2);
  return strand;
}

bool is_visible(vec3 irradiance)
{
  return max(irradiance.r, max(irradiance.g, irradiance.b)) > LEAST_IRRADIANCE;
}

// Radiance towards the viewer by dual scattering.
vec3 strand_light(SeenStrand strand)
{
  vec3 T = strand.T;
  vec3 V = strand.V;
  vec2 seen_at = seen_texel(strand_index, strand_position, view.point_count, view.seen_points, view.row_strands);
  Seen seen = seen_from_bytes(seen_bytes_at(seen_at));
  vec4 seen_x_y = seen.x_y;
  vec4 seen_z = seen.z;
  float strands_behind = mean_strands_behind(seen_x_y, seen_z, view.seen_opacity);
  vec3 back = returned_from_behind(dot(T, V), strands_behind);
  mat3 plus;
  mat3 minus;
  vec4 seen_channels = seen.channels;
  open_direction = vec3(seen_x_y.x - seen_x_y.y, seen_x_y.z - seen_x_y.w, seen_z.x - seen_z.y);
  strand_sides(seen_x_y, seen_z.xy, view.seen_opacity, view.hair_forward.rgb, seen_channels.rgb, plus, minus);
  vec3 world = strand_radiance(plus, minus, T, V, strand.returned + back, with_back(strand.towards, back));
  vec3 all = max(strand.returned, vec3(1e-6));
  world *= cone_visibility(seen_x_y, seen_z, seen_channels.rgb, T, strand.zonal_1 / all, strand.zonal_2 / all);
  vec4 hidden = seen.surface / 6.0;
  vec3 N = surface_normal_of(hidden.xyz);
  float surface_part = seen_channels.a / 6.0;
  vec3 from_surfaces = surface_light(plus, minus, N, surface_part, hidden.w, view.seen_opacity, view.hair_forward.rgb);
  vec3 surface_color = seen.color.rgb / max(seen.color.a, 1e-4);
  from_surfaces *= surface_color * between_hair_and_surface(surface_color, strands_behind);
  vec2 below = light_from_below(T, V, N);
  vec3 of_surfaces = max(below.x * strand.returned + below.y * strand.towards, vec3(0.0));
  world += from_surfaces * of_surfaces;
  vec3 radiance = drawn_world * world;
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    LampLight lamp = lamp_on_strand(light, strand.root);
    vec3 irradiance = lamp.irradiance * lamp.open * (1.0 - light.dimmed_behind * max(-dot(lamp.L, V), 0.0));
    if (!is_visible(irradiance)) {
      continue;
    }
    count_strands(light, lamp);
    // Most strands are in the shadow of the others, with no light to scatter.
    if (is_visible(irradiance * transmitted(lamp.front, view.hair_forward.rgb))) {
      // If the light misses surfaces, the normal and color of the surfaces visible from the strand.
      vec3 lit_normal = N;
      vec3 lit_color = surface_color;
      if (lamp.is_in_map) {
        vec3 normal;
        vec4 color;
        float found = surface_beyond(light, lamp.at, lamp.depth, lamp.L, normal, color);
        lit_normal = normalize(mix(N, normal, found) + 1e-4 * lamp.L);
        lit_color = mix(surface_color, color.rgb / max(color.a, 1e-6), found * step(0.1, color.a));
      }
      vec3 bounce = surface_bounce(lit_normal, lit_color, surface_part, lamp.L, T, lamp.front, lamp.behind);
      radiance += drawn_lobes.w * irradiance * bounce * of_surfaces;
      light_highlight = (1.0 + light.highlight_excess) * shown_highlight();
      float blur = light_blur(light.kind, light.position.xyz, light.radius, drawn_position);
      radiance += irradiance * hair_radiance(T, lamp.L, V, lamp.front, lamp.behind, blur);
    }
  }
  return radiance;
}

// Radiance if paths through a grid have measured all light: a fraction of dual scattering, plus the light of the grid.
vec3 light_on_grid(SeenStrand strand, bool with_nodes)
{
  vec4 among = light_among_strands(drawn_position, strand_index, strand_position, with_nodes);
  return max(among.a * strand_light(strand) + drawn_lobes.w * among.rgb * strand.returned, vec3(0.0));
}

vec3 strand_light_on_grid(SeenStrand strand)
{
  if (!is_part_of_light() || !has_nodes()) {
    return light_on_grid(strand, true);
  }
  // Nodes do not distinguish lobes: each part changes as all light does.
  vec3 part = light_on_grid(strand, false);
  draw_part(false);
  vec3 before = light_on_grid(strand, false);
  vec3 after = light_on_grid(strand, true);
  draw_part(true);
  return mix(drawn_lobes.w * after, part * after / max(before, vec3(LEAST_LIGHT)), step(vec3(LEAST_LIGHT), before));
}

vec4 sample_value()
{
  draw_part(true);
  SeenStrand strand = seen_strand();
  vec3 light = has_light_grid() ? strand_light_on_grid(strand) : strand_light(strand);
  return vec4(shown_light(light, strand.T, strand.V, strand.returned, open_direction), 1.0);
}

#include "visibility/strand_samples.glsl"
