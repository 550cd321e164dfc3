// The view of isolated points: those of a scan that few others crowd, each with its neighbours.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "inputs.hpp"
#include "kd_tree.hpp"
#include "merged_points.hpp"
#include "neighbour_view.hpp"
#include "scan.hpp"
#include "spec.hpp"

namespace derain {

// Shells around the sensor: squares of the ranges between them, square metres.
constexpr std::array<float, 10> kShellEdges = {2.10523319F, 4.43200731F, 9.33040905F, 19.6426868F,
                                               41.3524399F, 87.0565338F, 183.274307F, 385.835175F,
                                               812.273071F, 1710.02429F};

// As in derain/views/isolated_points.py: points of the sample, neighbours within a step, least and usual step,
// nearest range, points along the curve, and steps at which one counts half.
constexpr std::size_t kSampled = 8192;
constexpr std::size_t kStepNeighbours = 3;
constexpr double kFinestStep = 1e-4;
constexpr double kUsualStep = 0.1;
constexpr double kNearestPoint = 0.05;
constexpr std::size_t kWindow = 8;
constexpr double kHalfAt = 2.0;

// What crowds a point that is isolated at most.
constexpr float kMostCrowded = 6.5F;

// M points, of which S are isolated and are scored; the others are no rain.
struct IsolatedPoints {
  std::size_t k = 0;
  std::vector<std::int64_t> first;       // (M) row of the scan that each point was taken from
  std::vector<std::int64_t> inverse;     // (N) point of each row of the scan; -1 for rows at no point
  std::vector<float> points;             // (M, 3)
  std::vector<std::int64_t> cell;        // (M) shell and rank of intensity
  std::vector<std::int64_t> neighbours;  // (S, k) points, each one's own first
  std::vector<float> distances;          // (S, k) metres
  std::vector<float> step;               // (1) radians
  std::vector<float> counts;             // (1, shells, ranks) points of the scan

  std::size_t scored() const { return neighbours.size() / k; }

  std::vector<Input> inputs() {
    std::vector<Input> result = {matrix("points", Element::real, points, 3),
                                 matrix("cell", Element::whole, cell, 1),
                                 matrix("distances", Element::real, distances, k),
                                 matrix("neighbours", Element::whole, neighbours, k),
                                 matrix("step", Element::real, step, 1),
                                 matrix("counts", Element::real, counts, kIntensityRanks)};
    for (const std::size_t vector : {1U, 4U}) result[vector].type.shape.pop_back();
    result[5].type.shape = {1, kShellEdges.size() + 1, kIntensityRanks};
    return result;
  }

