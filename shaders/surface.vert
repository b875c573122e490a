// SPDX-License-Identifier: GPL-3.0-or-later

void main()
{
  surface_normal = normal;
  drawn_position = position;
  gl_Position = view.world_to_clip * vec4(position, 1.0);
}
