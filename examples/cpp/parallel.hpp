// Work on many rows, shared out among threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <thread>
#include <vector>

namespace derain {

// Calls work(begin, end) for parts of equal size that make up 0 to `count`, each in a thread of its
// own, and waits for them all. The work must not throw, and write to its own part alone.
template <typename Work>
void in_parts(std::size_t count, unsigned threads, const Work& work) {
  const std::size_t share = count / threads + 1;
  std::vector<std::thread> workers;
  for (std::size_t begin = share; begin < count; begin += share) {
    workers.emplace_back(work, begin, std::min(begin + share, count));
  }
  work(0, std::min(share, count));
  for (std::thread& worker : workers) worker.join();
}

}  // namespace derain
