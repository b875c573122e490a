// SPDX-License-Identifier: GPL-3.0-or-later
//
// The body of `least_distance` in distance_grid.py: for one point, on CPU and GPU. Parameters:
//
//   DistanceGrid grid
//   vec3 point

{
#include "lanes.h"
#include "distance_grid.h"

return get_lane(least_distance(grid, grid.distances.data, lanes(point[0]), lanes(point[1]), lanes(point[2])), 0);
}
