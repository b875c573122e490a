// SPDX-License-Identifier: GPL-3.0-or-later
// The environment as an equirectangular image: each texel is the mean of the source over the texel's area.

#include "light/environment.glsl"

void main()
{
  vec3 total = vec3(0.0);
  for (int y = 0; y < environment.taps; y++) {
    for (int x = 0; x < environment.taps; x++) {
      vec2 inside = (vec2(float(x), float(y)) + 0.5) / float(environment.taps);
      vec2 at = (floor(gl_FragCoord.xy) + inside) / environment.size.xy;
      vec3 turned = normalize((environment.to_image * vec4(equirectangular_direction(at), 1.0)).xyz);
      vec2 place = environment.is_mirror_ball != 0 ? mirror_ball(turned) : equirectangular(turned);
      total += textureLod(surroundings, place, 0.0).rgb;
    }
  }
  color = vec4(environment.color.rgb * total / float(environment.taps * environment.taps), 1.0);
}
