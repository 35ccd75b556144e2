#pragma once
#include <fstream>
#include <iterator>
#include <string>

namespace mimesis::model {

inline const std::string kModels = std::string(MIMESIS_SOURCE_DIR) + "/models/";

inline std::string slurp(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace mimesis::model
