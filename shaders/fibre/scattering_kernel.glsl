// SPDX-License-Identifier: GPL-3.0-or-later
// Translated from core/shading/fibre/scattering_kernel.py by tools/translate_kernels.py.

// Return `principled.deviation_from_roughness`.
float deviation_from_roughness(float roughness_)
{
  float wide_ = 0.726 + 0.812 * roughness_;
  return roughness_ * wide_ + 3.7 * pow(roughness_, 20.0);
}

// Return `principled.variance_from_roughness`.
float variance_from_roughness(float roughness_)
{
  float deviation_ = deviation_from_roughness(roughness_);
  return max(deviation_ * deviation_, 1e-04);
}

// Return (shift, variance) of a lobe: `energy_conserving.lobes`; tilt_trt: shift of TRT per tilt.
void lobe_of(int path_, float tilt_, float tilt_trt_, float roughness_, float coat_, out float returned_0, out float returned_1)
{
  float v_ = variance_from_roughness(roughness_);
  if (path_ == 0) {
    returned_0 = (-2.0) * tilt_;
    returned_1 = variance_from_roughness((1.0 - coat_) * roughness_);
    return;
  }
  if (path_ == 1) {
    returned_0 = tilt_;
    returned_1 = max(0.25 * v_, 1e-04);
    return;
  }
  if (path_ == 2) {
    returned_0 = tilt_trt_ * tilt_;
    returned_1 = 4.0 * v_;
    return;
  }
  returned_0 = 0.0;
  returned_1 = 4.0 * v_;
  return;
}

// Return exp(-x) I0(x) for x >= 0 [Abramowitz64, 9.8.1-2].
float i0e(float x_)
{
  float square_;
  float near_;
  float t_ = x_ / 3.75;
  if (t_ <= 1.0) {
    square_ = t_ * t_;
    near_ = 0.0045813;
    near_ = near_ * square_ + 0.0360768;
    near_ = near_ * square_ + 0.2659732;
    near_ = near_ * square_ + 1.2067492;
    near_ = near_ * square_ + 3.0899425;
    near_ = near_ * square_ + 3.5156229;
    near_ = near_ * square_ + 1.0;
    return exp(-x_) * near_;
  }
  float inverse_ = 1.0 / t_;
  float far_ = 0.00392377;
  far_ = far_ * inverse_ + -0.01647633;
  far_ = far_ * inverse_ + 0.02635537;
  far_ = far_ * inverse_ + -0.02057706;
  far_ = far_ * inverse_ + 0.00916281;
  far_ = far_ * inverse_ + -0.00157565;
  far_ = far_ * inverse_ + 0.00225319;
  far_ = far_ * inverse_ + 0.01328592;
  far_ = far_ * inverse_ + 0.3989423;
  return far_ / sqrt(x_);
}

// Return M_v of [DEon11]; v: variance in theta_i + theta_o.
float d_eon_lobe(float sin_i_, float cos_i_, float sin_o_, float cos_o_, float v_)
{
  float along_ = sin_i_ + sin_o_;
  float across_ = cos_i_ - cos_o_;
  float beside_cone_ = (-0.5) * (along_ * along_ + across_ * across_);
  float normalization_ = v_ * (1.0 - exp((-2.0) / v_));
  return i0e(cos_i_ * cos_o_ / v_) * exp(beside_cone_ / v_) / normalization_;
}

// Return `d_eon_lobe` with the view's inclination shifted back.
float shifted_lobe(float sin_i_, float cos_i_, float sin_o_, float cos_o_, float shift_, float v_)
{
  float sin_turned_ = sin_o_ * cos(shift_) - cos_o_ * sin(shift_);
  float cos_turned_ = abs(cos_o_ * cos(shift_) + sin_o_ * sin(shift_));
  return d_eon_lobe(sin_i_, cos_i_, sin_turned_, cos_turned_, v_);
}

// Return `marschner.gaussian`.
float gaussian(float x_, float sigma_)
{
  return exp((-0.5) * x_ * x_ / (sigma_ * sigma_)) / (sigma_ * 2.5066283);
}
