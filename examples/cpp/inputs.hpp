// The inputs of a network: tensors, and their declarations in the graph.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace derain {

enum class Element { real, whole, truth };  // float32, int64, bool

// A size that differs from scan to scan.
constexpr std::int64_t kVarying = -1;

struct InputType {
  std::string name;
  Element element;
  std::vector<std::int64_t> shape;
};

// One that has its numbers, which belong to the view that it is an input of.
struct Input {
  InputType type;
  void* numbers;
  std::size_t bytes;
};

// A matrix over the numbers of a view, with a given number of columns.
template <typename Number>
Input matrix(const char* name, Element element, std::vector<Number>& numbers,
             std::size_t columns) {
  const auto rows = static_cast<std::int64_t>(numbers.size() / columns);
  return {{name, element, {rows, static_cast<std::int64_t>(columns)}},
          numbers.data(),
          numbers.size() * sizeof(Number)};
}

}  // namespace derain
