// SPDX-License-Identifier: GPL-3.0-or-later
// The even light of the world, as far as it gets through hair and past surfaces: six sides, each with the number of
// strands on the way out. Needs the samplers volume_x_y (+x, -x, +y, -y) and volume_z (+z, -z).

#include "include/opacity.glsl"

// World light that arrives at a position, the mean over the sides. plus, minus: weights of the sides +x +y +z and
// -x -y -z; forward: what one strand passes on.
vec3 world_light(vec3 position, vec3 plus, vec3 minus, vec3 forward)
{
  vec3 at = (position - lights.volume_low.xyz) / max(lights.volume_size.xyz, vec3(1e-9));
  vec4 x_y = textureLod(volume_x_y, at, 0.0);
  vec2 z = textureLod(volume_z, at, 0.0).xy;
  vec3 arriving = plus.x * transmitted(x_y.x, forward) + minus.x * transmitted(x_y.y, forward) +
                  plus.y * transmitted(x_y.z, forward) + minus.y * transmitted(x_y.w, forward) +
                  plus.z * transmitted(z.x, forward) + minus.z * transmitted(z.y, forward);
  return view.world_radiance.rgb * arriving / (dot(plus, vec3(1.0)) + dot(minus, vec3(1.0)));
}
