// SPDX-License-Identifier: GPL-3.0-or-later
// Visibility of the world: a texel per point, the sum over the directions of the opacity maps.

#include "include/shadow.glsl"
#include "include/strand.glsl"

void main()
{
  ivec2 cell = ivec2(gl_FragCoord.xy);
  int strand = cell.x / view.seen_points;
  int point = min((cell.x - strand * view.seen_points) * SEEN_STEP, view.point_count - 1);
  vec4 place = texelFetch(places, ivec2(strand * view.point_count + point, cell.y), 0);
  vec3 position = (view.object_to_world * vec4(place.xyz, 1.0)).xyz;
  seen_x_y = vec4(0.0);
  seen_z = vec4(0.0);
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    vec3 at;
    float depth;
    float seen = light.power.x;  // the direction's part of the sphere, six times
    float past_hair = 1.0;
    if (shadow_place(light, position, at, depth)) {
      seen *= lit_part(at, depth);
      past_hair = exp(-view.seen_opacity * crossed_strands(at, depth));
    }
    // Over all directions: without hair, and with it.
    seen_z.zw += seen * vec2(1.0, past_hair);
    seen *= past_hair;
    vec3 share = seen * light.axis.xyz * light.axis.xyz;
    vec3 plus = share * vec3(lessThan(light.axis.xyz, vec3(0.0)));  // lights shine along their axis
    vec3 minus = share * vec3(greaterThan(light.axis.xyz, vec3(0.0)));
    seen_x_y += vec4(plus.x, minus.x, plus.y, minus.y);
    seen_z.xy += vec2(plus.z, minus.z);
  }
}
