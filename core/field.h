#pragma once
// What may be set: an option as it is listed for those who choose one, such as a form or a test.

#include <string>
#include <vector>

namespace rugae {

struct Field {
  enum class Kind { flag, seed, whole, real, word };
  std::string path;  // as in YAML, with dots: "sensor.noise"
  Kind kind = Kind::flag;
  double low = 0.0, high = 0.0;         // of a whole or real number
  std::vector<std::string> words = {};  // of which a word is one
};

}  // namespace rugae
