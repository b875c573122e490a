// SPDX-License-Identifier: GPL-3.0-or-later
//
// Substeps of LANES strands at once: in the lanes of vectors on a CPU, one strand per thread on a GPU.
//
// The body of `advance_block` in rod_solver.py. An array (groups, rows, STRIDE) has a row for each number of a strand,
// with this number of STRIDE strands. There are M segments and M + 1 points; the surface determines point 0 and the
// frame before segment 0.
//
//   int block                              a group of strands on a CPU, a strand on a GPU
//   int stages                             parts of a substep: PREDICT, SOLVE, AGAIN, FINISH
//   int first, end                         substeps first … end - 1
//   Numbers step                           common to all strands:
//     first, end, count                    substeps of the launch, number of substeps in a frame
//     pinned                               points from the root that follow the surface beside point 0; M without SOLVE
//     h                                    a substep [s]
//     carried                              (h / h of the previous substep)²
//     gravity                              [m/s²]
//     damping_time                         Kelvin-Voigt time τ of bending and twisting [s]
//     twist_ratio                          compliance of twisting / compliance of bending
//     hold, hold_tip                       pull to the groom [1/s²], and its fraction at the tip
//     most_stretch                         length / rest length of a segment at which a strand is reset
//   RodArrays strands                      arrays of strands:
//     positions, velocities                3 (M + 1) rows [m], [m/s]
//     frames, spins                        4 M, 3 M rows: unit quaternions; angular velocities [1/s]
//     multipliers                          6 M rows λ_b, λ_s
//     slips                                M + 1 rows: sliding distance in the last substep [m], -1 without contact
//     lengths                              M rows [m]
//     rests                                4 M rows: half of the rest rotation of a joint
//     bend_compliances, stretch_compliances    M rows each, in the unit of mass of the inverse masses
//     inverse_masses                       M + 1 rows
//     inertias                             M rows
//     grooms, groom_frames                 3 (M + 1), 4 M rows: the groom in the root's frame
//     pins                                 1 row: points from the root that follow the surface, if more than `pinned`
//     responses                            2 rows: damping time and hold of the strand; below zero: those of the step
//     drag_rates                           3 rows: the rate of drag of slow air [1/s]; by v [1/m], by ∛v [1/s ∛(s/m)]
//     roots                                14 rows: position, frame at the frame's start; position, frame at its end
//     positions_before, predictions        3 (M + 1) rows each: between stages
//     frames_before, mobilities            4 M, M + 1 rows: between stages
//     resets                               1 row
//     solved_again                         1 row: 1 if AGAIN has moved the strand
//   Around around                          arrays of points, each may be empty:
//     planes                               8 (M + 1) rows: n, offset, displacement, friction of each point
//     found_planes                         8 (M + 1) rows: planes after the solve, for AGAIN and FINISH; empty: planes
//     airs, drags, accelerations           3, 1, 3 rows per point: [m/s], factor, [m/s²]
//   array_t<float> scratches               on a GPU: KEPT M + CONTACT (M + 1) rows
//
// The first stride of an array separates groups; it is zero if groups reuse the same memory in turn.
//
// Constants: WIDTH, GROUP, MOST segments, and those documented in rod_solver.py.

