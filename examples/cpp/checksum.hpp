// The checksum that an exported file carries of itself: SHA-256.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "json.hpp"
#include "spec.hpp"

namespace derain {
namespace detail {

using Words = std::array<std::uint32_t, 8>;

inline std::uint32_t rotated(std::uint32_t word, int by) { return word >> by | word << (32 - by); }

// The first 32 bits behind the point.
inline std::uint32_t fraction(double number) {
  return static_cast<std::uint32_t>(std::ldexp(number - std::floor(number), 32));
}

struct Constants {
  Words start;                         // of the square roots of the first 8 primes
  std::array<std::uint32_t, 64> round;  // of the cube roots of the first 64 primes

  Constants() {
    std::size_t found = 0;
    for (int number = 2; found < round.size(); ++number) {
      bool prime = true;
      for (int divisor = 2; divisor * divisor <= number; ++divisor) {
        prime = prime && number % divisor != 0;
      }
      if (!prime) continue;
      if (found < start.size()) start[found] = fraction(std::sqrt(number));
      round[found++] = fraction(std::cbrt(number));
    }
  }
};

// Takes the next 64 bytes in.
inline void digest(const unsigned char* block, const Constants& constants, Words& state) {
  std::array<std::uint32_t, 64> word;
  for (std::size_t at = 0; at < 16; ++at) {
    const unsigned char* bytes = block + 4 * at;
    word[at] = std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 |
               std::uint32_t{bytes[2]} << 8 | std::uint32_t{bytes[3]};
  }
  for (std::size_t at = 16; at < 64; ++at) {
    const std::uint32_t far = word[at - 15];
    const std::uint32_t near = word[at - 2];
    word[at] = word[at - 16] + (rotated(far, 7) ^ rotated(far, 18) ^ far >> 3) + word[at - 7] +
               (rotated(near, 17) ^ rotated(near, 19) ^ near >> 10);
  }
  auto [a, b, c, d, e, f, g, h] = state;
  for (std::size_t at = 0; at < 64; ++at) {
    const std::uint32_t one = h + (rotated(e, 6) ^ rotated(e, 11) ^ rotated(e, 25)) +
                              ((e & f) ^ (~e & g)) + constants.round[at] + word[at];
    const std::uint32_t other =
        (rotated(a, 2) ^ rotated(a, 13) ^ rotated(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
    h = g;
    g = f;
    f = e;
    e = d + one;
    d = c;
    c = b;
    b = a;
    a = one + other;
  }
  const Words change = {a, b, c, d, e, f, g, h};
  for (std::size_t at = 0; at < state.size(); ++at) state[at] += change[at];
}

}  // namespace detail

// SHA-256 of some bytes, in hexadecimal digits. Source: FIPS 180-4.
inline std::string sha256(std::string bytes) {
  static const detail::Constants constants;
  const std::uint64_t bits = 8 * static_cast<std::uint64_t>(bytes.size());
  bytes += '\x80';
  while (bytes.size() % 64 != 56) bytes += '\0';
  for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>(bits >> shift);
  detail::Words state = constants.start;
  for (std::size_t at = 0; at < bytes.size(); at += 64) {
    detail::digest(reinterpret_cast<const unsigned char*>(bytes.data()) + at, constants, state);
  }
  std::string text;
  for (const std::uint32_t word : state) {
    for (int shift = 28; shift >= 0; shift -= 4) text += "0123456789abcdef"[word >> shift & 15U];
  }
  return text;
}

// Whether metadata are laid out as derain 0.1 wrote them, which knew no checksum.
inline bool is_early(const Json& metadata) {
  for (const std::string& key : metadata.keys) {
    if (key != "spec" && key != "versions" && key != "proof") return false;
  }
  const std::vector<std::string>& keys = metadata["spec"].keys;
  return std::none_of(keys.begin(), keys.end(), [](const std::string& key) {
    return key == "candidates" || key == "training";
  });
}

// SHA-256 of a file with noughts where it states its checksum.
inline std::string checksum_of(std::string content, const std::string& stated) {
  const std::size_t place = content.rfind(stated);
  if (place != std::string::npos) content.replace(place, stated.size(), 64, '0');
  return sha256(std::move(content));
}

}  // namespace derain
