// SPDX-License-Identifier: GPL-3.0-or-later
// Light among strands, measured by paths through a grid: needs the sampler light_grid, of `light_texels.packed`.

bool has_light_grid()
{
  return lights.grid_scale.x > 0.0;
}

// Without nodes the texture ends with the voxels.
bool has_nodes()
{
  return float(textureSize(light_grid, 0).z) > lights.grid_scale.w;
}

// From the nodes of a strand: RGB, light as below; alpha, the fraction of the light of voxels to add.
vec4 light_of_nodes(int strand, float position)
{
  ivec3 size = textureSize(light_grid, 0);
  int nodes = int(texelFetch(light_grid, size - 1, 0).r);
  int in_row = size.x / nodes;
  int in_layer = in_row * size.y;
  int layer = strand / in_layer;
  int rest = strand - layer * in_layer;
  int row = rest / in_row;
  float node = clamp(position * float(nodes), 0.5, float(nodes) - 0.5);
  float x = float((rest - row * in_row) * nodes) + node;
  vec3 texel = vec3(x, float(row) + 0.5, lights.grid_scale.w + float(layer) + 0.5);
  return textureLod(light_grid, texel / vec3(size), 0.0);
}

// For visible strands around a position: RGB, the uniform radiance to which they would respond alike; alpha, the fraction of
// light by dual scattering to add.
vec4 light_among_strands(vec3 position, int strand, float along, bool with_nodes)
{
  float layers = lights.grid_scale.w;
  float depth = float(textureSize(light_grid, 0).z);
  vec3 at = (position - lights.grid_corner.xyz) * lights.grid_scale.xyz;
  at.z = clamp(at.z * layers, 0.5, layers - 0.5) / depth;
  vec4 measured = textureLod(light_grid, at, 0.0);
  if (with_nodes && has_nodes()) {
    vec4 of_nodes = light_of_nodes(strand, along);
    measured = vec4(of_nodes.rgb, 0.0) + of_nodes.a * measured;
  }
  return mix(vec4(0.0, 0.0, 0.0, 1.0), measured, lights.grid_corner.w);
}
