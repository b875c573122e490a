# SPDX-License-Identifier: GPL-3.0-or-later
"""The sums of guide_weights.py over a strand's guides: eight guides at once in a processor's vector registers.

Written once for both kinds of device, in Clang's vectors: for a GPU, whose threads are lanes already, a vector is one
number. What is known of a guide stands in eight numbers side by side; those of eight guides are read as rows, and
turned into columns. The exponential is a polynomial [Moshier92].
"""

import warp as wp

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

NUMBERS = 8  # that are known of a guide

_VECTORS = """
#if defined(__CUDA_ARCH__)
  #define LANES 1
  typedef float lanes;
  typedef int ints;
  #define LANE(vector, lane) vector
  #define FLOOR(vector) floorf(vector)
  #define SQRT(vector) sqrtf(vector)
  #define ABS(vector) fabsf(vector)
  #define AS_WHOLE(vector) static_cast<int>(vector)
  #define AS_BITS_OF_LANES(whole) __int_as_float(whole)
  #define READ_COLUMNS(row, guides, numbers) \\
    for (int i = 0; i < 8; ++i) row[i] = numbers[size_t(guides < 0 ? 0 : guides) * 8 + i];
#else
  #define LANES 8
  typedef float lanes __attribute__((ext_vector_type(8)));
  typedef int ints __attribute__((ext_vector_type(8)));
  #define LANE(vector, lane) vector[lane]
  #define FLOOR(vector) __builtin_elementwise_floor(vector)
  #define SQRT(vector) __builtin_elementwise_sqrt(vector)
  #define ABS(vector) __builtin_elementwise_abs(vector)
  #define AS_WHOLE(vector) __builtin_convertvector(vector, ints)
  #define AS_BITS_OF_LANES(whole) __builtin_bit_cast(lanes, whole)
  #define READ_COLUMNS(row, guides, numbers) \\
    for (int lane = 0; lane < 8; ++lane) { \\
      __builtin_memcpy(&row[lane], numbers + size_t(guides[lane] < 0 ? 0 : guides[lane]) * 8, sizeof(lanes)); \\
    } \\
    for (int i = 0; i < 8; i += 2) { \\
      const lanes a = row[i], b = row[i + 1]; \\
      row[i] = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14); \\
      row[i + 1] = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15); \\
    } \\
    for (int i = 0; i < 8; i += i % 4 == 1 ? 3 : 1) { \\
      const lanes a = row[i], b = row[i + 2]; \\
      row[i] = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13); \\
      row[i + 2] = __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15); \\
    } \\
    for (int i = 0; i < 4; ++i) { \\
      const lanes a = row[i], b = row[i + 4]; \\
      row[i] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11); \\
      row[i + 4] = __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15); \\
    }
#endif
"""

_END = """
  float total = 0.0f;
  for (int slot = 0; slot < slot_count; ++slot) total += weight[slot];
  for (int slot = 0; slot < slot_count; ++slot) weight[slot] /= total;
  #undef LANES
  #undef LANE
  #undef FLOOR
  #undef SQRT
  #undef ABS
  #undef AS_WHOLE
  #undef AS_BITS_OF_LANES
  #undef READ_COLUMNS
"""

_WEIGH = f"""
  {_VECTORS}
  const int slot_count = out_indices.shape[1];
  const int* candidate = candidates.data + size_t(strand) * candidates.shape[1];
  const float* way = ways.data + size_t(strand) * ways.shape[1];
  int* index = out_indices.data + size_t(strand) * slot_count;
  float* weight = out_weights.data + size_t(strand) * slot_count;
  float* turn = reinterpret_cast<float*>(out_turns.data) + size_t(strand) * slot_count * 2;
  for (int first = 0; first < slot_count; first += LANES) {{
    const int count = slot_count - first < LANES ? slot_count - first : LANES;
    ints guides = -1;
    lanes its_way = nearest;
    for (int lane = 0; lane < count; ++lane) {{
      LANE(guides, lane) = candidate[first + lane];
      LANE(its_way, lane) = way[first + lane];
    }}
    const ints is_near = (guides >= 0) & (its_way < reach);
    its_way = is_near ? its_way : lanes(nearest);
    const lanes part = its_way / reach;
    const lanes fall = 1.0f - part * part;
    // Relative to the nearest guide's, which cancels in Eq. 10: no weight of a far root is lost to rounding.
    const lanes x = (nearest - its_way) * (nearest + its_way) * fall_off;
    // exp(x) = 2^n exp(r), r at most half of log 2, which is taken away in two parts.
    const lanes n = FLOOR(x * 1.44269504f + 0.5f);
    const lanes r = x - n * 0.693359375f - n * -2.12194440e-4f;
    lanes power = 1.9875691500e-4f * r + 1.3981999507e-3f;
    power = power * r + 8.3334519073e-3f;
    power = power * r + 4.1665795894e-2f;
    power = power * r + 1.6666665459e-1f;
    power = power * r + 5.0000001201e-1f;
    power = power * r * r + r + 1.0f;
    power *= AS_BITS_OF_LANES((AS_WHOLE(n) + 127) << 23);
    lanes share = is_near ? power * fall * fall : lanes(0.0f);
    if (first == 0 && LANE(share, 0) == 0.0f) LANE(share, 0) = 1.0f;  // all are as far as the one that is left out
    // Where the least rotation from one normal to the other leaves the guide's tangent. For t across a:
    // R t = t - (t·b) (a + b) / (1 + a·b). Opposite normals have no least rotation: any will do.
    lanes row[8];
    READ_COLUMNS(row, guides, frames.data)
    const lanes across = row[0] * normal[0] + row[1] * normal[1] + row[2] * normal[2];
    const lanes facing = 1.0f + (row[3] * normal[0] + row[4] * normal[1] + row[5] * normal[2]);
    const lanes lean = across / (facing > 1.0e-6f ? facing : lanes(1.0e-6f));
    const lanes turned_x = row[0] - lean * (row[3] + normal[0]);
    const lanes turned_y = row[1] - lean * (row[4] + normal[1]);
    const lanes turned_z = row[2] - lean * (row[5] + normal[2]);
    lanes cosine = tangent[0] * turned_x + tangent[1] * turned_y + tangent[2] * turned_z;
    lanes sine = bitangent[0] * turned_x + bitangent[1] * turned_y + bitangent[2] * turned_z;
    const lanes length = SQRT(cosine * cosine + sine * sine);
    const ints is_used = share > 0.0f;
    const ints is_turned = is_used & (length > 0.0f);
    cosine = is_turned ? cosine / length : is_used ? lanes(0.0f) : lanes(1.0f);
    sine = is_turned ? sine / length : lanes(0.0f);
    guides = is_used ? guides : ints(-1);
    for (int lane = 0; lane < count; ++lane) {{
      index[first + lane] = LANE(guides, lane);
      weight[first + lane] = LANE(share, lane);
      turn[2 * (first + lane)] = LANE(cosine, lane);
      turn[2 * (first + lane) + 1] = LANE(sine, lane);
    }}
  }}
  {_END}
"""

