// Writes what a network would take of a scan, without running any: it needs no onnxruntime, and
// shows whether a reader of one's own sees what derain sees.
//
//     show_view METADATA.json SCAN.bin OUT
//
// METADATA.json is the text under the model's metadata key `derain`. OUT/<input> has the numbers of
// each input, row by row; of the way back, OUT/first and OUT/inverse have those of neighbourhoods,
// OUT/pixel and OUT/winner those of an image.

#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

#include "isolated_points.hpp"
#include "neighbour_view.hpp"
#include "range_view.hpp"

namespace {

template <typename Number>
void write(const std::filesystem::path& path, const Number* numbers, std::size_t count) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(numbers),
             static_cast<std::streamsize>(count * sizeof(Number)));
  if (!file) throw derain::InputError(path.string(), "it cannot be written", "Check the folder.");
}

void write_inputs(const std::filesystem::path& out, const std::vector<derain::Input>& inputs) {
  for (const derain::Input& input : inputs) {
    write(out / input.type.name, static_cast<const char*>(input.numbers), input.bytes);
  }
}

// What a network takes of points of the scan, and the way back to its rows.
template <typename View>
void write_points(const std::filesystem::path& out, View view) {
  write_inputs(out, view.inputs());
  write(out / "first", view.first.data(), view.first.size());
  write(out / "inverse", view.inverse.data(), view.inverse.size());
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 4) {
    std::cerr << "usage: show_view METADATA.json SCAN.bin OUT\n";
    return 2;
  }
  try {
    std::ifstream file(arguments[1]);
    const std::string metadata{std::istreambuf_iterator<char>(file), {}};
    const derain::Spec spec = derain::read_spec(arguments[1], metadata);
    const derain::Scan scan = derain::read_scan(arguments[2]);
    const std::filesystem::path out(arguments[3]);
    std::filesystem::create_directories(out);
    if (spec.range) {
      derain::RangeView view = derain::range_view(scan, spec, 2);
      write_inputs(out, view.inputs());
      write(out / "pixel", view.pixel.data(), view.pixel.size());
      write(out / "winner", view.winner.data(), view.winner.size());
    } else if (spec.isolated) {
      write_points(out, derain::isolated_points(scan, spec, 2));
    } else {
      write_points(out, derain::neighbour_view(scan, spec, 2));
    }
  } catch (const std::exception& error) {
    std::cerr << "show_view: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
