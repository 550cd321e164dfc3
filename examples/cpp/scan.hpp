// A scan of a KITTI-style .bin file: rows of x, y, z (metres, sensor frame) and intensity.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "errors.hpp"
#include "spec.hpp"

namespace derain {

// Beyond these a value was not measured.
constexpr float kLargestCoordinate = 1e6F;
constexpr float kLargestValue = 1e7F;

// In every column of a row: a cell of a range image without a return.
constexpr float kSentinel = -1.0F;

// If all of at least this many points have one intensity, it was filled in and not measured.
constexpr std::size_t kFewestAlike = 100;

constexpr std::size_t kColumns = 4;

// Files are little-endian, as are all processors that this program is likely to meet.
struct Scan {
  std::vector<float> values;  // rows of kColumns, as in the file
  std::size_t size() const { return values.size() / kColumns; }
  const float* row(std::size_t number) const { return values.data() + number * kColumns; }
};

inline Scan read_scan(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file || std::filesystem::is_directory(path)) {
    throw InputError(path.string(), "it cannot be read", "Check the path.");
  }
  const auto bytes = static_cast<std::size_t>(file.tellg());
  if (bytes % (kColumns * sizeof(float)) != 0) {
    throw InputError(path.string(), std::to_string(bytes) + " bytes are not whole rows of 16",
                     "Give rows of four float32: x, y, z, intensity.");
  }
  Scan scan;
  scan.values.resize(bytes / sizeof(float));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(scan.values.data()), static_cast<std::streamsize>(bytes));
  if (!file) throw InputError(path.string(), "it cannot be read to its end", "Copy it again.");
  return scan;
}

// The same scan with intensities that are not known.
inline Scan without_intensity(Scan scan) {
  for (std::size_t at = kColumns - 1; at < scan.values.size(); at += kColumns) {
    scan.values[at] = std::numeric_limits<float>::quiet_NaN();
  }
  return scan;
}

// Whether any intensity is a number that a sensor can measure; comparisons with NaN are false.
inline bool knows_intensity(const Scan& scan) {
  for (std::size_t row = 0; row < scan.size(); ++row) {
    if (std::abs(scan.row(row)[3]) <= kLargestValue) return true;
  }
  return false;
}

// Which rows can be judged; the others stay in every output, and are not rain.
inline std::vector<bool> valid_rows(const Scan& scan) {
  const bool by_intensity = knows_intensity(scan);
  std::vector<bool> valid(scan.size());
  for (std::size_t number = 0; number < scan.size(); ++number) {
    const float* row = scan.row(number);
    const auto all = [&](auto holds) { return holds(row[0]) && holds(row[1]) && holds(row[2]); };
    const bool measured =
        all([](float value) { return std::abs(value) <= kLargestCoordinate; }) &&
        (!by_intensity || std::abs(row[3]) <= kLargestValue);
    const bool at_origin = all([](float value) { return value == 0; });
    const bool empty_cell = all([](float value) { return value == kSentinel; }) &&
                            (!by_intensity || row[3] == kSentinel);
    valid[number] = measured && !at_origin && !empty_cell;
  }
  return valid;
}

// Whether the intensities of the valid rows are measurements, not one value filled in.
inline bool has_measured_intensity(const Scan& scan, const std::vector<bool>& valid) {
  if (!knows_intensity(scan)) return false;
  std::size_t count = 0;
  float least = INFINITY;
  float most = -INFINITY;
  for (std::size_t row = 0; row < scan.size(); ++row) {
    if (!valid[row]) continue;
    ++count;
    least = std::min(least, scan.row(row)[3]);
    most = std::max(most, scan.row(row)[3]);
  }
  return count < kFewestAlike || least != most;
}

// Distance of a row from the sensor, metres.
inline float range_of(const float* row) {
  const double x = row[0];
  const double y = row[1];
  const double z = row[2];
  return static_cast<float>(std::sqrt(x * x + y * y + z * z));
}

// How bright each row is among the valid ones, from 0 on: every intensity that occurs counts by the
// root of how often it does. All 0 where intensity was not measured.
inline std::vector<std::int64_t> intensity_ranks(const Scan& scan, const std::vector<bool>& valid) {
  std::vector<std::int64_t> ranks(scan.size(), 0);
  if (!has_measured_intensity(scan, valid)) return ranks;
  std::vector<float> ascending;
  for (std::size_t row = 0; row < scan.size(); ++row) {
    if (valid[row]) ascending.push_back(scan.row(row)[3]);
  }
  std::sort(ascending.begin(), ascending.end());
  std::vector<float> levels;
  std::vector<double> darker{0};  // than each level, and than none: weights added up
  for (auto level = ascending.cbegin(); level != ascending.cend();) {
    const auto next = std::upper_bound(level, ascending.cend(), *level);
    levels.push_back(*level);
    darker.push_back(darker.back() + std::sqrt(static_cast<double>(next - level)));
    level = next;
  }
  std::vector<float> edges;
  for (int step = 1; step < kIntensityRanks; ++step) {
    const double weight = static_cast<double>(step) / kIntensityRanks * darker.back();
    const auto first = std::lower_bound(darker.cbegin(), darker.cend() - 1, weight);
    const auto level = static_cast<std::size_t>(first - darker.cbegin());
    edges.push_back(level < levels.size() ? levels[level] : INFINITY);
  }
  for (std::size_t row = 0; row < scan.size(); ++row) {
    ranks[row] = std::upper_bound(edges.cbegin(), edges.cend(), scan.row(row)[3]) - edges.cbegin();
  }
  return ranks;
}

// One value per row by the name of a channel; nothing where the scan has no such channel.
inline std::optional<std::vector<float>> channel_of(const Scan& scan,
                                                    const std::vector<bool>& valid,
                                                    const std::string& name) {
  static const std::vector<std::string> columns = {"x", "y", "z", "intensity"};
  const auto column = std::find(columns.begin(), columns.end(), name) - columns.begin();
  const bool is_column = column < static_cast<std::ptrdiff_t>(kColumns);
  if (!is_column && name != "range") return std::nullopt;
  if (name == "intensity" && !has_measured_intensity(scan, valid)) return std::nullopt;
  std::vector<float> values(scan.size());
  for (std::size_t row = 0; row < scan.size(); ++row) {
    values[row] = is_column ? scan.row(row)[column] : range_of(scan.row(row));
  }
  return values;
}

}  // namespace derain
