// SPDX-License-Identifier: GPL-3.0-or-later
// Translated from core/shading/light_paths/light_sources.py by tools/translate_kernels.py.

// Attenuation of a spot light at an angle: one inside, zero outside the cone, smooth over the fraction `blend`, in
// cosines, from the cone to the axis.
float spot_falloff(float cosine_, float cos_cone_, float blend_)
{
  float inner_ = cos_cone_ + (1.0 - cos_cone_) * clamp(blend_, 1e-04, 1.0);
  float part_ = clamp((cosine_ - cos_cone_) / max(inner_ - cos_cone_, 1e-06), 0.0, 1.0);
  return part_ * part_ * (3.0 - 2.0 * part_);
}

// Radiance of an area light towards an angle, relative to a light without spread: linear in the tangent, zero
// outside the cone, with the same total power. cos_cone: of half the spread, 0 for the half sphere.
float area_falloff(float cosine_, float cos_cone_)
{
  float squared_;
  if (cos_cone_ < 0.001) {
    return 1.0;
  }
  float tan_cone_ = sqrt((1.0 - cos_cone_) * (1.0 + cos_cone_)) / cos_cone_;
  float tan_angle_ = sqrt(max(0.0, (1.0 - cosine_) * (1.0 + cosine_))) / max(cosine_, 1e-06);
  float excess_ = tan_cone_ - atan(tan_cone_);
  if (tan_cone_ < 0.2) {
    squared_ = tan_cone_ * tan_cone_;
    excess_ = tan_cone_ * squared_ * (1.0 / 3.0 - squared_ * (1.0 / 5.0 - squared_ / 7.0));
  }
  return max(0.0, tan_cone_ - tan_angle_) / max(excess_, 1e-12);
}
