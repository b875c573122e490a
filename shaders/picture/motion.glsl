// SPDX-License-Identifier: GPL-3.0-or-later
// Motion vectors [pixels] as in Cycles: to the position in the previous frame, and from the position in the next frame.

vec2 picture_place(vec4 clip, vec2 size)
{
  return (0.5 * clip.xy / clip.w + 0.5) * size;
}

vec4 moved(vec4 now, vec4 before, vec4 after, vec2 size)
{
  vec2 place = picture_place(now, size);
  return vec4(picture_place(before, size) - place, place - picture_place(after, size));
}
