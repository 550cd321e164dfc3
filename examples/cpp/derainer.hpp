// A model and all that happens before and after it: a scan in, a probability for each row out.
#pragma once

#include <chrono>
#include <filesystem>
#include <vector>

#include "isolated_points.hpp"
#include "neighbour_view.hpp"
#include "network.hpp"
#include "range_view.hpp"

namespace derain {

// What the stages of a scan took, in milliseconds.
struct Times {
  double view = 0;
  double network = 0;
  double back = 0;
};

class Derainer {
 public:
  // `threads` is 1 or more.
  Derainer(const std::filesystem::path& model, unsigned threads)
      : network_(model, threads), threads_(threads) {}

  const Spec& spec() const { return network_.spec(); }

  // The probability of rain of each row of a scan.
  std::vector<float> probability(const Scan& scan, Times& times) {
    if (spec().range) return judged(scan, times, range_view);
    if (spec().isolated) return of_isolated(scan, times);
    return judged(scan, times, neighbour_view);
  }

 private:
  // Rows without a possible intensity are judged as in a scan that has none.
  std::vector<float> of_isolated(const Scan& scan, Times& times) {
    std::vector<float> result = judged(scan, times, isolated_points);
    const Scan blank = without_intensity(scan);
    const std::vector<bool> valid = valid_rows(scan), valid_in_blank = valid_rows(blank);
    if (valid == valid_in_blank) return result;
    Times more;
    const std::vector<float> of_blank = judged(blank, more, isolated_points);
    for (std::size_t row = 0; row < scan.size(); ++row) {
      if (valid_in_blank[row] && !valid[row]) result[row] = of_blank[row];
    }
    times = {times.view + more.view, times.network + more.network, times.back + more.back};
    return result;
  }

  template <typename MakeView>
  std::vector<float> judged(const Scan& scan, Times& times, const MakeView& make_view) {
    const auto began = Clock::now();
    auto view = make_view(scan, spec(), threads_);
    const auto seen = Clock::now();
    std::vector<float> score = network_.probability(view.inputs(), view.scored());
    const auto scored = Clock::now();
    std::vector<float> result = view.to_rows(std::move(score), threads_);
    times = {milliseconds(began, seen), milliseconds(seen, scored),
             milliseconds(scored, Clock::now())};
    return result;
  }

  using Clock = std::chrono::steady_clock;

  static double milliseconds(Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration<double, std::milli>(to - from).count();
  }

  Network network_;
  unsigned threads_;
};

}  // namespace derain
