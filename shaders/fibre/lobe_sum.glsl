// SPDX-License-Identifier: GPL-3.0-or-later
// Sum of the lobes of the energy-conserving model [DEon11] [Chiang16].

#include "fibre/light_highlight.glsl"

// N of a fiber at one azimuth and inclination.
struct FibreLobes {
  vec4 n;  // N_TT red, green, blue, N_R
  vec3 n_trt;
  vec3 n_res;
};

// Sum of M_p N_p from M_R, M_TT, M_TRT and M of the residual. The cosine of theta_i is in M.
vec3 lobe_sum(vec4 m, FibreLobes lobes)
{
  return m.x * vec3(lobes.n.a) * light_highlight + m.y * lobes.n.rgb + m.z * lobes.n_trt + m.w * lobes.n_res;
}