  // One value per row of the scan from one per isolated point; 0 for all others.
  std::vector<float> to_rows(const std::vector<float>& score, unsigned) const {
    std::vector<float> of_points(first.size(), 0.0F);
    for (std::size_t number = 0; number < score.size(); ++number) {
      of_points[static_cast<std::size_t>(neighbours[number * k])] = score[number];
    }
    std::vector<float> of_rows(inverse.size(), 0.0F);
    for (std::size_t row = 0; row < inverse.size(); ++row) {
      if (inverse[row] >= 0) of_rows[row] = of_points[static_cast<std::size_t>(inverse[row])];
    }
    return of_rows;
  }
};

namespace detail {

// Some points, evenly along the curve.
inline std::vector<std::int64_t> sample_of(std::size_t points) {
  std::vector<std::int64_t> sample;
  for (std::size_t number = 0; number < kSampled; ++number) {
    const auto point = static_cast<std::int64_t>(number * points / kSampled);
    if (points > 0 && (sample.empty() || sample.back() != point)) sample.push_back(point);
  }
  return sample;
}

inline Position direction_of(const Position& place) {
  const double squared = place[0] * place[0] + place[1] * place[1] + place[2] * place[2];
  const double length = std::max(std::sqrt(squared), kNearestPoint);
  return {place[0] / length, place[1] / length, place[2] / length};
}

inline double median_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

// The angle within which a point's nearest neighbours lie, in the median over the sample.
inline double beam_step(const std::vector<Position>& positions,
                        const std::vector<std::int64_t>& neighbours) {
  if (positions.size() <= kStepNeighbours) return kUsualStep;
  constexpr std::size_t k = 1 + kStepNeighbours;
  std::vector<double> widest;
  for (std::size_t number = 0; number < neighbours.size(); number += k) {
    const Position own = direction_of(positions[static_cast<std::size_t>(neighbours[number])]);
    double most = 0;
    for (std::size_t place = 1; place < k; ++place) {
      const auto at = static_cast<std::size_t>(neighbours[number + place]);
      const Position other = direction_of(positions[at]);
      const double x = other[0] - own[0];
      const double y = other[1] - own[1];
      const double z = other[2] - own[2];
      most = std::max(most, x * x + y * y + z * z);
    }
    widest.push_back(most);
  }
  return std::max(std::sqrt(median_of(std::move(widest))), kFinestStep);
}

// How crowded each point and the least crowded one near it along the curve are: others count the less the farther they
// are.
inline std::vector<float> crowding(const std::vector<float>& points, double step) {
  const std::size_t count = points.size() / 3;
  const auto half_at = static_cast<float>((kHalfAt * step) * (kHalfAt * step));
  const auto nearest = static_cast<float>(kNearestPoint * kNearestPoint);
  std::vector<float> per_half(count);
  for (std::size_t point = 0; point < count; ++point) {
    const float* p = &points[3 * point];
    per_half[point] = 1 / (std::max(p[0] * p[0] + p[1] * p[1] + p[2] * p[2], nearest) * half_at);
  }
  std::vector<float> near(count, 0.0F);
  for (std::size_t apart = 1; apart <= kWindow && apart < count; ++apart) {
    std::vector<float> squared(count - apart);
    for (std::size_t point = 0; point + apart < count; ++point) {
      const float* p = &points[3 * point];
      const float* q = p + 3 * apart;
      const float x = q[0] - p[0];
      const float y = q[1] - p[1];
      const float z = q[2] - p[2];
      squared[point] = x * x + y * y + z * z;
      near[point] += 1 / (1 + squared[point] * per_half[point]);
    }
    for (std::size_t point = apart; point < count; ++point) {
      near[point] += 1 / (1 + squared[point - apart] * per_half[point]);
    }
  }
  std::vector<float> result(count);
  for (std::size_t point = 0; point < count; ++point) {
    const std::size_t first = point < kWindow ? 0 : point - kWindow;
    const std::size_t last = std::min(point + kWindow + 1, count);
    result[point] = near[point] + *std::min_element(near.begin() + first, near.begin() + last);
  }
  return result;
}

// What finds neighbours among the points of a view, and what a sample of them shows: the step, and
// whether some returns are written more than once.
struct Searched {
  std::vector<Position> positions;
  KdTree tree;
  double step = 0;
  bool doubled = false;
};

inline Searched searched(const Scan& scan, const std::vector<std::int64_t>& first,
                         unsigned threads) {
  std::vector<Position> positions = positions_of(scan, first);
  Searched result{positions, KdTree(positions, first, threads)};
  std::vector<std::int64_t> neighbours;
  std::vector<float> distances;
  constexpr std::size_t k = 1 + kStepNeighbours;
  add_neighbourhoods(scan, first, result.tree, sample_of(first.size()), k, threads, neighbours,
                     distances);
  result.step = beam_step(positions, neighbours);
  result.doubled = any_is_one_return(positions, neighbours, distances, k);
  return result;
}

// Makes one point of those that are one return.
inline void merge_points(const Scan& scan, const Searched& search, unsigned threads,
                         IsolatedPoints& view) {
  constexpr std::size_t k = 1 + kStepNeighbours;
  std::vector<std::int64_t> neighbours;
  std::vector<float> distances;
  const std::vector<bool> all(view.first.size(), true);
  add_neighbourhoods(scan, view.first, search.tree, numbers_where(all), k, threads, neighbours,
                     distances);
  const std::vector<std::int64_t> keeper =
      keepers(search.positions, view.first, neighbours, distances, k);
  std::vector<std::int64_t> first;
  std::vector<std::int64_t> place(keeper.size(), -1);
  for (std::size_t point = 0; point < keeper.size(); ++point) {
    if (keeper[point] != static_cast<std::int64_t>(point)) continue;
    place[point] = static_cast<std::int64_t>(first.size());
    first.push_back(view.first[point]);
  }
  for (std::int64_t& point : view.inverse) {
    if (point >= 0) point = place[static_cast<std::size_t>(keeper[static_cast<std::size_t>(point)])];
  }
  view.first = std::move(first);
}

// Positions, shells and ranks of the points, and how many points each shell and rank has.
inline void fill_cells(const Scan& scan, const std::vector<bool>& valid, IsolatedPoints& view) {
  const std::vector<std::int64_t> ranks = intensity_ranks(scan, valid);
  view.counts.assign((kShellEdges.size() + 1) * kIntensityRanks, 0.0F);
  for (const std::int64_t number : view.first) {
    const float* row = scan.row(static_cast<std::size_t>(number));
    view.points.insert(view.points.end(), row, row + 3);
    const float squared = row[0] * row[0] + row[1] * row[1] + row[2] * row[2];
    const auto shell =
        std::upper_bound(kShellEdges.begin(), kShellEdges.end(), squared) - kShellEdges.begin();
    view.cell.push_back(shell * kIntensityRanks + ranks[static_cast<std::size_t>(number)]);
    view.counts[static_cast<std::size_t>(view.cell.back())] += 1;
  }
}

}  // namespace detail

// A scan as the network of a Spec sees it; `threads` is 1 or more.
inline IsolatedPoints isolated_points(const Scan& scan, const Spec& spec, unsigned threads) {
  IsolatedPoints view;
  view.k = spec.neighbours;
  const std::vector<bool> valid = valid_rows(scan);
  detail::find_points(scan, valid, view.first, view.inverse);
  detail::Searched search = detail::searched(scan, view.first, threads);
  if (search.doubled) {
    detail::merge_points(scan, search, threads, view);
    search = detail::searched(scan, view.first, threads);
  }
  view.step = {static_cast<float>(search.step)};
  detail::fill_cells(scan, valid, view);
  std::vector<std::int64_t> isolated;
  const std::vector<float> crowding = detail::crowding(view.points, search.step);
  for (std::size_t point = 0; point < crowding.size(); ++point) {
    if (crowding[point] <= kMostCrowded) isolated.push_back(static_cast<std::int64_t>(point));
  }
  detail::add_neighbourhoods(scan, view.first, search.tree, isolated, view.k, threads,
                             view.neighbours, view.distances);
  return view;
}

}  // namespace derain
