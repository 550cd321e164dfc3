// Which rows of a scan may be rain, and what a network sees of a row.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "scan.hpp"
#include "spec.hpp"

namespace derain {

// Rows of which no bounded channel is known to be out of bounds; all, where there are no bounds.
inline std::vector<bool> candidate_rows(const Scan& scan, const std::vector<bool>& valid,
                                        const Spec& spec) {
  std::vector<bool> candidate(scan.size(), true);
  if (!spec.candidates) return candidate;
  for (const Bound& bound : *spec.candidates) {
    const auto values = channel_of(scan, valid, bound.channel);
    if (!values) continue;
    for (std::size_t row = 0; row < candidate.size(); ++row) {
      const float value = (*values)[row];
      if ((bound.least && value < *bound.least) || (bound.most && value > *bound.most)) {
        candidate[row] = false;
      }
    }
  }
  return candidate;
}

// Calls put(place, channel, value) for each of the rows and each channel of a Spec. The mean of the
// training data stands in for what the scan lacks; rows of -1 are left out.
template <typename Put>
void for_channels(const Scan& scan, const std::vector<bool>& valid, const Spec& spec,
                  const std::vector<std::int64_t>& rows, const Put& put) {
  for (std::size_t channel = 0; channel < spec.channels.size(); ++channel) {
    const auto values = channel_of(scan, valid, spec.channels[channel]);
    for (std::size_t place = 0; place < rows.size(); ++place) {
      if (rows[place] < 0) continue;
      const auto row = static_cast<std::size_t>(rows[place]);
      const bool lacking = !values || std::isnan((*values)[row]);
      put(place, channel, lacking ? spec.mean[channel] : (*values)[row]);
    }
  }
}

}  // namespace derain
