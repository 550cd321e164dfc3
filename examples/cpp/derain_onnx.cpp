// Cleans scans with a model that `derain export` wrote:
//
//     derain_onnx [--threads N] MODEL.onnx OUT SCAN.bin...
//
// For each scan, OUT/<stem>.label (uint32 per row, 1 = rain) and OUT/<stem>.bin (the other rows),
// and a line with the number of points of rain and the time of each stage.
// docs/onnx_contract.md specifies the steps.

#include <algorithm>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "derainer.hpp"

namespace {

namespace fs = std::filesystem;

// As in derain: a million threads take all memory.
constexpr int kMostThreads = 1024;

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

void clean(derain::Derainer& derainer, const fs::path& path, const fs::path& out) {
  const fs::path cleaned_path = out / path.filename().replace_extension(".bin");
  if (fs::exists(cleaned_path) && fs::equivalent(path, cleaned_path)) {
    throw derain::InputError(path.string(), "it would be overwritten", "Give another folder.");
  }
  const derain::Scan scan = derain::read_scan(path);
  derain::Times times;
  const std::vector<float> probability = derainer.probability(scan, times);
  std::vector<std::uint32_t> label(scan.size());
  std::vector<float> cleaned;
  for (std::size_t row = 0; row < scan.size(); ++row) {
    label[row] = probability[row] > derainer.spec().threshold ? 1 : 0;
    if (label[row] == 0) {
      cleaned.insert(cleaned.end(), scan.row(row), scan.row(row) + derain::kColumns);
    }
  }
  write(out / path.filename().replace_extension(".label"), label);
  write(cleaned_path, cleaned);
  std::cout << path.string() << ": " << scan.size() << " points, "
            << std::count(label.begin(), label.end(), 1U) << " rain, view " << std::fixed
            << std::setprecision(1) << times.view << " ms, network " << times.network
            << " ms, back " << times.back << " ms\n";
}

// Results are named by the scans alone, whatever folders these lie in.
void refuse_equal_names(const std::vector<std::string>& scans) {
  std::map<fs::path, std::string> named;
  for (const std::string& scan : scans) {
    const std::string& first = named.emplace(fs::path(scan).stem(), scan).first->second;
    if (scan != first) {
      throw derain::InputError(scan, "another scan has its name, and their results would too",
                               "Clean it into another folder.");
    }
  }
}

// How many threads were asked for; every core where nothing or 0 was.
unsigned threads_in(const std::string& text) {
  std::size_t end = 0;
  int asked = -1;
  try {
    asked = std::stoi(text, &end);
  } catch (const std::exception&) {
  }
  if (asked < 0 || asked > kMostThreads || end != text.size()) {
    throw derain::InputError("--threads", "'" + text + "' is no number of threads",
                             "Give 0 for every core.");
  }
  return asked > 0 ? static_cast<unsigned>(asked) : std::max(1U, std::thread::hardware_concurrency());
}

}  // namespace

int main(int count, char** arguments) {
  std::vector<std::string> words(arguments + 1, arguments + count);
  try {
    std::string threads = "0";
    if (words.size() >= 2 && words[0] == "--threads") {
      threads = words[1];
      words.erase(words.begin(), words.begin() + 2);
    }
    if (words.size() < 3) {
      std::cerr << "usage: derain_onnx [--threads N] MODEL.onnx OUT SCAN.bin...\n";
      return 2;
    }
    const std::vector<std::string> scans(words.begin() + 2, words.end());
    refuse_equal_names(scans);
    derain::Derainer derainer(words[0], threads_in(threads));
    const fs::path out(words[1]);
    fs::create_directories(out);
    for (const std::string& scan : scans) clean(derainer, scan, out);
  } catch (const std::exception& error) {
    std::cerr << "derain_onnx: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
