// SPDX-License-Identifier: GPL-3.0-or-later
// The environment as the background of a camera view.

#include "light/environment.glsl"

void main()
{
  vec2 clip = 2.0 * gl_FragCoord.xy / environment.size.xy - 1.0;
  vec4 near = environment.clip_to_world * vec4(clip, -1.0, 1.0);
  vec4 far = environment.clip_to_world * vec4(clip, 1.0, 1.0);
  vec3 direction = normalize(far.xyz / far.w - near.xyz / near.w);
  vec3 turned = normalize((environment.to_image * vec4(direction, 1.0)).xyz);
  vec2 place = environment.is_mirror_ball != 0 ? mirror_ball(turned) : equirectangular(turned);
  color = vec4(environment.color.rgb * textureLod(surroundings, place, 0.0).rgb, 1.0);
}
