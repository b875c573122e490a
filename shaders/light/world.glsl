// SPDX-License-Identifier: GPL-3.0-or-later
// Light of the world, attenuated by hair and surfaces: an ambient cube with the radiance of each side and the visible
// fraction of its directions; `sphere.SIDES` as +x -x +y -y and +z -z.

#include "fibre/fibre.glsl"
#include "fibre/zonal_light.glsl"

// Transmitted fraction of light for each channel, if strands of an opacity would transmit the fraction `seen`.
vec3 seen_through(float seen, float opacity, vec3 forward)
{
  return pow(vec3(max(seen, 1e-6)), (vec3(1.0) - forward) / opacity);
}

// Incident radiance from the sides +x +y +z and -x -y -z, one column each. seen_x_y, seen_z: for strands of an opacity;
// forward: fraction of light that a strand passes on.
void world_sides(vec4 seen_x_y, vec2 seen_z, float opacity, vec3 forward, out mat3 plus, out mat3 minus)
{
  plus[0] = lights.world[0].rgb * seen_through(seen_x_y.x, opacity, forward);
  minus[0] = lights.world[1].rgb * seen_through(seen_x_y.y, opacity, forward);
  plus[1] = lights.world[2].rgb * seen_through(seen_x_y.z, opacity, forward);
  minus[1] = lights.world[3].rgb * seen_through(seen_x_y.w, opacity, forward);
  plus[2] = lights.world[4].rgb * seen_through(seen_z.x, opacity, forward);
  minus[2] = lights.world[5].rgb * seen_through(seen_z.y, opacity, forward);
}

// The same for a strand; channels: the light of each channel from all sides. Each side is between the light that surfaces
// alone transmit, equally for all channels, and the light that strands alone transmit.
void strand_sides(vec4 seen_x_y, vec2 seen_z, float opacity, vec3 forward, vec3 channels, out mat3 plus, out mat3 minus)
{
  float sides[6];
  for (int side = 0; side < 4; side++) {
    sides[side] = seen_x_y[side];
  }
  sides[4] = seen_z.x;
  sides[5] = seen_z.y;
  vec3 through[6];
  float behind_surfaces = 0.0;
  vec3 behind_hair = vec3(0.0);
  for (int side = 0; side < 6; side++) {
    through[side] = seen_through(sides[side], opacity, forward);
    behind_surfaces += sides[side];
    behind_hair += through[side];
  }
  vec3 between = behind_hair - vec3(behind_surfaces);
  vec3 wanted = channels - vec3(behind_surfaces);
  vec3 share = clamp(wanted * between / max(between * between, vec3(1e-8)), vec3(0.0), vec3(1.0));
  vec3 gain = channels / max(mix(vec3(behind_surfaces), behind_hair, share), vec3(1e-6));
  for (int axis = 0; axis < 3; axis++) {
    plus[axis] = lights.world[2 * axis].rgb * gain * mix(vec3(sides[2 * axis]), through[2 * axis], share);
    minus[axis] = lights.world[2 * axis + 1].rgb * gain * mix(vec3(sides[2 * axis + 1]), through[2 * axis + 1], share);
  }
}

float all_seen(vec4 seen_x_y, vec4 seen_z)
{
  return dot(seen_x_y, vec4(1.0)) + seen_z.x + seen_z.y;
}

// Mean number of strands behind a strand, seen along incident light: light/world_visibility.comp sums its exponential.
float mean_strands_behind(vec4 seen_x_y, vec4 seen_z, float opacity)
{
  return -log(clamp(seen_z.z / max(all_seen(seen_x_y, seen_z), 1e-6), 1e-4, 1.0)) / opacity;
}

