#pragma once
#include <gtest/gtest.h>

#include "common/testing/process.h"

namespace mimesis::testing {

/// The program with these settings (--set) ends with exit code 2 and says `what`.
inline void refuses(const std::string& program, const std::vector<std::string>& settings,
                    const std::string& what) {
  std::vector<std::string> arguments;
  for (const std::string& setting : settings) arguments.insert(arguments.end(), {"--set", setting});
  TestGraph graph;
  Process node(graph, program, arguments);
  EXPECT_EQ(node.wait(30s), 2) << settings.back();
  EXPECT_NE(node.errors().find(what), std::string::npos) << node.errors();
}

}  // namespace mimesis::testing
