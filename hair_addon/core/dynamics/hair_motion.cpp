// SPDX-License-Identifier: GPL-3.0-or-later
//
// Mean velocity of hair around a point, and the push of pressure and cohesion: six numbers from eight cells.
//
// The body of `_around` in hair_volume.py. Parameters:
//
//   int row                       the cell of the point
//   int across, int along         index offset of the next cell along x, along y; 1 along z
//   vec3 part                     position of the point between the cells, 0..1 along each axis
//   float wetness                 of the point's strand
//   array_t<vec4> fields          for each cell the mean velocity [m/s], and e, the excess of density
//   array_t<float> missing        for each cell s, the lack of density; may be empty if wetness is 0
//
// Returns Σ w v, and -Σ (e - wetness s) ∇w in units of 1 / cell size.

{
float around[4] = {0.0f, 0.0f, 0.0f, 0.0f}, push[3] = {0.0f, 0.0f, 0.0f};
for (int corner = 0; corner < 8; ++corner) {
  const int dx = corner >> 2, dy = (corner >> 1) & 1, dz = corner & 1;
  const float wx = dx ? part[0] : 1.0f - part[0], wy = dy ? part[1] : 1.0f - part[1];
  const float wz = dz ? part[2] : 1.0f - part[2], weight = wx * wy * wz;
  const int cell = row + dx * across + dy * along + dz;
  const auto& field = fields.data[cell];
  for (int k = 0; k < 4; ++k) around[k] += weight * field[k];
  const float excess = wetness > 0.0f ? field[3] - wetness * missing.data[cell] : field[3];
  push[0] += (dx ? -excess : excess) * wy * wz;
  push[1] += (dy ? -excess : excess) * wx * wz;
  push[2] += (dz ? -excess : excess) * wx * wy;
}
wp::spatial_vector found;
for (int k = 0; k < 3; ++k) {
  found[k] = around[k];
  found[3 + k] = push[k];
}
return found;
}
