// SPDX-License-Identifier: GPL-3.0-or-later
// The value of a sample in a pass of data, as Cycles defines it (kernel/film/data_passes.h, kernel/film/denoising_passes.h):
// needs the block data. Alpha is one in samples with a surface or hair.

// What passes show of a sample. Colors are linear.
struct SampleData {
  vec3 position;  // in the world
  vec3 N;  // on the viewer's side
  vec3 diffuse;  // color of diffuse reflection
  vec3 albedo;  // color of all rough reflection
  vec2 uv;
};

// Indices of `data_passes.KINDS`.
const int POSITION = 0;
const int MIST = 1;
const int NORMAL = 2;
const int DIFFUSE_COLOR = 3;
const int DENOISING_NORMAL = 4;
const int DENOISING_ALBEDO = 5;
const int UV = 6;

// The fraction of light that mist lets through.
float clear_of_mist(vec3 position)
{
  vec3 away = position - data.camera.xyz;
  float reach = (view.is_perspective != 0) ? length(away) : abs(dot(away, data.view_rows[2].xyz));
  return 1.0 - pow(clamp((reach - data.mist.x) * data.mist.y, 0.0, 1.0), data.mist.z);
}

vec4 data_value(SampleData found)
{
  vec3 value = found.position;
  if (data.kind == MIST) {
    value = vec3(clear_of_mist(found.position));
  }
  else if (data.kind == NORMAL) {
    value = found.N;
  }
  else if (data.kind == DIFFUSE_COLOR) {
    value = found.diffuse;
  }
  else if (data.kind == DENOISING_NORMAL) {
    // In the camera's axes, with depth along +Z.
    float depth = -dot(data.view_rows[2].xyz, found.N);
    value = vec3(dot(data.view_rows[0].xyz, found.N), dot(data.view_rows[1].xyz, found.N), depth);
  }
  else if (data.kind == DENOISING_ALBEDO) {
    value = found.albedo;
  }
  else if (data.kind == UV) {
    value = (data.has_uvs != 0) ? vec3(found.uv, 1.0) : vec3(0.0);
  }
  return vec4(value, 1.0);
}
