// SPDX-License-Identifier: GPL-3.0-or-later
// What is shown of a strand's light: all of it. Programs of Solid shading include fibre/solid_light.glsl in place of this
// file.

// Factor of highlights before `shown_light`.
vec3 shown_highlight()
{
  return vec3(1.0);
}

vec3 shown_light(vec3 light, vec3 T, vec3 V, vec3 returned, vec3 open)
{
  return light;
}
