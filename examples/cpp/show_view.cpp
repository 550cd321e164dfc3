// Writes what a network would take of a scan, without running any: it needs no onnxruntime, and
// shows whether a reader of one's own sees what derain sees.
//
//     show_view METADATA.json SCAN.bin OUT
//
// METADATA.json is the text under the model's metadata key `derain`. OUT/<input> has the numbers of
// each input, row by row, and OUT/first and OUT/inverse those of the way back.

#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

#include "neighbour_view.hpp"

namespace {

template <typename Number>
void write(const std::filesystem::path& path, const std::vector<Number>& numbers) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(numbers.data()),
             static_cast<std::streamsize>(numbers.size() * sizeof(Number)));
  if (!file) throw derain::InputError(path.string(), "it cannot be written", "Check the folder.");
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
    const derain::NeighbourView view = derain::neighbour_view(scan, spec, 2);
    const std::filesystem::path out(arguments[3]);
    std::filesystem::create_directories(out);
    write(out / "points", view.points);
    write(out / "neighbours", view.neighbours);
    write(out / "distances", view.distances);
    write(out / "first", view.first);
    write(out / "inverse", view.inverse);
    if (view.candidates) write(out / "candidates", *view.candidates);
  } catch (const std::exception& error) {
    std::cerr << "show_view: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
