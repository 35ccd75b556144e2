#pragma once
#include <string>
#include <vector>

namespace mimesis::tool {

struct RunOptions {
  std::string network;
  std::vector<std::string> inputs;  ///< "NAME:FIELD[=SITE]@FROM-TO", times in s
  std::vector<std::string> recall;  ///< the same, after the training
  int train = 0;                    ///< presentations of `inputs` before
  double seconds = 2.0;
  bool json = false;
};

/// Runs the fields of a network and prints what became active.
int run_fields(const RunOptions& options);

}  // namespace mimesis::tool
