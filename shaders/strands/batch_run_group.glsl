// SPDX-License-Identifier: GPL-3.0-or-later
// Index of a work group among those of its hair object, which is chosen for the thread. The groups of an object follow those
// of the object before it.

int first_group(int row)
{
  vec4 lower = object_texel(row, GROUP_TEXEL);
  vec3 upper = vec3(object_texel(row, RUN_TEXEL).zw, lower.w);
  return whole_number(vec2(upper[walked_part], lower[walked_part]));
}

int group_in_object(int group)
{
  int low = 0;
  int high = object_count - 1;
  while (low < high) {
    int middle = (low + high + 1) / 2;
    if (first_group(middle) <= group) {
      low = middle;
    }
    else {
      high = middle - 1;
    }
  }
  choose_object(low);
  return group - first_group(low);
}
