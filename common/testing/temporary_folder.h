#pragma once
#include <stdlib.h>

#include <filesystem>
#include <string>

#include "common/error.h"

namespace mimesis::testing {

/// A new folder that is removed with this object.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_((std::filesystem::temp_directory_path() / "mimesis-XXXXXX").string()) {
    MIMESIS_ASSERT(mkdtemp(path_.data()) != nullptr);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }
  const std::string& string() const { return path_; }
  operator std::filesystem::path() const { return path_; }
  std::filesystem::path operator/(const std::filesystem::path& name) const {
    return std::filesystem::path(path_) / name;
  }

 private:
  std::string path_;
};

}  // namespace mimesis::testing
