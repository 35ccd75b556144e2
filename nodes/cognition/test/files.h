#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

#include "common/runtime/param_source.h"
#include "nodes/cognition/network_file.h"

namespace mimesis::cognition {

/// A file that is gone after the test.
struct PassingFile {
  std::string path;
  explicit PassingFile(const std::string& name)
      : path(::testing::TempDir() + "mimesis_" + std::to_string(::getpid()) + "_" + name) {}
  PassingFile(const PassingFile&) = delete;
  PassingFile& operator=(const PassingFile&) = delete;
  ~PassingFile() { std::remove(path.c_str()); }

  std::string read() const {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(const std::string& content) const { std::ofstream(path) << content; }
  void replace(const std::string& from, const std::string& to) const {
    std::string content = read();
    ASSERT_NE(content.find(from), std::string::npos) << from;
    write(content.replace(content.find(from), from.size(), to));
  }
};

/// The shipped network with one change.
struct NetworkFile : PassingFile {
  NetworkFile(const std::string& from, const std::string& to) : PassingFile("network.yaml") {
    std::ifstream shipped(runtime::find_model_file(kBarFields));
    write({std::istreambuf_iterator<char>(shipped), {}});
    if (!from.empty()) replace(from, to);
  }
};

}  // namespace mimesis::cognition
