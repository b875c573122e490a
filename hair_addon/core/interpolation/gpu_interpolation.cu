// SPDX-License-Identifier: GPL-3.0-or-later
//
// Strands as weighted sums of their guides (interpolation.py), LANES threads a strand.
//
// The body of `_make_strands` in gpu_interpolation.py. Parameters, for S strands of P points, K slots of guides a
// strand and G guides:
//
//   int thread                  index of the thread in the launch; 32 consecutive threads are a warp
//   array_t<vec3> roots         (S,) roots of strands [m]
//   array_t<vec3> normals       (S,) unit normals of the surface there
//   array_t<vec4> offsets       (G, rounds * ROUND) segments of guides in the frames of their roots, and their lengths
//                               [m], in the order of `_offsets_on_lanes`
//   array_t<int> indices        (S, K) guides of each strand
//   array_t<float> weights      (S, K) their weights, zero in unused slots
//   array_t<vec2> turns         (S, K) cosine and sine of the turn from a guide's frame to the strand's
//   float keep_length           0 to 1: how far segments are stretched to the mean length of the guides' segments
//   array_t<vec3> out_points    (S, P) [m]
//
// Constants:
//
//   LANES, SEGMENTS             threads of a strand, and segments that each makes in a round
//   ROUND                       LANES * SEGMENTS: longer strands take several rounds
//   STRANDS, BATCHES            strands that a warp makes at once, and how many times it does
//   BLOCK_SIZE                  threads of a block
//   STRETCH_LIMIT               largest factor of a stretched segment
//   SQUARE_LIMIT, LENGTH_LIMIT  squared lengths [m²] and lengths [m] above which a segment is not stretched

