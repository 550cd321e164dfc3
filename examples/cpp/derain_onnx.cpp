// Cleans scans with a model that `derain export` wrote:
//
//     derain_onnx MODEL.onnx OUT SCAN.bin...
//
// For each scan, OUT/<stem>.label (uint32 per row, 1 = rain) and OUT/<stem>.bin (the other rows).
// docs/onnx_contract.md says what happens on the way.

#include <algorithm>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "network.hpp"

namespace {

namespace fs = std::filesystem;

// Written under another name first, so that nothing half-written has the right one.
template <typename Number>
void write(const fs::path& path, const std::vector<Number>& numbers) {
  const fs::path unfinished = path.string() + ".tmp";
  std::ofstream file(unfinished, std::ios::binary);
  file.write(reinterpret_cast<const char*>(numbers.data()),
             static_cast<std::streamsize>(numbers.size() * sizeof(Number)));
  file.close();
  if (!file) {
    std::error_code ignored;
    fs::remove(unfinished, ignored);
    throw derain::InputError(path.string(), "it cannot be written", "Check the folder.");
  }
  fs::rename(unfinished, path);
}

void clean(derain::Network& network, const fs::path& path, const fs::path& out, unsigned threads) {
  const fs::path cleaned_path = out / path.filename().replace_extension(".bin");
  if (fs::exists(cleaned_path) && fs::equivalent(path, cleaned_path)) {
    throw derain::InputError(path.string(), "it would be overwritten", "Give another folder.");
  }
  const derain::Scan scan = derain::read_scan(path);
  derain::NeighbourView view = derain::neighbour_view(scan, network.spec(), threads);
  const std::vector<float> probability = view.to_rows(network.probability(view));
  std::vector<std::uint32_t> label(scan.size());
  std::vector<float> cleaned;
  for (std::size_t row = 0; row < scan.size(); ++row) {
    label[row] = probability[row] > network.spec().threshold ? 1 : 0;
    if (label[row] == 0) {
      cleaned.insert(cleaned.end(), scan.row(row), scan.row(row) + derain::kColumns);
    }
  }
  write(out / path.filename().replace_extension(".label"), label);
  write(cleaned_path, cleaned);
  std::cout << path.string() << ": " << scan.size() << " points, "
            << std::count(label.begin(), label.end(), 1U) << " rain\n";
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 4) {
    std::cerr << "usage: derain_onnx MODEL.onnx OUT SCAN.bin...\n";
    return 2;
  }
  try {
    const unsigned threads = std::max(1U, std::thread::hardware_concurrency());
    derain::Network network(arguments[1], threads);
    const fs::path out(arguments[2]);
    fs::create_directories(out);
    for (int scan = 3; scan < count; ++scan) clean(network, arguments[scan], out, threads);
  } catch (const std::exception& error) {
    std::cerr << "derain_onnx: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
