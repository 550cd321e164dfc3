// From pixels to points: which score a point is given that lost its pixel to a nearer one.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <vector>

#include "grid.hpp"

namespace derain {

// Pixels on each side of a point's own that may speak for it: a window of 5 x 5.
constexpr int kReach = 2;
constexpr std::size_t kSteps = 25;

// So many pixels vote, and those that differ by more metres than the cutoff abstain.
constexpr std::size_t kVoters = 5;
constexpr float kCutoff = 1.0F;

struct Step {
  int down, along;
  float weight;  // what a difference in range counts for: less, the nearer the pixel is

  int squared() const { return down * down + along * along; }
};

// The steps within a window: to the pixel itself, then the nearest, then row by row.
inline std::array<Step, kSteps> window_steps() {
  std::array<Step, kSteps> steps;
  std::size_t number = 0;
  double sum = 0;
  for (int down = -kReach; down <= kReach; ++down) {
    for (int along = -kReach; along <= kReach; ++along) {
      steps[number] = {down, along, 0};
      sum += std::exp(-steps[number++].squared() / 2.0);
    }
  }
  for (Step& step : steps) {
    step.weight = static_cast<float>(1 - std::exp(-step.squared() / 2.0) / sum);
  }
  std::stable_sort(steps.begin(), steps.end(), [](const Step& one, const Step& other) {
    return one.squared() < other.squared();
  });
  return steps;
}

// The pixels of a grid, each with the range that it shows and its score.
struct ScoredPixels {
  const Grid& grid;
  const std::vector<float>& shown;  // (H * W) metres; infinite where a pixel is empty
  const std::vector<float>& score;  // (H * W)

  float copy(std::int64_t pixel) const { return score[static_cast<std::size_t>(pixel)]; }

  // The score of the pixel that shows the range most like the point's.
  float nearest_range(std::int64_t pixel, float range) const {
    if (!(range > shown[static_cast<std::size_t>(pixel)])) return copy(pixel);
    float least = std::numeric_limits<float>::infinity();
    float result = copy(pixel);
    around(pixel, [&](std::size_t other, const Step&) {
      const float unlike = std::abs(shown[other] - range);
      if (unlike < least) {
        least = unlike;
        result = score[other];
      }
    });
    return result;
  }

  // The share of rain among the votes of the pixels most like the point in range.
  float vote(std::int64_t pixel, float range) const {
    struct Ballot {
      float unlike;
      bool rain;
    };
    std::array<Ballot, kSteps> ballots;
    std::size_t count = 0;
    around(pixel, [&](std::size_t other, const Step& step) {
      // The point's own pixel votes in any case, as if it showed the point.
      const bool own = step.squared() == 0;
      const float unlike = own ? 0.0F : std::abs(shown[other] - range) * step.weight;
      ballots[count++] = {unlike, score[other] > 0.5F};
    });
    const auto end = ballots.begin() + static_cast<std::ptrdiff_t>(count);
    std::stable_sort(ballots.begin(), end, [](const Ballot& one, const Ballot& other) {
      return one.unlike < other.unlike;
    });
    int votes = 0;
    int rain = 0;
    for (std::size_t voter = 0; voter < std::min(kVoters, count); ++voter) {
      if (ballots[voter].unlike > kCutoff) break;
      ++votes;
      rain += ballots[voter].rain;
    }
    return static_cast<float>(static_cast<double>(rain) / votes);
  }

 private:
  // Calls visit(pixel, step) for the pixels of the window, in the order of the steps. On a full
  // circle the first column is the neighbour of the last.
  template <typename Visit>
  void around(std::int64_t pixel, const Visit& visit) const {
    static const std::array<Step, kSteps> steps = window_steps();
    const std::int64_t row = pixel / grid.columns;
    const std::int64_t column = pixel % grid.columns;
    for (const Step& step : steps) {
      const std::int64_t down = row + step.down;
      std::int64_t along = column + step.along;
      if (grid.is_full_circle()) {
        along = ((along % grid.columns) + grid.columns) % grid.columns;
      }
      const bool inside = down >= 0 && down < grid.rows() && along >= 0 && along < grid.columns;
      if (inside) visit(static_cast<std::size_t>(down * grid.columns + along), step);
    }
  }
};

}  // namespace derain
