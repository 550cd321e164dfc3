// The grid of directions that a range image is made of.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <vector>

namespace derain {

// Rows of inclination by columns of azimuth, all in degrees.
struct Grid {
  std::int64_t columns = 0;
  double right = 0;
  double left = 0;
  std::vector<double> edges;  // of the rows from top to bottom, one more than there are rows

  static constexpr std::int64_t kMostPixels = std::int64_t{1} << 22;

  std::int64_t rows() const { return static_cast<std::int64_t>(edges.size()) - 1; }
  std::int64_t pixels() const { return rows() * columns; }
  bool is_full_circle() const { return left - right == 360.0; }

  // Whether there is such a grid; comparisons with NaN are false.
  bool is_possible() const {
    const bool sized = rows() >= 1 && columns >= 1 && columns <= kMostPixels / rows();
    const bool bounded = -360 <= right && right < left && left <= right + 360;
    const bool descending =
        std::adjacent_find(edges.begin(), edges.end(), std::less_equal<>()) == edges.end();
    return sized && bounded && descending && edges.front() <= 90 && edges.back() >= -90;
  }

  // The pixel that a point falls into, row * columns + column; -1 outside the grid.
  std::int64_t pixel(const float* point) const {
    // Adding 0 makes zeros positive, whose signs atan2 distinguishes.
    const double x = point[0] + 0.0;
    const double y = point[1] + 0.0;
    const double z = point[2] + 0.0;
    const double inclination = std::atan2(z, std::sqrt(x * x + y * y)) * kDegrees;
    if (!(inclination >= edges.back() && inclination <= edges.front())) return -1;
    double turn = std::fmod(left - std::atan2(y, x) * kDegrees, 360.0);
    if (turn < 0) turn += 360.0;
    if (turn > left - right) return -1;
    // A row holds its upper border. Behind it, the first edge below the point.
    const auto below =
        std::upper_bound(edges.begin(), edges.end(), inclination, std::greater<>());
    // The lowest row holds its lower border as well.
    const std::int64_t row = std::min<std::int64_t>(below - edges.begin() - 1, rows() - 1);
    const auto column =
        static_cast<std::int64_t>(turn * static_cast<double>(columns) / (left - right));
    return row * columns + std::min(column, columns - 1);
  }

 private:
  static constexpr double kDegrees = 180.0 / 3.14159265358979323846;
};

}  // namespace derain
