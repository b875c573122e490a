// SPDX-License-Identifier: GPL-3.0-or-later
// Visibility of the world from a point of a strand in twenty bytes: the sums over the directions
// (light/world_visibility.comp) are mapped to [0, 1] so that steps are equally invisible in shade and in light.

struct Seen {
  vec4 x_y;
  vec4 z;
  vec4 surface;
  vec4 channels;
  vec4 color;  // of surfaces that are visible through hair
};

const float ZERO_BYTE = 128.0;  // exactly zero, for signed numbers

// Visible fractions of the world as square roots, similar to display encodings; the others relative to them. P2 >= -1/2.
Seen seen_to_bytes(Seen seen)
{
  float all = max(dot(seen.x_y, vec4(1.0)) + seen.z.x + seen.z.y, 1e-6);
  float length_squared = dot(seen.surface.xyz, seen.surface.xyz);
  vec3 direction = seen.surface.xyz * (length_squared > 1e-12 ? inversesqrt(length_squared) : 0.0);
  Seen bytes;
  bytes.x_y = sqrt(clamp(seen.x_y, 0.0, 1.0));
  vec2 others = clamp(seen.z.zw / all, vec2(0.0, -0.5), vec2(1.0));
  bytes.z = vec4(sqrt(clamp(seen.z.xy, 0.0, 1.0)), sqrt(others.x), (others.y + 0.5) / 1.5);
  float through_hair = clamp(seen.surface.w / max(seen.channels.a, 1e-6), 0.0, 1.0);
  bytes.surface = vec4((direction * (255.0 - ZERO_BYTE) + ZERO_BYTE) / 255.0, sqrt(through_hair));
  bytes.channels = sqrt(clamp(seen.channels / 6.0, 0.0, 1.0));
  bytes.color = vec4(sqrt(clamp(seen.color.rgb / max(seen.surface.w, 1e-6), 0.0, 1.0)), 1.0);
  return bytes;
}

// The sums; the direction of surfaces has length one, or zero without surfaces.
Seen seen_from_bytes(Seen bytes)
{
  Seen seen;
  seen.x_y = bytes.x_y * bytes.x_y;
  seen.z.xy = bytes.z.xy * bytes.z.xy;
  float all = dot(seen.x_y, vec4(1.0)) + seen.z.x + seen.z.y;
  seen.z.zw = all * vec2(bytes.z.z * bytes.z.z, bytes.z.w * 1.5 - 0.5);
  seen.channels = 6.0 * bytes.channels * bytes.channels;
  vec3 direction = (bytes.surface.xyz * 255.0 - ZERO_BYTE) / (255.0 - ZERO_BYTE);
  seen.surface = vec4(direction, bytes.surface.w * bytes.surface.w * seen.channels.a);
  seen.color = vec4(bytes.color.rgb * bytes.color.rgb * seen.surface.w, seen.surface.w);
  return seen;
}