#if defined(__CUDA_ARCH__)
  // What a batch of strands reads, brought into shared memory while the batch before it is summed up.
  struct Inputs {
    float2 turns[32];
    float shares[32];
    int guides[32];
    float places[STRANDS][8];  // root and normal
  };
  struct WarpMemory {
    float points[STRANDS * 3 * (ROUND + 1)];  // finished strands, on their way to global memory
    Inputs inputs[2];                         // of this batch and of the next
  };
  __shared__ __align__(16) WarpMemory warp_memory[BLOCK_SIZE / 32];
  const unsigned everyone = 0xffffffffu;
  const int slot_count = indices.shape[1];
  const int round_count = max(1, (out_points.shape[1] + ROUND - 2) / ROUND);
  int first = thread / 32 * (STRANDS * BATCHES);
  const int end = min(first + STRANDS * BATCHES, out_points.shape[0]);

  // Copies from global to shared memory, around the registers where the GPU can. `copy` returns at once, `wait` when
  // all copies of the warp have arrived.
  auto copy = [](auto* to, const auto* from) {
    #if __CUDA_ARCH__ >= 800
      const unsigned place = static_cast<unsigned>(__cvta_generic_to_shared(to));
      asm volatile("cp.async.ca.shared.global [%0], [%1], %2;" :: "r"(place), "l"(from), "n"(sizeof(*to)) : "memory");
    #else
      *to = *from;
    #endif
  };
  auto wait = [] {
    #if __CUDA_ARCH__ >= 800
      asm volatile("cp.async.wait_all;" ::: "memory");
    #endif
    __syncwarp();
  };
  // Each lane copies one slot. Lanes of strands past the end work on the last strand again: shuffles need all of them.
  auto copy_slots = [&](Inputs& inputs, int strands, int slots) {
    const int self = threadIdx.x % 32;
    const int slot = slots + self % LANES;
    if (slot < slot_count) {
      const size_t place = size_t(min(strands + self / LANES, end - 1)) * slot_count + slot;
      copy(inputs.shares + self, weights.data + place);
      copy(inputs.guides + self, indices.data + place);
      copy(inputs.turns + self, reinterpret_cast<const float2*>(turns.data) + place);
    } else {
      inputs.shares[self] = 0.0f;
    }
  };
  auto copy_inputs = [&](Inputs& inputs, int strands) {
    copy_slots(inputs, strands, 0);
    const int team = threadIdx.x % 32 / LANES;
    const int number = threadIdx.x % LANES;
    const int strand = min(strands + team, end - 1);
    const float* place = reinterpret_cast<const float*>((number < 3 ? roots.data : normals.data) + strand);
    if (number < 6) copy(inputs.places[team] + number, place + number % 3);
  };

  if (first < end) copy_inputs(warp_memory[threadIdx.x / 32].inputs[0], first);
  for (int batch = 0; first < end; first += STRANDS, ++batch) {
    wait();
    Inputs& inputs = warp_memory[threadIdx.x / 32].inputs[batch % 2];
    if (first + STRANDS < end) copy_inputs(warp_memory[threadIdx.x / 32].inputs[(batch + 1) % 2], first + STRANDS);
    for (int round = 0; round < round_count; ++round) {
      // Weighted sums over the guides, in the strand's frame.
      float x[SEGMENTS] = {}, y[SEGMENTS] = {}, z[SEGMENTS] = {}, length[SEGMENTS] = {};
      for (int slots = 0; slots < slot_count; slots += LANES) {
        if (slot_count > LANES && round + slots > 0) {
          __syncwarp();
          copy_slots(inputs, first, slots);
          wait();
        }
        const int own = threadIdx.x % 32 / LANES * LANES;
        #pragma unroll 1
        for (int slot = own; slot < own + LANES; ++slot) {
          const float share = inputs.shares[slot];
          if (share > 0.0f) {
            const float4* its_offsets = reinterpret_cast<const float4*>(offsets.data)
              + (inputs.guides[slot] * round_count + round) * ROUND + threadIdx.x % LANES;
            const float cosine = share * inputs.turns[slot].x;
            const float sine = share * inputs.turns[slot].y;
            #pragma unroll
            for (int part = 0; part < SEGMENTS; ++part) {
              const float4 offset = __ldg(its_offsets + part * LANES);
              x[part] = fmaf(cosine, offset.x, fmaf(-sine, offset.y, x[part]));
              y[part] = fmaf(sine, offset.x, fmaf(cosine, offset.y, y[part]));
              z[part] = fmaf(share, offset.z, z[part]);
              length[part] = fmaf(share, offset.w, length[part]);
            }
          }
        }
      }
      __syncwarp();
      // Keeps the compiler from computing what follows before the sums, which need the registers.
      int self = threadIdx.x;
      int point_count = out_points.shape[1];
      asm volatile("" : "+r"(self), "+r"(point_count));
      const int lane = self % LANES;
      const int team = self % 32 / LANES;
      float* place = inputs.places[team];
      // The strand's frame, as `frame` of guide_weights.py.
      const float normal_x = place[3], normal_y = place[4], normal_z = place[5];
      const float sign = normal_z >= 0.0f ? 1.0f : -1.0f;
      const float a = __fdividef(-1.0f, sign + normal_z);
      const float b = normal_x * normal_y * a;
      const float tangent_x = 1.0f + sign * normal_x * normal_x * a, tangent_y = sign * b, tangent_z = -sign * normal_x;
      const float bitangent_x = b, bitangent_y = sign + normal_y * normal_y * a, bitangent_z = -normal_y;
      // Segments are stretched, turned out of the frame, and added up within the lane.
      float sum_x = 0.0f, sum_y = 0.0f, sum_z = 0.0f;
      #pragma unroll
      for (int part = 0; part < SEGMENTS; ++part) {
        const float square = x[part] * x[part] + y[part] * y[part] + z[part] * z[part];
        const float wanted = fminf(length[part] * rsqrtf(square), STRETCH_LIMIT);
        const bool is_float = square < SQUARE_LIMIT && length[part] < LENGTH_LIMIT;
        const float stretch = is_float ? fmaf(keep_length, wanted - 1.0f, 1.0f) : 1.0f;
        const float along_x = tangent_x * x[part] + bitangent_x * y[part] + normal_x * z[part];
        const float along_y = tangent_y * x[part] + bitangent_y * y[part] + normal_y * z[part];
        const float along_z = tangent_z * x[part] + bitangent_z * y[part] + normal_z * z[part];
        x[part] = sum_x = fmaf(stretch, along_x, sum_x);
        y[part] = sum_y = fmaf(stretch, along_y, sum_y);
        z[part] = sum_z = fmaf(stretch, along_z, sum_z);
      }
      // Sum over the lanes before each lane: a shift by one, then an inclusive scan [Harris07].
      sum_x = __shfl_up_sync(everyone, sum_x, 1, LANES);
      sum_y = __shfl_up_sync(everyone, sum_y, 1, LANES);
      sum_z = __shfl_up_sync(everyone, sum_z, 1, LANES);
      if (lane == 0) sum_x = sum_y = sum_z = 0.0f;
      #pragma unroll
      for (int step = 1; step < LANES; step *= 2) {
        const float before_x = __shfl_up_sync(everyone, sum_x, step, LANES);
        const float before_y = __shfl_up_sync(everyone, sum_y, step, LANES);
        const float before_z = __shfl_up_sync(everyone, sum_z, step, LANES);
        if (lane >= step) {
          sum_x += before_x;
          sum_y += before_y;
          sum_z += before_z;
        }
      }
      #if __CUDA_ARCH__ >= 900
        // The bulk copy of the batch before must have read `points`.
        if (self % 32 == 0) asm volatile("cp.async.bulk.wait_group.read 0;" ::: "memory");
        __syncwarp();
      #endif
      // Strands of one round lie in shared memory as they will in global memory, longer ones a round at a time.
      const bool is_whole = point_count <= ROUND + 1;
      float* points = warp_memory[self / 32].points;
      float* row = points + team * 3 * (is_whole ? point_count : ROUND + 1);
      const float from_x = place[0], from_y = place[1], from_z = place[2];
      if (lane == 0) {
        row[0] = from_x;
        row[1] = from_y;
        row[2] = from_z;
      }
      sum_x += from_x;
      sum_y += from_y;
      sum_z += from_z;
      const int before = lane * SEGMENTS;
      #pragma unroll
      for (int part = 0; part < SEGMENTS; ++part) {
        x[part] += sum_x;
        y[part] += sum_y;
        z[part] += sum_z;
        if (round * ROUND + before + part + 1 < point_count) {
          row[3 * (before + part + 1)] = x[part];
          row[3 * (before + part + 1) + 1] = y[part];
          row[3 * (before + part + 1) + 2] = z[part];
        }
      }
      const int strand_count = min(STRANDS, end - first);
      float* to = reinterpret_cast<float*>(out_points.data) + size_t(first) * point_count * 3;
      if (is_whole) {
        const int number_count = strand_count * point_count * 3;
        #if __CUDA_ARCH__ >= 900
          if (number_count % 4 == 0 && reinterpret_cast<size_t>(to) % 16 == 0) {
            // One bulk copy that runs while the next batch is summed up.
            asm volatile("fence.proxy.async.shared::cta;" ::: "memory");
            __syncwarp();
            if (self % 32 == 0) {
              const unsigned from = static_cast<unsigned>(__cvta_generic_to_shared(points));
              asm volatile("cp.async.bulk.global.shared::cta.bulk_group [%0], [%1], %2;"
                :: "l"(to), "r"(from), "r"(4 * number_count) : "memory");
              asm volatile("cp.async.bulk.commit_group;" ::: "memory");
            }
            continue;
          }
        #endif
        __syncwarp();
        for (int number = self % 32; number < number_count; number += 32) to[number] = points[number];
      } else {
        __syncwarp();
        // The next round starts where this one ends.
        if (lane == LANES - 1) {
          place[0] = x[SEGMENTS - 1];
          place[1] = y[SEGMENTS - 1];
          place[2] = z[SEGMENTS - 1];
        }
        const int begin = round == 0 ? 0 : 3;
        const int number_count = 3 * min(ROUND + 1, point_count - round * ROUND);
        for (int strand = 0; strand < strand_count; ++strand) {
          float* its = to + (size_t(strand) * point_count + round * ROUND) * 3;
          for (int number = begin + self % 32; number < number_count; number += 32) {
            its[number] = points[strand * (3 * (ROUND + 1)) + number];
          }
        }
      }
      __syncwarp();
    }
  }
  #if __CUDA_ARCH__ >= 900
    // Shared memory must outlive the last bulk copy.
    asm volatile("cp.async.bulk.wait_group.read 0;" ::: "memory");
  #endif
#endif
