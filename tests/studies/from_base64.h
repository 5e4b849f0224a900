#pragma once
// Bytes from base64 (RFC 4648), by a way of its own.

#include <string>
#include <vector>

namespace rugae {

// A letter's value is its place in the alphabet of RFC 4648.
inline std::vector<unsigned char> from_base64(const std::string& text) {
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<unsigned char> bytes;
  unsigned bits = 0, count = 0;
  for (const char c : text) {
    const auto value = letters.find(c);
    if (value == std::string::npos) break;
    bits = (bits << 6) | static_cast<unsigned>(value);
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes.push_back(static_cast<unsigned char>((bits >> count) & 255));
    }
  }
  return bytes;
}

}  // namespace rugae
