#pragma once
#include <filesystem>
#include <string>

#include "common/shared_data.h"

namespace mimesis::mocap {

/// Folder of the recordings, which are no part of the repository; may be absent.
inline std::string shared_mocap() { return shared_data("data/mocap/").string(); }

#define SKIP_WITHOUT_SHARED()                   \
  if (!std::filesystem::exists(shared_mocap())) \
  GTEST_SKIP() << "not here: " << shared_mocap() << " is absent"

/// A clip of known kind by its name.
inline std::string path_of(const std::string& clip) {
  const std::string kind = clip.ends_with(".amc")         ? "cmu_amc/"
                           : clip.starts_with("dataset-") ? "bandai_nc/"
                                                          : "cmu_bvh/";
  return shared_mocap() + kind + clip;
}

}  // namespace mimesis::mocap
