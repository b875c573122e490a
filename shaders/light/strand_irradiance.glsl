// SPDX-License-Identifier: GPL-3.0-or-later
// Light of a lamp on a strand at the result of `find_place`.

#include "light/irradiance.glsl"
#include "visibility/strand_hit.glsl"

struct LampLight {
  vec3 L;           // towards the lamp
  vec3 irradiance;  // [W/m²] without occlusion
  float open;       // fraction that passes surfaces
  float front;      // mean number of strands in front, by `count_strands`
  float behind;     // mean number of strands behind, by `count_strands`
  bool is_in_map;   // whether the position is in the lamp's shadow maps
  vec3 at;          // coordinates in these maps
  float depth;
};

// root: `root_direction` of the strand.
LampLight lamp_on_strand(Light light, vec3 root)
{
  LampLight lamp;
  lamp.L = to_light(light.kind, light.position.xyz, light.axis.xyz, drawn_position);
  lamp.irradiance = irradiance_of(light, drawn_position);
  lamp.open = 1.0;
  lamp.front = 0.0;
  lamp.behind = 0.0;
  lamp.is_in_map = shadow_place(light, drawn_position, lamp.at, lamp.depth);
  if (lamp.is_in_map) {
    lamp.open = lit_part(lamp.at, lamp.depth, strand_bias(root, lamp.L));
  }
  return lamp;
}

// Finds the strands in front of and behind the strand, seen from a lamp. They only matter if surfaces let its light through.
void count_strands(Light light, inout LampLight lamp)
{
  if (lamp.is_in_map) {
    float own = own_count(light, drawn_position, drawn_radius);
    lamp.front = crossed_strands(lamp.at, lamp.depth, own, lamp.behind);
  }
}
