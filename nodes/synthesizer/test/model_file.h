#pragma once
#include <unistd.h>

#include <filesystem>
#include <string>

#include "nodes/synthesizer/test/models.h"

namespace mimesis::synthesizer::testing {

/// A synthetic model as a file, until the end of the test program.
class ModelFile {
 public:
  explicit ModelFile(motion::MotionModel model)
      : folder_(std::filesystem::temp_directory_path() /
                ("synthesizer_test_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
    model.name = "three";
    motion::save_motion_model(model, path());
  }
  ~ModelFile() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  ModelFile(const ModelFile&) = delete;
  ModelFile& operator=(const ModelFile&) = delete;

  std::string path() const { return (folder_ / "three.motion.json").string(); }
  std::string folder() const { return folder_.string(); }

 private:
  std::filesystem::path folder_;
};

}  // namespace mimesis::synthesizer::testing