_LIMIT = f"""
  {_VECTORS}
  const int slot_count = indices.shape[1];
  const int* index = indices.data + size_t(strand) * slot_count;
  const float* before = weights.data + size_t(strand) * slot_count;
  const float* turn = reinterpret_cast<const float*>(turns.data) + size_t(strand) * slot_count * 2;
  float* weight = out_weights.data + size_t(strand) * slot_count;
  // 0 at the first, 1 a way further, smooth between.
  #define FADE(first, per_way, value, fade) \\
    lanes fade = (value - (first)) * per_way; \\
    fade = fade < 0.0f ? lanes(0.0f) : fade; \\
    fade = fade > 1.0f ? lanes(1.0f) : fade; \\
    fade = fade * fade * (3.0f - 2.0f * fade);
  float lower_1[3], tip_1[3], length_1 = 0.0f;  // of the nearest guide
  for (int first = 0; first < slot_count; first += LANES) {{
    const int count = slot_count - first < LANES ? slot_count - first : LANES;
    ints guides = -1;
    lanes share = 0.0f, cosine = 1.0f, sine = 0.0f;
    for (int lane = 0; lane < count; ++lane) {{
      LANE(guides, lane) = index[first + lane];
      LANE(share, lane) = before[first + lane];
      LANE(cosine, lane) = turn[2 * (first + lane)];
      LANE(sine, lane) = turn[2 * (first + lane) + 1];
    }}
    lanes row[8];
    READ_COLUMNS(row, guides, shapes.data)
    const lanes lower_x = cosine * row[0] - sine * row[1], lower_y = sine * row[0] + cosine * row[1];
    const lanes tip_x = cosine * row[3] - sine * row[4], tip_y = sine * row[3] + cosine * row[4];
    if (first == 0) {{
      lower_1[0] = LANE(lower_x, 0), lower_1[1] = LANE(lower_y, 0), lower_1[2] = LANE(row[2], 0);
      tip_1[0] = LANE(tip_x, 0), tip_1[1] = LANE(tip_y, 0), tip_1[2] = LANE(row[5], 0);
      length_1 = LANE(row[6], 0);
    }}
    const lanes lower = lower_1[0] * lower_x + lower_1[1] * lower_y + lower_1[2] * row[2];
    const lanes tip = tip_1[0] * tip_x + tip_1[1] * tip_y + tip_1[2] * row[5];
    const lanes facing = lower < tip ? lower : tip;
    const lanes apart = ABS(row[6] - length_1);
    FADE(cosine_none, per_cosine, facing, facing_fade)
    FADE(0.5f * length_limit, per_length, apart, length_fade)
    lanes left = guides >= 0 ? share * facing_fade * (1.0f - length_fade) : lanes(0.0f);
    if (first == 0) LANE(left, 0) = LANE(share, 0);
    for (int lane = 0; lane < count; ++lane) weight[first + lane] = LANE(left, lane);
  }}
  #undef FADE
  {_END}
"""


@wp.func_native(_WEIGH)
def weigh(
    strand: int,
    nearest: float,
    reach: float,
    fall_off: float,
    tangent: wp.vec3,
    bitangent: wp.vec3,
    normal: wp.vec3,
    candidates: wp.array2d[int],
    ways: wp.array2d[float],
    frames: wp.array2d[float],
    out_indices: wp.array2d[int],
    out_weights: wp.array2d[float],
    out_turns: wp.array2d[wp.vec2],
):
    """Guides, weights and turns of a strand. frames: (G, 8), the tangent and the normal of each guide."""


@wp.func_native(_LIMIT)
def limit(
    strand: int,
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    shapes: wp.array2d[float],
    cosine_none: float,
    per_cosine: float,
    length_limit: float,
    per_length: float,
    out_weights: wp.array2d[float],
):
    """Weights of a strand without what differs too much. shapes: (G, 8) of `guide_weights.shapes`."""
