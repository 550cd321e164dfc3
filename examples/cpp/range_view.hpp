// The range view: a scan as the image that the sensor saw, and the way back to its rows.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "back_projection.hpp"
#include "candidates.hpp"
#include "inputs.hpp"
#include "parallel.hpp"
#include "scan.hpp"
#include "spec.hpp"

namespace derain {

struct RangeView {
  RangeSpec spec;
  std::vector<float> image;           // (C, H * W) channels of the row that each pixel shows
  std::vector<unsigned char> valid;   // (H * W) 1 where a pixel shows a row
  std::vector<std::int64_t> winner;   // (H * W) that row, the nearest; -1 in empty pixels
  std::vector<float> shown;           // (H * W) its range, metres; infinite in empty pixels
  std::vector<std::int64_t> pixel;    // (N) pixel of each row of the scan; -1 off the grid
  std::vector<float> range;           // (N) metres
  std::vector<bool> candidate;        // (N) rows that may be rain

  std::size_t scored() const { return winner.size(); }

  std::vector<Input> inputs() {
    const std::int64_t height = spec.grid.rows();
    const std::int64_t width = spec.grid.columns;
    const auto channels = static_cast<std::int64_t>(image.size() / scored());
    return {{{"image", Element::real, {1, channels, height, width}},
             image.data(),
             image.size() * sizeof(float)},
            {{"valid", Element::truth, {1, 1, height, width}}, valid.data(), valid.size()}};
  }

  // One value per row of the scan from one per pixel; 0 for rows that are off the grid or no
  // candidates. A pixel that shows no candidate counts as scored 0.
  std::vector<float> to_rows(std::vector<float> score, unsigned threads) const {
    for (std::size_t at = 0; at < score.size(); ++at) {
      if (winner[at] < 0 || !candidate[static_cast<std::size_t>(winner[at])]) score[at] = 0;
    }
    const ScoredPixels pixels{spec.grid, shown, score};
    std::vector<float> of_rows(pixel.size(), 0.0F);
    in_parts(pixel.size(), threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        if (pixel[row] < 0 || !candidate[row]) continue;
        switch (spec.back_projection) {
          case BackProjection::copy: of_rows[row] = pixels.copy(pixel[row]); break;
          case BackProjection::nearest_range:
            of_rows[row] = pixels.nearest_range(pixel[row], range[row]);
            break;
          case BackProjection::vote: of_rows[row] = pixels.vote(pixel[row], range[row]); break;
        }
      }
    });
    return of_rows;
  }
};

// A scan as the network of a Spec sees it that has a range view; `threads` is 1 or more.
inline RangeView range_view(const Scan& scan, const Spec& spec, unsigned threads) {
  RangeView view;
  view.spec = *spec.range;
  const auto size = static_cast<std::size_t>(view.spec.grid.pixels());
  const std::vector<bool> valid = valid_rows(scan);
  view.pixel.assign(scan.size(), -1);
  view.range.resize(scan.size());
  in_parts(scan.size(), threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      view.range[row] = range_of(scan.row(row));
      if (valid[row]) view.pixel[row] = view.spec.grid.pixel(scan.row(row));
    }
  });
  view.winner.assign(size, -1);
  view.shown.assign(size, std::numeric_limits<float>::infinity());
  view.valid.assign(size, 0);
  for (std::size_t row = 0; row < scan.size(); ++row) {
    if (view.pixel[row] < 0) continue;
    const auto at = static_cast<std::size_t>(view.pixel[row]);
    // Of equally near rows the lowest, which came first.
    if (view.range[row] < view.shown[at]) {
      view.shown[at] = view.range[row];
      view.winner[at] = static_cast<std::int64_t>(row);
      view.valid[at] = 1;
    }
  }
  view.image.assign(spec.channels.size() * size, 0.0F);
  for_channels(scan, valid, spec, view.winner,
               [&](std::size_t at, std::size_t channel, float value) {
                 view.image[channel * size + at] = value;
               });
  view.candidate = candidate_rows(scan, valid, spec);
  return view;
}

}  // namespace derain
