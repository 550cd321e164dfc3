// Points that are one return, written more than once: on one ray, as good as equally far.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "kd_tree.hpp"

namespace derain {

// Metres, and radians, as in derain/views/merged_points.py.
constexpr double kRangeResolution = 0.05;
constexpr double kSameRay = 4e-4;

// Whether points at two ranges and so far apart are one return. The square of a chord is that of the
// difference of ranges, and 2 r r' (1 - cos) of the angle.
inline bool are_one_return(double range, double other_range, double apart) {
  const double farther = other_range - range;
  return std::abs(farther) <= kRangeResolution &&
         apart * apart - farther * farther <= kSameRay * kSameRay * range * other_range;
}

// Whether any point is one return with a neighbour of it; the point itself comes first.
inline bool any_is_one_return(const std::vector<Position>& positions,
                              const std::vector<std::int64_t>& neighbours,
                              const std::vector<float>& distances, std::size_t k) {
  const auto range_of_point = [&](std::int64_t point) {
    const Position& p = positions[static_cast<std::size_t>(point)];
    return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
  };
  for (std::size_t number = 0; number < neighbours.size(); ++number) {
    const std::int64_t own = neighbours[number - number % k];
    if (neighbours[number] == own || distances[number] > 2 * kRangeResolution) continue;
    if (are_one_return(range_of_point(own), range_of_point(neighbours[number]),
                       distances[number])) {
      return true;
    }
  }
  return false;
}

// The point that each of M points is one with: that of the lowest row among those that are one
// return with it, and what that one is one with.
inline std::vector<std::int64_t> keepers(const std::vector<Position>& positions,
                                         const std::vector<std::int64_t>& rows,
                                         const std::vector<std::int64_t>& neighbours,
                                         const std::vector<float>& distances, std::size_t k) {
  const auto at = [](std::int64_t number) { return static_cast<std::size_t>(number); };
  std::vector<double> ranges;
  ranges.reserve(positions.size());
  for (const Position& p : positions) {
    ranges.push_back(std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]));
  }
  std::vector<std::int64_t> keeper(positions.size());
  std::iota(keeper.begin(), keeper.end(), 0);
  const auto lower = [&](std::int64_t& kept, std::int64_t other) {
    if (rows[at(other)] < rows[at(kept)]) kept = other;
  };
  for (std::size_t point = 0; point < positions.size(); ++point) {
    for (std::size_t place = 1; place < k; ++place) {
      const std::int64_t other = neighbours[point * k + place];
      const float apart = distances[point * k + place];
      if (apart > 2 * kRangeResolution) break;
      if (at(other) == point || !are_one_return(ranges[point], ranges[at(other)], apart)) continue;
      lower(keeper[point], other);
      lower(keeper[at(other)], static_cast<std::int64_t>(point));
    }
  }
  for (bool moved = true; moved;) {
    moved = false;
    const std::vector<std::int64_t> before = keeper;
    for (std::int64_t& kept : keeper) {
      moved |= before[at(kept)] != kept;
      kept = before[at(kept)];
    }
  }
  return keeper;
}

}  // namespace derain
