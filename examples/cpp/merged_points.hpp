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

inline double length_of(const Position& p) { return std::hypot(p[0], p[1], p[2]); }

inline bool are_one_return(const Position& p, const Position& q) {
  const double range_p = length_of(p);
  const double range_q = length_of(q);
  const Position cross{p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2],
                       p[0] * q[1] - p[1] * q[0]};
  return std::abs(range_p - range_q) <= kRangeResolution &&
         length_of(cross) <= kSameRay * range_p * range_q;
}

// The point that each of M points is one with: that of the lowest row among those that are one
// return with it, and what that one is one with.
inline std::vector<std::int64_t> keepers(const std::vector<Position>& positions,
                                         const std::vector<std::int64_t>& rows,
                                         const std::vector<std::int64_t>& neighbours,
                                         const std::vector<float>& distances, std::size_t k) {
  const auto at = [](std::int64_t number) { return static_cast<std::size_t>(number); };
  std::vector<std::int64_t> keeper(positions.size());
  std::iota(keeper.begin(), keeper.end(), 0);
  const auto lower = [&](std::int64_t& kept, std::int64_t other) {
    if (rows[at(other)] < rows[at(kept)]) kept = other;
  };
  for (std::size_t point = 0; point < positions.size(); ++point) {
    for (std::size_t place = 1; place < k; ++place) {
      const std::int64_t other = neighbours[point * k + place];
      if (distances[point * k + place] > 2 * kRangeResolution) break;
      if (!are_one_return(positions[point], positions[at(other)])) continue;
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