// Light of the world from the inclinations that a strand scatters to the viewer, relative to light from all sides. seen_z.w:
// sum of P2 over visible directions; zonal_1, zonal_2: as for `zonal_part`. Light through hair is assumed to come from
// everywhere.
vec3 cone_visibility(vec4 seen_x_y, vec4 seen_z, vec3 channels, vec3 T, vec3 zonal_1, vec3 zonal_2)
{
  float seen = max(all_seen(seen_x_y, seen_z), 1e-6);
  // Sides weight directions by squared cosines, which gives 3/4 of the first moment of light that is linear in direction.
  vec3 uneven = vec3(seen_x_y.x - seen_x_y.y, seen_x_y.z - seen_x_y.w, seen_z.x - seen_z.y) * (4.0 / 3.0);
  vec3 cone = zonal_part(dot(T, uneven) / seen, seen_z.w / seen, zonal_1, zonal_2);
  // `strand_radiance` weights sides by the sine.
  vec3 sides = vec3(sin_from_cos(T.x), sin_from_cos(T.y), sin_from_cos(T.z));
  vec3 pairs = vec3(seen_x_y.x + seen_x_y.y, seen_x_y.z + seen_x_y.w, seen_z.x + seen_z.y);
  float weighted = max(dot(sides, pairs) / (2.0 * dot(sides, vec3(1.0))), 1e-6);
  cone = clamp(cone * seen / 6.0, vec3(0.0), vec3(1.0)) / weighted;
  return 1.0 + (cone - 1.0) * min(vec3(seen) / max(channels, vec3(1e-6)), vec3(1.0));
}

// Irradiance of a surface with normal N.
vec3 surface_irradiance(mat3 plus, mat3 minus, vec3 N)
{
  vec3 irradiance = vec3(0.0);
  for (int axis = 0; axis < 3; axis++) {
    // Squared cosines distribute the half sphere among three sides.
    irradiance += PI * N[axis] * N[axis] * (N[axis] > 0.0 ? plus[axis] : minus[axis]);
  }
  return irradiance;
}

// Radiance of a strand towards V. returned: response to uniform light; towards: its moment with the cosine of phi,
// positive if the strand scatters more light backward.
vec3 strand_radiance(mat3 plus, mat3 minus, vec3 T, vec3 V, vec3 returned, vec3 towards)
{
  // A fiber receives light in proportion to the sine of the angle between tangent and direction.
  vec3 sides = vec3(sin_from_cos(T.x), sin_from_cos(T.y), sin_from_cos(T.z));
  float sin_theta_o = dot(T, V);
  // sin(T, side) cos(phi) of each side, times the cosine of the mirror cone: V across the strand. Sides have 3/4 of the
  // change of light that is linear in direction.
  vec3 across = (V - sin_theta_o * T) * (4.0 / 3.0);
  vec3 even = (plus + minus) * sides;
  vec3 uneven = (plus - minus) * across;
  vec3 part = azimuthal_part(uneven / max(even, vec3(1e-12)), towards / max(returned, vec3(1e-6)));
  return even / (2.0 * dot(sides, vec3(1.0))) * returned * part;
}

// Normal of the surfaces around a strand. hidden: sum of the directions towards surfaces.
vec3 surface_normal_of(vec3 hidden)
{
  return -hidden * inversesqrt(max(dot(hidden, hidden), 1e-8));
}

// Light of the world that white surfaces with normal N reflect to a strand, relative to uniform light. seen: the surfaces'
// fraction of all directions; through_hair: the same, attenuated twice by the hair in front, for strands of an opacity.
vec3 surface_light(mat3 plus, mat3 minus, vec3 N, float seen, float through_hair, float opacity, vec3 forward)
{
  vec3 part = seen_through(min(through_hair / max(seen, 1e-6), 1.0), opacity, forward) * seen;
  return surface_irradiance(plus, minus, N) / PI * min(2.0 * part, vec3(1.0));
}

// The moment `towards` of a strand, including light reflected by strands behind: the integral of
// (1 - |phi| / pi) / pi × cos(phi).
vec3 with_back(vec3 towards, vec3 back)
{
  return towards + 4.0 / (PI * PI) * back;
}
