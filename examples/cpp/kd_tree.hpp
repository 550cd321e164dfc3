// Exact k nearest neighbours, with equally near ones in a known order.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <thread>
#include <vector>

namespace derain {

using Position = std::array<double, 3>;

// A point that was found: its squared distance, its rank among equally near ones, its number.
struct Neighbour {
  double squared;
  std::int64_t rank;
  std::int64_t point;

  bool before(const Neighbour& other) const {
    return squared < other.squared || (squared == other.squared && rank < other.rank);
  }
};

// A tree of boxes that halve the points along their longest side. Distances are computed in
// float64, in which differences of float32 coordinates and their squares hardly ever round: what
// is equally far compares equal. Rounding is monotonous, so that no box is left out that holds a
// point as near as the last one kept.
class KdTree {
 public:
  // `rank` orders equally near points; `threads` is 1 or more.
  KdTree(std::vector<Position> positions, const std::vector<std::int64_t>& rank, unsigned threads)
      : positions_(std::move(positions)), points_(positions_.size()) {
    std::iota(points_.begin(), points_.end(), std::int64_t{0});
    std::size_t boxes = 1;
    for (std::size_t most = points_.size(); most > kLeaf; most -= most / 2) boxes = 2 * boxes + 1;
    boxes_.resize(boxes);
    build(0, 0, points_.size(), threads);
    std::vector<Position> in_order;
    in_order.reserve(points_.size());
    for (const std::int64_t point : points_) {
      in_order.push_back(positions_[static_cast<std::size_t>(point)]);
      rank_.push_back(rank[static_cast<std::size_t>(point)]);
    }
    positions_ = std::move(in_order);
  }

  // The `k` nearest points in ascending distance, or all where there are fewer.
  void nearest(const Position& place, std::size_t k, std::vector<Neighbour>& found) const {
    found.clear();
    search(0, place, k, found);
  }

 private:
  static constexpr std::size_t kLeaf = 16;

  // The halves of box n are boxes 2 n + 1 and 2 n + 2, unless it is a leaf.
  struct Box {
    Position least, most;
    std::size_t begin, end;  // its points

    bool is_leaf() const { return end - begin <= kLeaf; }
  };

  void build(std::size_t number, std::size_t begin, std::size_t end, unsigned threads) {
    const Box box = boxes_[number] = around(begin, end);
    if (box.is_leaf()) return;
    std::size_t axis = 0;
    for (std::size_t other = 1; other < 3; ++other) {
      if (box.most[other] - box.least[other] > box.most[axis] - box.least[axis]) axis = other;
    }
    const std::size_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::size_t place) {
      return points_.begin() + static_cast<std::ptrdiff_t>(place);
    };
    std::nth_element(at(begin), at(middle), at(end), [&](std::int64_t one, std::int64_t other) {
      return positions_[static_cast<std::size_t>(one)][axis] <
             positions_[static_cast<std::size_t>(other)][axis];
    });
    const auto lower = [&] { build(2 * number + 1, begin, middle, threads / 2); };
    std::thread worker;
    if (threads > 1) {
      worker = std::thread(lower);
    } else {
      lower();
    }
    build(2 * number + 2, middle, end, threads - threads / 2);
    if (worker.joinable()) worker.join();
  }

  Box around(std::size_t begin, std::size_t end) const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    Box box{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}, begin, end};
    for (std::size_t place = begin; place < end; ++place) {
      const Position& position = positions_[static_cast<std::size_t>(points_[place])];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box.least[axis] = std::min(box.least[axis], position[axis]);
        box.most[axis] = std::max(box.most[axis], position[axis]);
      }
    }
    return box;
  }

  static double sum_of_squares(double x, double y, double z) { return x * x + y * y + z * z; }

  static double squared_to(const Box& box, const Position& place) {
    Position outside;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      outside[axis] =
          std::max({box.least[axis] - place[axis], place[axis] - box.most[axis], 0.0});
    }
    return sum_of_squares(outside[0], outside[1], outside[2]);
  }

  void search(std::size_t number, const Position& place, std::size_t k,
              std::vector<Neighbour>& found) const {
    const Box& box = boxes_[number];
    if (box.is_leaf()) {
      for (std::size_t at = box.begin; at < box.end; ++at) {
        const Position& other = positions_[at];
        const double squared =
            sum_of_squares(other[0] - place[0], other[1] - place[1], other[2] - place[2]);
        if (found.size() == k && squared > found.back().squared) continue;
        keep({squared, rank_[at], points_[at]}, k, found);
      }
      return;
    }
    std::size_t near = 2 * number + 1;
    std::size_t far = near + 1;
    double to_near = squared_to(boxes_[near], place);
    double to_far = squared_to(boxes_[far], place);
    if (to_far < to_near) {
      std::swap(near, far);
      std::swap(to_near, to_far);
    }
    // As near as the last one kept is near enough: an equal of lower rank may be in it.
    if (found.size() < k || to_near <= found.back().squared) search(near, place, k, found);
    if (found.size() < k || to_far <= found.back().squared) search(far, place, k, found);
  }

  // Puts a point among the nearest so far, if it is one of them.
  static void keep(const Neighbour& next, std::size_t k, std::vector<Neighbour>& found) {
    if (found.size() < k) {
      found.push_back(next);
    } else if (!next.before(found.back())) {
      return;
    }
    // The last one makes room.
    std::size_t at = found.size() - 1;
    for (; at > 0 && next.before(found[at - 1]); --at) found[at] = found[at - 1];
    found[at] = next;
  }

  std::vector<Position> positions_;   // in the order of points_, once it is built
  std::vector<std::int64_t> points_;  // box by box
  std::vector<std::int64_t> rank_;
  std::vector<Box> boxes_;
};

}  // namespace derain
