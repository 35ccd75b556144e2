#pragma once
#include <string>

#include "common/testing/temporary_folder.h"
#include "nodes/synthesizer/test/models.h"

namespace mimesis::synthesizer::testing {

/// A synthetic model as a file, until the end of the test program.
class ModelFile {
 public:
  explicit ModelFile(motion::MotionModel model) {
    model.name = "three";
    motion::save_motion_model(model, path());
  }

  std::string path() const { return (folder_ / "three.motion.json").string(); }
  std::string folder() const { return folder_.string(); }

 private:
  mimesis::testing::TemporaryFolder folder_;
};

}  // namespace mimesis::synthesizer::testing
