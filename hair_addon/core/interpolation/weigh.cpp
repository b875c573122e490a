// SPDX-License-Identifier: GPL-3.0-or-later
//
// Weights of a strand's guides by distance (guide_weights.py, Eq. 9 and 10), and the rotations of their frames.
//
// The body of `weigh` in cpu_weights.py. Parameters, for S strands, K slots of guides a strand and G guides:
//
//   int strand                          the strand whose guides are weighed
//   float nearest                       distance to its nearest guide [m]
//   float reach                         distance at which the weight is zero [m]
//   float fall_off                      1 / (2 σ²) of Eq. 9 [m⁻²]
//   vec3 tangent, bitangent, normal     the strand's frame
//   array_t<int> candidates             (S, at least K) guides by increasing distance, -1 for none
//   array_t<float> ways                 (S, at least K) distances to them [m]
//   array_t<float> frames               (G, 8) tangent and normal of each guide, and two zeros
//   array_t<int> out_indices            (S, K) guides, -1 in unused slots
//   array_t<float> out_weights          (S, K) their weights, of sum 1
//   array_t<vec2> out_turns             (S, K) cosine and sine of the angle from a guide's frame to the strand's

#include "lanes.h"
#include "guide_rows.h"

const int slot_count = out_indices.shape[1];
const int* candidate = candidates.data + size_t(strand) * candidates.shape[1];
const float* way = ways.data + size_t(strand) * ways.shape[1];
int* index = out_indices.data + size_t(strand) * slot_count;
float* weight = out_weights.data + size_t(strand) * slot_count;
float* turn = reinterpret_cast<float*>(out_turns.data) + size_t(strand) * slot_count * 2;
for (int first = 0; first < slot_count; first += LANES) {
  const int count = slot_count - first < LANES ? slot_count - first : LANES;
  ints guides = -1;
  lanes its_way = nearest;
  read_lanes(guides, candidate + first, count);
  read_lanes(its_way, way + first, count);
  const ints is_near = (guides >= 0) & (its_way < reach);
  its_way = is_near ? its_way : lanes(nearest);
  const lanes part = its_way / reach;
  const lanes fall = 1.0f - part * part;
  // Relative to the nearest guide, whose factor cancels in Eq. 10: weights of far roots do not underflow.
  const lanes x = (nearest - its_way) * (nearest + its_way) * fall_off;
  // exp(x) = 2ⁿ exp(r), |r| at most log(2) / 2. log(2) is subtracted in two parts; the polynomial is [Moshier92].
  const lanes n = floor_of(x * 1.44269504f + 0.5f);
  const lanes r = x - n * 0.693359375f - n * -2.12194440e-4f;
  lanes power = 1.9875691500e-4f * r + 1.3981999507e-3f;
  power = power * r + 8.3334519073e-3f;
  power = power * r + 4.1665795894e-2f;
  power = power * r + 1.6666665459e-1f;
  power = power * r + 5.0000001201e-1f;
  power = power * r * r + r + 1.0f;
  power *= lanes_of_bits((to_ints(n) + 127) << 23);
  lanes share = is_near ? power * fall * fall : lanes(0.0f);
  // The nearest guide gets all weight if all are as far away as the nearest excluded one.
  if (first == 0 && get_lane(share, 0) == 0.0f) set_lane(share, 0, 1.0f);
  // The guide's tangent after the least rotation R from one normal to the other. For t perpendicular to a:
  // R t = t - (t·b) (a + b) / (1 + a·b). Opposite normals have no least rotation: any one is used.
  lanes row[8];
  read_columns(row, guides, frames.data);
  const lanes across = row[0] * normal[0] + row[1] * normal[1] + row[2] * normal[2];
  const lanes facing = 1.0f + (row[3] * normal[0] + row[4] * normal[1] + row[5] * normal[2]);
  const lanes lean = across / (facing > 1.0e-6f ? facing : lanes(1.0e-6f));
  const lanes turned_x = row[0] - lean * (row[3] + normal[0]);
  const lanes turned_y = row[1] - lean * (row[4] + normal[1]);
  const lanes turned_z = row[2] - lean * (row[5] + normal[2]);
  lanes cosine = tangent[0] * turned_x + tangent[1] * turned_y + tangent[2] * turned_z;
  lanes sine = bitangent[0] * turned_x + bitangent[1] * turned_y + bitangent[2] * turned_z;
  const lanes length = sqrt_of(cosine * cosine + sine * sine);
  const ints is_used = share > 0.0f;
  const ints is_turned = is_used & (length > 0.0f);
  cosine = is_turned ? cosine / length : is_used ? lanes(0.0f) : lanes(1.0f);
  sine = is_turned ? sine / length : lanes(0.0f);
  guides = is_used ? guides : ints(-1);
  write_lanes(guides, index + first, count);
  write_lanes(share, weight + first, count);
  write_pairs(cosine, sine, turn + 2 * first, count);
}
normalize(weight, slot_count);
