// SPDX-License-Identifier: GPL-3.0-or-later
// A Warp kernel as a compute program: `run_kernel` is translated from Python by core/kernels/glsl_text.py.

#include "kernels/kernel_language.glsl"
#include "kernels/mesh_query.glsl"
#include "kernel_text.glsl"

void main()
{
  if (thread_index() < given.thread_count) {
    run_kernel();
  }
}
