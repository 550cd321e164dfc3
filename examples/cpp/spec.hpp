// The Spec of a model, as far as this program uses it: docs/onnx_contract.md has the whole.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "errors.hpp"
#include "grid.hpp"
#include "inputs.hpp"
#include "json.hpp"

namespace derain {

// The layout of a Spec that is read here, and the most neighbours that it may state.
constexpr double kSchema = 1;
constexpr double kMostNeighbours = 64;

// Shells around the sensor, and steps of intensity, in which points are counted.
constexpr std::int64_t kShells = 11;
constexpr std::int64_t kIntensityRanks = 32;

// What a channel of a point that may be rain is at least, and at most.
struct Bound {
  std::string channel;
  std::optional<float> least;
  std::optional<float> most;
};

// How points get a score that lost their pixel.
enum class BackProjection { copy, nearest_range, vote };

struct RangeSpec {
  Grid grid;
  BackProjection back_projection = BackProjection::copy;
};

struct Spec {
  std::string network;
  std::size_t neighbours = 0;         // k of the neighbour view, the point itself included
  bool isolated = false;              // whether the view is that of isolated points
  std::optional<RangeSpec> range;     // the range view, where the network has that one
  std::vector<std::string> channels;  // what the network sees of a point, in order
  std::vector<float> mean;            // stands in for what a scan lacks, by channel
  float threshold = 0.5F;             // a point is rain where its probability is greater
  std::optional<std::vector<Bound>> candidates;
};

// A model of derain that needs something that this program does not support.
class Unknown : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

namespace detail {

inline const Json& member(const Json& of, const char* key, Json::Kind kind) {
  const Json& value = of[key];
  if (!value.is(kind)) throw std::runtime_error(std::string("its Spec has no proper '") + key + "'");
  return value;
}

inline std::optional<float> limit(const Json& value) {
  if (!value.is(Json::Kind::number)) return std::nullopt;
  return static_cast<float>(value.number);
}

inline std::size_t neighbours_of(const Json& view) {
  const double count = member(view, "neighbours", Json::Kind::number).number;
  if (!(count >= 1 && count <= kMostNeighbours)) {
    throw std::runtime_error("its neighbourhoods are of no possible size");
  }
  return static_cast<std::size_t>(count);
}

inline BackProjection back_projection_of(const std::string& name) {
  if (name == "copy") return BackProjection::copy;
  if (name == "nearest range") return BackProjection::nearest_range;
  if (name == "vote") return BackProjection::vote;
  throw Unknown("its way_back is '" + name + "', which this program does not know");
}

inline RangeSpec range_spec_of(const Json& view) {
  RangeSpec range;
  range.back_projection = back_projection_of(member(view, "way_back", Json::Kind::text).text);
  const Json& grid = member(view, "grid", Json::Kind::object);
  const Json& azimuth = member(grid, "azimuth", Json::Kind::array);
  const double columns = member(grid, "columns", Json::Kind::number).number;
  if (columns >= 1 && columns <= double{Grid::kMostPixels} && azimuth.items.size() == 2) {
    range.grid.columns = static_cast<std::int64_t>(columns);
    range.grid.right = azimuth.items[0].number;
    range.grid.left = azimuth.items[1].number;
  }
  for (const Json& edge : member(grid, "edges", Json::Kind::array).items) {
    range.grid.edges.push_back(edge.number);
  }
  if (!range.grid.is_possible()) throw std::runtime_error("its grid is none that there can be");
  return range;
}

inline void read_view(const Json& view, Spec& spec) {
  const std::string kind = member(view, "kind", Json::Kind::text).text;
  if (kind == "neighbours" || kind == "isolated_points") {
    spec.neighbours = neighbours_of(view);
    spec.isolated = kind == "isolated_points";
  } else if (kind == "range") {
    spec.range = range_spec_of(view);
  } else {
    throw Unknown("its view is '" + kind + "', which this program does not know");
  }
}

inline std::vector<Bound> bounds_of(const Json& candidates) {
  std::vector<Bound> bounds;
  for (const Json& item : member(candidates, "bounds", Json::Kind::array).items) {
    bounds.push_back({member(item, "channel", Json::Kind::text).text, limit(item["least"]),
                      limit(item["most"])});
  }
  return bounds;
}

inline Spec spec_of(const Json& content) {
  // A Spec of before there was a number is of the first layout.
  const Json& schema = content["schema"];
  if (schema.is(Json::Kind::number) && schema.number > kSchema) {
    throw Unknown("its Spec is of a newer layout than this program reads");
  }
  Spec spec;
  spec.network = member(content, "network", Json::Kind::text).text;
  read_view(member(content, "view", Json::Kind::object), spec);
  for (const Json& item : member(content, "channels", Json::Kind::array).items) {
    spec.channels.push_back(item.text);
    if (item.text == "dual_return") throw Unknown("it sees 'dual_return', which derain 0.2 made");
  }
  for (const Json& item : member(content, "mean", Json::Kind::array).items) {
    spec.mean.push_back(static_cast<float>(item.number));
  }
  if (spec.channels.empty() || spec.mean.size() != spec.channels.size()) {
    throw std::runtime_error("its channels and their means differ in number");
  }
  if (content["threshold"].is(Json::Kind::number)) {
    spec.threshold = static_cast<float>(content["threshold"].number);
  }
  if (content["candidates"].is(Json::Kind::object)) {
    spec.candidates = bounds_of(content["candidates"]);
  }
  return spec;
}

}  // namespace detail

// All that stands in a model's metadata under the key `derain`.
inline Json read_metadata(const std::string& model, const std::string& text) {
  try {
    return JsonReader(text).document();
  } catch (const std::runtime_error& error) {
    throw InputError(model, error.what(), "Give a model written by `derain export`.");
  }
}

// The Spec in it.
inline Spec read_spec(const std::string& model, const std::string& text) {
  const Json document = read_metadata(model, text);
  try {
    return detail::spec_of(detail::member(document, "spec", Json::Kind::object));
  } catch (const Unknown& error) {
    throw InputError(model, error.what(), "Run it with derain.");
  } catch (const std::runtime_error& error) {
    throw InputError(model, error.what(), "Give a model written by `derain export`.");
  }
}

// What a network of a Spec takes.
inline std::vector<InputType> inputs_of(const Spec& spec) {
  const auto channels = static_cast<std::int64_t>(spec.channels.size());
  if (spec.range) {
    const std::int64_t height = spec.range->grid.rows();
    const std::int64_t width = spec.range->grid.columns;
    return {{"image", Element::real, {1, channels, height, width}},
            {"valid", Element::truth, {1, 1, height, width}}};
  }
  const auto k = static_cast<std::int64_t>(spec.neighbours);
  if (spec.isolated) {
    return {{"points", Element::real, {kVarying, 3}},
            {"cell", Element::whole, {kVarying}},
            {"distances", Element::real, {kVarying, k}},
            {"neighbours", Element::whole, {kVarying, k}},
            {"step", Element::real, {1}},
            {"counts", Element::real, {1, kShells, kIntensityRanks}}};
  }
  std::vector<InputType> inputs = {{"points", Element::real, {kVarying, channels}},
                                   {"distances", Element::real, {kVarying, k}},
                                   {"neighbours", Element::whole, {kVarying, k}}};
  if (spec.candidates) inputs.push_back({"candidates", Element::whole, {kVarying, k}});
  return inputs;
}

}  // namespace derain
