// An exported network on a CPU by onnxruntime's C++ API.
#pragma once

#include <onnxruntime_cxx_api.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "checksum.hpp"
#include "inputs.hpp"
#include "spec.hpp"

namespace derain {

class Network {
 public:
  Network(const std::filesystem::path& path, unsigned threads)
      : name_(path.string()), session_(opened(path, threads)), spec_(read_spec(name_, metadata())) {
    refuse_other_inputs();
  }

  const Spec& spec() const { return spec_; }

  // The probability of rain of each cell of a view.
  std::vector<float> probability(const std::vector<Input>& inputs, std::size_t cells) {
    if (cells == 0) return {};
    const auto logits = run(inputs, cells);
    std::vector<float> result(cells);
    for (std::size_t cell = 0; cell < cells; ++cell) {
      // A softmax over two scores, in a form that overflows for none.
      const double margin = double{logits[2 * cell + 1]} - double{logits[2 * cell]};
      result[cell] = static_cast<float>(0.5 + 0.5 * std::tanh(0.5 * margin));
      if (!std::isfinite(margin)) throw failure("its scores are not finite");
    }
    return result;
  }

 private:
  Ort::Session opened(const std::filesystem::path& path, unsigned threads) {
    std::ifstream file(path, std::ios::binary);
    if (!file || !std::filesystem::is_regular_file(path)) {
      throw InputError(name_, "there is no such file, or it cannot be read", "Check the path.");
    }
    // From 1.29 on, onnxruntime reports every model that it opens to its makers.
    environment_.DisableTelemetryEvents();
    const std::string content{std::istreambuf_iterator<char>(file), {}};
    try {
      Ort::Session session = of_bytes(content, threads);
      refuse_changed(content, metadata_of(session));
      return session;
    } catch (const Ort::Exception& error) {
      throw failure(error.what());
    }
  }

  Ort::Session of_bytes(const std::string& content, unsigned threads) {
    Ort::SessionOptions options;
    options.SetIntraOpNumThreads(static_cast<int>(threads));
    options.SetInterOpNumThreads(1);
    // Threads may spin while the network runs; after it, the cores are for the next scan's view.
    options.AddConfigEntry("session.force_spinning_stop", "1");
    try {
      return Ort::Session(environment_, content.data(), content.size(), options);
    } catch (const Ort::Exception& error) {
      if (error.GetOrtErrorCode() != ORT_NOT_IMPLEMENTED) throw;
    }
    // Before 1.27, onnxruntime makes of a matrix product in float64 one that it cannot compute.
    options.AddConfigEntry("optimization.disable_specified_optimizers", "MatmulTransposeFusion");
    return Ort::Session(environment_, content.data(), content.size(), options);
  }

  std::string metadata() { return metadata_of(session_); }

  std::string metadata_of(Ort::Session& session) {
    const auto text =
        session.GetModelMetadata().LookupCustomMetadataMapAllocated("derain", allocator_);
    if (!text) throw failure("it has no Spec");
    return text.get();
  }

  void refuse_changed(const std::string& content, const std::string& metadata) const {
    const Json known = read_metadata(name_, metadata);
    if (is_early(known)) return;
    const std::string stated = known["sha256"].text;
    if (stated.empty() || checksum_of(content, stated) != stated) {
      throw InputError(name_, "it is not as it was exported: its checksum differs or is missing",
                       "Copy or export it again.");
    }
  }

  // What the graph takes must be what the Spec's view gives.
  void refuse_other_inputs() {
    const std::vector<InputType> wanted = inputs_of(spec_);
    bool same = session_.GetInputCount() == wanted.size();
    for (std::size_t input = 0; same && input < wanted.size(); ++input) {
      const std::string name = session_.GetInputNameAllocated(input, allocator_).get();
      const auto type = session_.GetInputTypeInfo(input);
      const auto tensor = type.GetTensorTypeAndShapeInfo();
      const auto is_this = [&](const InputType& one) {
        return one.name == name && element_type(one.element) == tensor.GetElementType() &&
               one.shape == tensor.GetShape();
      };
      same = std::any_of(wanted.begin(), wanted.end(), is_this);
    }
    if (!same) throw failure("its network takes other inputs than its Spec names");
  }

  static ONNXTensorElementDataType element_type(Element element) {
    switch (element) {
      case Element::real: return ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT;
      case Element::whole: return ONNX_TENSOR_ELEMENT_DATA_TYPE_INT64;
      default: return ONNX_TENSOR_ELEMENT_DATA_TYPE_BOOL;
    }
  }

  // The logits, two for each cell: of "not rain", of "rain".
  std::vector<float> run(const std::vector<Input>& inputs, std::size_t cells) {
    std::vector<const char*> names;
    std::vector<Ort::Value> values;
    for (const Input& input : inputs) {
      names.push_back(input.type.name.c_str());
      values.push_back(Ort::Value::CreateTensor(memory_, input.numbers, input.bytes,
                                                input.type.shape.data(), input.type.shape.size(),
                                                element_type(input.type.element)));
    }
    const char* output = "logits";
    try {
      const auto outputs = session_.Run(Ort::RunOptions{nullptr}, names.data(), values.data(),
                                        values.size(), &output, 1);
      const auto tensor = outputs[0].GetTensorTypeAndShapeInfo();
      const std::vector<std::int64_t> wanted = {static_cast<std::int64_t>(cells), 2};
      if (tensor.GetShape() != wanted ||
          tensor.GetElementType() != ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT) {
        throw failure("it gives not two scores for every point");
      }
      const float* scores = outputs[0].GetTensorData<float>();
      return {scores, scores + 2 * cells};
    } catch (const Ort::Exception& error) {
      throw failure(error.what());
    }
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
