// An exported network on a CPU by onnxruntime's C++ API.
#pragma once

#include <onnxruntime_cxx_api.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "neighbour_view.hpp"
#include "spec.hpp"

namespace derain {

class Network {
 public:
  Network(const std::filesystem::path& path, unsigned threads)
      : name_(path.string()), session_(opened(path, threads)), spec_(read_spec(name_, metadata())) {
    refuse_other_inputs();
  }

  const Spec& spec() const { return spec_; }

  // The probability of rain of each point that a view scores.
  std::vector<float> probability(NeighbourView& view) {
    if (view.scored() == 0) return {};
    const auto logits = run(view);
    std::vector<float> result(view.scored());
    for (std::size_t point = 0; point < result.size(); ++point) {
      // A softmax over two scores, in a form that overflows for none.
      const double margin = double{logits[2 * point + 1]} - double{logits[2 * point]};
      result[point] = static_cast<float>(0.5 + 0.5 * std::tanh(0.5 * margin));
      if (std::isnan(margin)) throw failure("its scores are not finite");
    }
    return result;
  }

 private:
  Ort::Session opened(const std::filesystem::path& path, unsigned threads) {
    if (!std::filesystem::is_regular_file(path)) {
      throw InputError(name_, "there is no such file", "Check the path.");
    }
    Ort::SessionOptions options;
    options.SetIntraOpNumThreads(static_cast<int>(threads));
    options.SetInterOpNumThreads(1);
    try {
      return Ort::Session(environment_, path.c_str(), options);
    } catch (const Ort::Exception& error) {
      throw failure(error.what());
    }
  }

  std::string metadata() {
    const auto text =
        session_.GetModelMetadata().LookupCustomMetadataMapAllocated("derain", allocator_);
    if (!text) throw failure("it has no Spec");
    return text.get();
  }

  // What the graph takes must be what the Spec's view gives.
  void refuse_other_inputs() {
    const auto k = static_cast<std::int64_t>(spec_.neighbours);
    constexpr auto real = ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT;
    constexpr auto whole = ONNX_TENSOR_ELEMENT_DATA_TYPE_INT64;
    std::map<std::string, std::pair<ONNXTensorElementDataType, std::int64_t>> wanted = {
        {"points", {real, static_cast<std::int64_t>(spec_.channels.size())}},
        {"distances", {real, k}},
        {"neighbours", {whole, k}}};
    if (spec_.candidates) wanted["candidates"] = {whole, k};
    std::map<std::string, std::pair<ONNXTensorElementDataType, std::int64_t>> found;
    for (std::size_t input = 0; input < session_.GetInputCount(); ++input) {
      const auto type = session_.GetInputTypeInfo(input);
      const auto tensor = type.GetTensorTypeAndShapeInfo();
      const auto shape = tensor.GetShape();
      found[session_.GetInputNameAllocated(input, allocator_).get()] = {
          tensor.GetElementType(), shape.size() == 2 ? shape[1] : -1};
    }
    if (found != wanted) throw failure("its network takes other inputs than its Spec says");
  }

  // The logits, two for each scored point: of "not rain", of "rain".
  std::vector<float> run(NeighbourView& view) {
    const auto k = static_cast<std::int64_t>(view.k);
    std::vector<const char*> names = {"points", "distances", "neighbours"};
    std::vector<Ort::Value> inputs;
    inputs.push_back(tensor(view.points, static_cast<std::int64_t>(spec_.channels.size())));
    inputs.push_back(tensor(view.distances, k));
    inputs.push_back(tensor(view.neighbours, k));
    if (view.candidates) {
      names.push_back("candidates");
      inputs.push_back(tensor(*view.candidates, k));
    }
    const char* output = "logits";
    try {
      const auto outputs = session_.Run(Ort::RunOptions{nullptr}, names.data(), inputs.data(),
                                        inputs.size(), &output, 1);
      const auto shape = outputs[0].GetTensorTypeAndShapeInfo().GetShape();
      if (shape != std::vector{static_cast<std::int64_t>(view.scored()), std::int64_t{2}}) {
        throw failure("it gives not two scores for every point");
      }
      const float* scores = outputs[0].GetTensorData<float>();
      return {scores, scores + 2 * view.scored()};
    } catch (const Ort::Exception& error) {
      throw failure(error.what());
    }
  }

  // A matrix of so many columns on numbers that stay where they are.
  template <typename Number>
  Ort::Value tensor(std::vector<Number>& numbers, std::int64_t columns) {
    const std::int64_t shape[] = {static_cast<std::int64_t>(numbers.size()) / columns, columns};
    return Ort::Value::CreateTensor<Number>(memory_, numbers.data(), numbers.size(), shape, 2);
  }

  InputError failure(const std::string& reason) const {
    return {name_, reason, "Give a model written by `derain export`."};
  }

  std::string name_;
  Ort::Env environment_{ORT_LOGGING_LEVEL_ERROR, "derain"};
  Ort::AllocatorWithDefaultOptions allocator_;
  Ort::MemoryInfo memory_ = Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeDefault);
  Ort::Session session_;
  Spec spec_;
};

}  // namespace derain
