// The Spec of a model, as far as this program uses it: docs/onnx_contract.md says the whole.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "errors.hpp"
#include "json.hpp"

namespace derain {

// The layout of a Spec that is read here, and the most neighbours that it may ask for.
constexpr double kSchema = 1;
constexpr double kMostNeighbours = 64;

// What a channel of a point that may be rain is at least, and at most.
struct Bound {
  std::string channel;
  std::optional<float> least;
  std::optional<float> most;
};

struct Spec {
  std::string network;
  std::size_t neighbours = 0;         // k, the point itself included
  std::vector<std::string> channels;  // in the order of the columns of the input `points`
  std::vector<float> mean;            // stands in for what a scan lacks, by channel
  float threshold = 0.5F;             // a point is rain where its probability is greater
  std::optional<std::vector<Bound>> candidates;
};

namespace detail {

inline const Json& member(const Json& of, const std::string& key, Json::Kind kind) {
  const Json& value = of[key];
  if (!value.is(kind)) throw std::runtime_error("its Spec has no proper '" + key + "'");
  return value;
}

inline std::optional<float> limit(const Json& value) {
  if (!value.is(Json::Kind::number)) return std::nullopt;
  return static_cast<float>(value.number);
}

inline std::size_t neighbours_of(const Json& view) {
  const std::string kind = member(view, "kind", Json::Kind::text).text;
  if (kind != "neighbours") {
    throw std::runtime_error("its view is '" + kind + "', and this program knows 'neighbours'");
  }
  const double count = member(view, "neighbours", Json::Kind::number).number;
  if (!(count >= 1 && count <= kMostNeighbours)) {
    throw std::runtime_error("its neighbourhoods are of no possible size");
  }
  return static_cast<std::size_t>(count);
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
    throw std::runtime_error("its Spec is of a newer layout than this program reads");
  }
  Spec spec;
  spec.network = member(content, "network", Json::Kind::text).text;
  spec.neighbours = neighbours_of(member(content, "view", Json::Kind::object));
  for (const Json& item : member(content, "channels", Json::Kind::array).items) {
    spec.channels.push_back(item.text);
    // It is made from both returns of a ray, which this program does not pair.
    if (item.text == "dual_return") throw std::runtime_error("it sees the channel 'dual_return'");
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

// The Spec in the text that stands in a model's metadata under the key `derain`.
inline Spec read_spec(const std::string& model, const std::string& metadata) {
  try {
    const Json document = JsonReader(metadata).document();
    return detail::spec_of(detail::member(document, "spec", Json::Kind::object));
  } catch (const std::runtime_error& error) {
    throw InputError(model, error.what(), "Give a model written by `derain export`.");
  }
}

}  // namespace derain
