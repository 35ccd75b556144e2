#pragma once
#include <cstdlib>
#include <filesystem>
#include <string>

namespace mimesis::mocap {

/// Folder of the recordings, which are no part of the repository; may be absent.
inline std::string shared_mocap() {
  const char* shared = std::getenv("MIMESIS_SHARED");
  return (shared ? std::string(shared) : MIMESIS_SOURCE_DIR "/../shared") + "/data/mocap/";
}

#define SKIP_WITHOUT_SHARED() \
  if (!std::filesystem::exists(shared_mocap())) GTEST_SKIP() << shared_mocap() << " is absent"

}  // namespace mimesis::mocap
