// The neighbour view: what a point network takes of a scan, and the way back to its rows.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <tuple>
#include <vector>

#include "candidates.hpp"
#include "inputs.hpp"
#include "kd_tree.hpp"
#include "parallel.hpp"
#include "scan.hpp"
#include "spec.hpp"

namespace derain {

// More rows at one position are rays without a return, as in derain/views/morton.py.
constexpr std::ptrdiff_t kMostCopies = 20;

// M points, of F of which there are neighbourhoods of k. Without candidates F = M, and each point
// is scored; with them, J are, and `candidates` holds where the neighbourhoods lie that they need.
struct NeighbourView {
  std::size_t k = 0;
  std::vector<std::int64_t> first;       // (M) row of the scan that each point was taken from
  std::vector<std::int64_t> inverse;     // (N) point of each row of the scan; -1 for rows at no point
  std::size_t channels = 0;
  std::vector<float> points;             // (M, C)
  std::vector<std::int64_t> neighbours;  // (F, k) points, each one's own first
  std::vector<float> distances;          // (F, k) metres
  std::optional<std::vector<std::int64_t>> candidates;  // (J, k) rows of `neighbours`

  // How many points the network scores: J, or M.
  std::size_t scored() const { return candidates ? candidates->size() / k : first.size(); }

  std::vector<Input> inputs() {
    std::vector<Input> result = {matrix("points", Element::real, points, channels),
                                 matrix("distances", Element::real, distances, k),
                                 matrix("neighbours", Element::whole, neighbours, k)};
    if (candidates) result.push_back(matrix("candidates", Element::whole, *candidates, k));
    return result;
  }

  // One value per row of the scan from one per scored point; 0 for all that were not scored.
  std::vector<float> to_rows(const std::vector<float>& score, unsigned) const {
    std::vector<float> of_points(first.size(), 0.0F);
    for (std::size_t number = 0; number < score.size(); ++number) {
      // A candidate's neighbourhood is among the first J, and begins with the candidate itself.
      const auto point = candidates ? neighbours[number * k] : static_cast<std::int64_t>(number);
      of_points[static_cast<std::size_t>(point)] = score[number];
    }
    std::vector<float> of_rows(inverse.size(), 0.0F);
    for (std::size_t row = 0; row < inverse.size(); ++row) {
      if (inverse[row] >= 0) of_rows[row] = of_points[static_cast<std::size_t>(inverse[row])];
    }
    return of_rows;
  }
};

namespace detail {

// Moves bit i of 16 to bit 3 i: of each group of bits, ever smaller ones, the upper half goes up.
inline std::uint64_t spread(std::uint64_t value) {
  value = (value | value << 16) & 0x0000FF0000FF;
  value = (value | value << 8) & 0x00F00F00F00F;
  value = (value | value << 4) & 0x0C30C30C30C3;
  return (value | value << 2) & 0x249249249249;
}

// A valid row, and its cell along a Morton curve through the cube around all of them.
struct CodedRow {
  std::uint64_t code;
  std::int64_t row;
};

// The valid rows, ascending.
inline std::vector<CodedRow> coded_rows(const Scan& scan, const std::vector<bool>& valid) {
  std::vector<CodedRow> rows;
  rows.reserve(scan.size());
  Position least{INFINITY, INFINITY, INFINITY};
  Position most{-INFINITY, -INFINITY, -INFINITY};
  for (std::size_t number = 0; number < scan.size(); ++number) {
    if (!valid[number]) continue;
    rows.push_back({0, static_cast<std::int64_t>(number)});
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = scan.row(number)[axis];
      least[axis] = std::min(least[axis], value);
      most[axis] = std::max(most[axis], value);
    }
  }
  double side = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) side = std::max(side, most[axis] - least[axis]);
  const double scale = side > 0 ? 65535.0 / side : 0.0;
  for (CodedRow& coded : rows) {
    const float* row = scan.row(static_cast<std::size_t>(coded.row));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      coded.code |= spread(static_cast<std::uint64_t>((row[axis] - least[axis]) * scale)) << axis;
    }
  }
  return rows;
}

// The valid rows, those at one position side by side, the lowest first. The order matters: what is
// near a point is judged by what is near it along the curve, and every n-th point along it is a fair
// sample of the scan.
inline std::vector<CodedRow> along_the_curve(const Scan& scan, const std::vector<bool>& valid) {
  std::vector<CodedRow> rows = coded_rows(scan, valid);
  std::sort(rows.begin(), rows.end(), [&](const CodedRow& one, const CodedRow& other) {
    if (one.code != other.code) return one.code < other.code;
    const float* p = scan.row(static_cast<std::size_t>(one.row));
    const float* q = scan.row(static_cast<std::size_t>(other.row));
    return std::tie(p[2], p[1], p[0], one.row) < std::tie(q[2], q[1], q[0], other.row);
  });
  return rows;
}

// Finds which rows are at one position: the first of each, and the position of every row; -1 where
// more rows share it than there are copies of a point.
inline void find_points(const Scan& scan, const std::vector<bool>& valid,
                        std::vector<std::int64_t>& first, std::vector<std::int64_t>& inverse) {
  inverse.assign(scan.size(), -1);
  const std::vector<CodedRow> rows = along_the_curve(scan, valid);
  const auto position = [&](const CodedRow& coded) {
    return scan.row(static_cast<std::size_t>(coded.row));
  };
  for (auto lowest = rows.cbegin(); lowest != rows.cend();) {
    const float* here = position(*lowest);
    const auto next = std::find_if(lowest, rows.cend(), [&](const CodedRow& other) {
      return !std::equal(here, here + 3, position(other));
    });
    if (next - lowest <= kMostCopies) {
      const auto number = static_cast<std::int64_t>(first.size());
      for (auto copy = lowest; copy != next; ++copy) {
        inverse[static_cast<std::size_t>(copy->row)] = number;
      }
      first.push_back(lowest->row);
    }
    lowest = next;
  }
}