{
// On a GPU, loops over small matrices are unrolled: indices unknown at compile time would put these in memory.
#if defined(__CUDA_ARCH__)
#define UNROLLED _Pragma("unroll")
#else
#define UNROLLED
#endif
#include "lanes.h"
#include "vectors.h"
#include "rod_rotations.h"

constexpr int PREDICT = 1, SOLVE = 2, FINISH = 4, AGAIN = 8;
// Rows of a segment between factorisation and back substitution, and of a point between contact passes.
constexpr int LOWER = 0, UPPER = 21, RIGHT = 48, GRADIENT = 54, TURNING = 63, KEPT = 64;
constexpr int CONTACT = 8;  // n, a, predicted point, remaining mobility along n

#if defined(__CUDA_ARCH__)
constexpr int STRIDE = GROUP;
const int group = block / GROUP, lane = block % GROUP;
const auto get = [](const float* rows, int row) { return rows[size_t(row) * STRIDE]; };
const auto put = [](float* rows, int row, lanes value) { rows[size_t(row) * STRIDE] = value; };
// Prefetches rows that are read soon: with a strand per thread, a GPU has little other work to hide the latency.
const auto fetch = [](const float* rows, int first, int count) {
  for (int row = first; row < first + count; ++row) {
    asm volatile("prefetch.global.L1 [%0];" ::"l"(rows + size_t(row) * STRIDE));
  }
};
#else
constexpr int STRIDE = WIDTH;
const int group = block, lane = 0;
typedef float lanes_anywhere __attribute__((ext_vector_type(WIDTH), aligned(4)));
const auto get = [](const float* rows, int row) -> lanes {
  return *reinterpret_cast<const lanes_anywhere*>(rows + size_t(row) * STRIDE);
};
const auto put = [](float* rows, int row, lanes value) {
  *reinterpret_cast<lanes_anywhere*>(rows + size_t(row) * STRIDE) = value;
};
const auto fetch = [](const float*, int, int) {};
#endif
const auto get_vector = [&](const float* rows, int i) {
  return vector{get(rows, 3 * i), get(rows, 3 * i + 1), get(rows, 3 * i + 2)};
};
const auto put_vector = [&](float* rows, int i, const vector& value) {
  put(rows, 3 * i, value.x);
  put(rows, 3 * i + 1, value.y);
  put(rows, 3 * i + 2, value.z);
};
const auto get_frame = [&](const float* rows, int j) {
  return quaternion{get(rows, 4 * j), get(rows, 4 * j + 1), get(rows, 4 * j + 2), get(rows, 4 * j + 3)};
};
const auto put_frame = [&](float* rows, int j, const quaternion& value) {
  put(rows, 4 * j, value.x);
  put(rows, 4 * j + 1, value.y);
  put(rows, 4 * j + 2, value.z);
  put(rows, 4 * j + 3, value.w);
};
// Cube root of a non-negative number, by Halley's method.
const auto cube_root = [&](lanes value) {
  const lanes a = higher_of(value, lanes(1.0e-9f));
  lanes root = lanes_of_bits(to_ints(to_lanes(bits_of_lanes(a)) * (1.0f / 3.0f)) + 0x2a514067);
  for (int k = 0; k < 2; ++k) {
    const lanes cube = root * root * root;
    root *= (cube + 2.0f * a) / (2.0f * cube + a);
  }
  return root;
};

const auto rows_of = [&](const auto& array) {
  return array.data + size_t(group) * (array.strides[0] / sizeof(float)) + lane;
};
const int segment_count = strands.lengths.shape[1];
const int count = step.count, pinned = step.pinned;
const float h = step.h, twist_ratio = step.twist_ratio, hold_tip = step.hold_tip;
const float most_stretch = step.most_stretch;
const wp::vec3 gravity = step.gravity;
float *const x = rows_of(strands.positions), *const v = rows_of(strands.velocities);
float *const q = rows_of(strands.frames), *const spin = rows_of(strands.spins);
float *const lambda = rows_of(strands.multipliers), *const slip = rows_of(strands.slips);
const float *const length = rows_of(strands.lengths), *const rest = rows_of(strands.rests);
const float* const bending = rows_of(strands.bend_compliances);
const float* const stretching = rows_of(strands.stretch_compliances);
const float *const inverse_mass = rows_of(strands.inverse_masses), *const inertia = rows_of(strands.inertias);
const float *const groom = rows_of(strands.grooms), *const groom_frame = rows_of(strands.groom_frames);
float *const x_before = rows_of(strands.positions_before), *const q_before = rows_of(strands.frames_before);
float* const predicted_rows = rows_of(strands.predictions);
float *const mobility = rows_of(strands.mobilities), *const resets = rows_of(strands.resets);
const lanes pins = get(rows_of(strands.pins), 0);
const float* const response = rows_of(strands.responses);
// A number of the strand's response, or that of the step.
const auto response_of = [&](int row, float shared) {
  const lanes own = get(response, row);
  return own < 0.0f ? lanes(shared) : own;
};
const lanes damping_time = response_of(0, step.damping_time), hold = response_of(1, step.hold);
const bool has_hold = any_of(hold > 0.0f);
const auto is_free = [&](int i) { return pins < lanes(static_cast<float>(i)); };  // of a point after `pinned`
float* const again = rows_of(strands.solved_again);
const float *const root_rows = rows_of(strands.roots), *const found_rows = rows_of(around.found_planes);
float* const plane_rows = rows_of(around.planes);
const float *const air_rows = rows_of(around.airs), *const drag_rows = rows_of(around.drags);
const float *const acceleration_rows = rows_of(around.accelerations);
const bool has_planes = around.planes.shape[0] > 0;
const bool has_air = around.airs.shape[0] > 0, has_drag = around.drags.shape[0] > 0;
const bool has_acceleration = around.accelerations.shape[0] > 0;
const float* const drag_rate = rows_of(strands.drag_rates);
const lanes slow_drag = get(drag_rate, 0), drag_square = get(drag_rate, 1), drag_root = get(drag_rate, 2);

#if defined(__CUDA_ARCH__)
float* const scratch = rows_of(scratches);
float* const contacts = scratch + size_t(KEPT * segment_count) * STRIDE;
#else
alignas(64) float scratch[MOST * KEPT * WIDTH];
alignas(64) float contacts[(MOST + 1) * CONTACT * WIDTH];
#endif
const auto kept = [&](int j, int row) { return scratch + size_t(KEPT * j + row) * STRIDE; };
const auto contact = [&](int i) { return contacts + size_t(CONTACT * i) * STRIDE; };

// Remaining mobility along the contact normal of point i. It is larger for rods that are stiff relative to a substep:
// contradictory planes would bend them with such force that Newton's method diverges. The stiffness κ = h² / (b m l²)
// grows with l⁻⁴: points of short hair are 10⁶ times as stiff as those of long hair.
const auto away_of = [&](int i) {
  const lanes size = get(length, i - 1);
  const lanes stiffness = (h * h) * get(inverse_mass, i) / (get(bending, i - 1) * size * size);
  return AWAY * clamped(exact_sqrt_of(stiffness * (1.0f / STIFF)), lanes(1.0f), lanes(MOST_AWAY / AWAY));
};
const float inverse_square = 1.0f / (h * h);
const lanes damping = damping_time / h, inverse_damping = 1.0f / (1.0f + damping);
const lanes damped = 2.0f * (1.0f + damping), undamped = -2.0f * damping;
const lanes damped_inertia = LEAST_INERTIA * h * h * (1.0f + damping);
for (int substep = first; substep < end; ++substep) {
  // The root between the frame's two poses: positions linear, rotations by nlerp.
  const float part = static_cast<float>(substep + 1) / static_cast<float>(count);
  const float part_before = static_cast<float>(substep) / static_cast<float>(count);
  const auto root_at = [&](float at) {
    const vector from = get_vector(root_rows, 0), to = get_vector(root_rows + 7 * STRIDE, 0);
    return at == 1.0f ? to : from + (to - from) * lanes(at);
  };
  const auto root_frame_at = [&](float at) {
    return between(get_frame(root_rows + 3 * STRIDE, 0), get_frame(root_rows + 10 * STRIDE, 0), at);
  };
  const vector root = root_at(part), root_before = root_at(part_before);
  const quaternion root_frame = root_frame_at(part), frame_before = root_frame_at(part_before);
  const float from_last = substep == step.first ? step.carried : 1.0f;

  if (stages & PREDICT) {
#include "rod_predict.h"
  }
#include "rod_repair.h"
  if (stages & (SOLVE | AGAIN)) {
    const bool is_again = stages & AGAIN;
#include "rod_newton.h"
#include "rod_contact.h"
    // Lanes with any plane; for AGAIN, lanes with a point inside a plane that was found after the solve.
    ints touches = 0;
    for (int i = pinned + 1; has_planes && i <= segment_count; ++i) {
      float* plane = plane_rows + size_t(8 * i) * STRIDE;
      if (!is_again) {
        const vector n = get_vector(plane, 0);
        touches = touches | (is_free(i) & (dot(n, n) > 0.5f));
        continue;
      }
      const float* found = found_rows + size_t(8 * i) * STRIDE;
      const lanes inside = get(found, 3) - dot(get_vector(found, 0), get_vector(x, i));
      const ints is_inside = is_free(i) & (inside > INSIDE * get(length, i - 1));
      if (!any_of(is_inside)) continue;
      touches = touches | is_inside;
      for (int k = 0; k < 8; ++k) put(plane, k, is_inside ? get(found, k) : get(plane, k));
    }
    const bool is_touching = any_of(touches);
    if (is_touching) {
      for (int i = 0; i <= segment_count; ++i) {
        for (int k = 0; k < 3; ++k) put(contact(i), k, lanes(0.0f));
        put(contact(i), 3, lanes(1.0f));
        if (!is_again) put_vector(predicted_rows, i, get_vector(x, i));
        put_vector(contact(i) + 4 * STRIDE, 0, get_vector(predicted_rows, i));
        put(contact(i), 7, i > 0 ? away_of(i) : lanes(AWAY));
      }
      put_contacts(!is_again, is_again ? 1.0f : from_last, touches);
    }
    ints asked = is_again ? touches : ints(-1);
    for (int pass = 0; pass < PASSES && any_of(asked); ++pass) {
      ints stepping = asked;
      for (int step = 0; step < STEPS && any_of(stepping); ++step) {
        const bool is_first = pass == 0 && step == 0 && !is_again;
        const lanes turn = newton_step(is_first, is_first ? from_last : 1.0f, stepping, is_touching);
        stepping = stepping & (turn >= TURN);
      }
      if (!is_touching || pass + 1 == PASSES) break;
      asked = changed_contacts(asked & touches);
      if (any_of(asked)) put_contacts(false, 1.0f, asked);
    }
    if (is_again && is_touching) bound_lengths(repair(touches, plane_rows, plane_rows));
    if (is_again) put(again, 0, touches ? lanes(1.0f) : lanes(0.0f));
    for (int i = 0; i <= segment_count && (is_touching || !is_again); ++i) {
      lanes slid = is_again ? get(slip, i) : lanes(-1.0f);
      if (is_touching && i > pinned) {
        const vector n = get_vector(contact(i), 0);
        const vector slide = get_vector(plane_rows + (size_t(8 * i) + 4) * STRIDE, 0);
        const vector moved = get_vector(x, i) - get_vector(x_before, i) - slide;
        const vector along = moved - n * dot(n, moved);
        const lanes now = dot(n, n) > 0.5f ? exact_sqrt_of(dot(along, along)) : lanes(-1.0f);
        slid = is_again ? (touches ? now : slid) : now;
      }
      put(slip, i, slid);
    }
  }
  if (stages & FINISH) {
#include "rod_finish.h"
  }
}
#undef UNROLLED
}
