// SPDX-License-Identifier: GPL-3.0-or-later
// Absorption that varies between and along strands. Variation: `strand_variation.Settings`.

// Factor of pigment by a strand's random number, as Cycles varies melanin.
float pigment_factor(float melanin, float random_color, float random)
{
  float factor = 1.0 + 2.0 * (random - 0.5) * random_color;
  // Concentration is proportional to small amounts of melanin, where the logarithm loses precision.
  return (melanin < 1e-4) ? factor : log(max(1.0 - melanin * factor, 1e-4)) / log(max(1.0 - melanin, 1e-4));
}

// Fraction of the tip's color at a position from root 0 to tip 1.
float tip_gradient(float start, float end, float position)
{
  float x = clamp((position - start) / max(end - start, 1e-4), 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

// sigma_a with the fraction `gradient` of the tip's color.
vec3 sigma_a_along(Variation hair, float random, float gradient)
{
  vec3 at_root = pigment_factor(hair.melanin, hair.random_color, random) * hair.pigment + hair.dye;
  return at_root * (1.0 + (hair.tip_absorption - 1.0) * gradient) + gradient * hair.tip_dye;
}