inline void fill_points(const Scan& scan, const std::vector<bool>& valid, const Spec& spec,
                        NeighbourView& view) {
  const std::size_t width = view.channels = spec.channels.size();
  view.points.resize(view.first.size() * width);
  for_channels(scan, valid, spec, view.first,
               [&](std::size_t point, std::size_t channel, float value) {
                 view.points[point * width + channel] = value;
               });
}

// Neighbourhoods of k of some points, behind those that there are already.
inline void add_neighbourhoods(const Scan& scan, const std::vector<std::int64_t>& first,
                               const KdTree& tree, const std::vector<std::int64_t>& queries,
                               std::size_t k, unsigned threads,
                               std::vector<std::int64_t>& neighbours,
                               std::vector<float>& distances) {
  const std::size_t begin = neighbours.size();
  neighbours.resize(begin + queries.size() * k);
  distances.resize(begin + queries.size() * k);
  in_parts(queries.size(), threads, [&](std::size_t from, std::size_t to) {
    std::vector<Neighbour> found;
    for (std::size_t query = from; query < to; ++query) {
      const auto point = static_cast<std::size_t>(queries[query]);
      const float* row = scan.row(static_cast<std::size_t>(first[point]));
      tree.nearest({row[0], row[1], row[2]}, k, found);
      for (std::size_t place = 0; place < k; ++place) {
        // Where there are fewer points than k, the farthest fills up.
        const Neighbour& neighbour = found[std::min(place, found.size() - 1)];
        const std::size_t at = begin + query * k + place;
        neighbours[at] = neighbour.point;
        distances[at] = std::sqrt(static_cast<float>(neighbour.squared));
      }
    }
  });
}

inline void add_neighbourhoods(const Scan& scan, const KdTree& tree,
                               const std::vector<std::int64_t>& queries, unsigned threads,
                               NeighbourView& view) {
  add_neighbourhoods(scan, view.first, tree, queries, view.k, threads, view.neighbours,
                     view.distances);
}

inline std::vector<std::int64_t> numbers_where(const std::vector<bool>& wanted) {
  std::vector<std::int64_t> numbers;
  for (std::size_t point = 0; point < wanted.size(); ++point) {
    if (wanted[point]) numbers.push_back(static_cast<std::int64_t>(point));
  }
  return numbers;
}

// Neighbourhoods of the candidates, then of all points in those: what a network looks at that
// looks at neighbours of neighbours.
inline void add_around_candidates(const Scan& scan, const KdTree& tree,
                                  const std::vector<bool>& candidate, unsigned threads,
                                  NeighbourView& view) {
  const std::vector<std::int64_t> own = numbers_where(candidate);
  add_neighbourhoods(scan, tree, own, threads, view);
  std::vector<bool> other(candidate.size(), false);
  for (const std::int64_t point : view.neighbours) {
    other[static_cast<std::size_t>(point)] = !candidate[static_cast<std::size_t>(point)];
  }
  const std::vector<std::int64_t> others = numbers_where(other);
  std::vector<std::int64_t> place(candidate.size(), -1);
  std::int64_t next = 0;
  for (const std::int64_t point : own) place[static_cast<std::size_t>(point)] = next++;
  for (const std::int64_t point : others) place[static_cast<std::size_t>(point)] = next++;
  view.candidates.emplace();
  for (const std::int64_t point : view.neighbours) {
    view.candidates->push_back(place[static_cast<std::size_t>(point)]);
  }
  add_neighbourhoods(scan, tree, others, threads, view);
}

inline std::vector<Position> positions_of(const Scan& scan,
                                          const std::vector<std::int64_t>& rows) {
  std::vector<Position> positions;
  positions.reserve(rows.size());
  for (const std::int64_t number : rows) {
    const float* row = scan.row(static_cast<std::size_t>(number));
    positions.push_back({row[0], row[1], row[2]});
  }
  return positions;
}

}  // namespace detail

// A scan as the network of a Spec sees it; `threads` is 1 or more.
inline NeighbourView neighbour_view(const Scan& scan, const Spec& spec, unsigned threads) {
  NeighbourView view;
  view.k = spec.neighbours;
  const std::vector<bool> valid = valid_rows(scan);
  detail::find_points(scan, valid, view.first, view.inverse);
  const KdTree tree(detail::positions_of(scan, view.first), view.first, threads);
  if (spec.candidates) {
    const std::vector<bool> rows = candidate_rows(scan, valid, spec);
    std::vector<bool> candidate;
    for (const std::int64_t first : view.first) {
      candidate.push_back(rows[static_cast<std::size_t>(first)]);
    }
    detail::add_around_candidates(scan, tree, candidate, threads, view);
  } else {
    const std::vector<bool> all(view.first.size(), true);
    detail::add_neighbourhoods(scan, tree, detail::numbers_where(all), threads, view);
  }
  detail::fill_points(scan, valid, spec, view);
  return view;
}

}  // namespace derain
