#pragma once
#include <string>

namespace mimesis::tool {

/// A new folder that goes with this object, and all in it.
class TemporaryFolder {
 public:
  /// @throws std::runtime_error if it cannot be made.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace mimesis::tool
