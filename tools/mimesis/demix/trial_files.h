#pragma once
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "nodes/synthesizer/mocap/cycles.h"
#include "nodes/synthesizer/mocap/read_clip.h"
#include "nodes/synthesizer/model/motion_model.h"

namespace mimesis::tool {

struct TrialFileOptions {
  mocap::ReadOptions read;
  mocap::CycleOptions cut;
  std::map<std::string, std::string> styles;  ///< by file name without folder, for all its trials
  std::string licence;                        ///< of the files, as the user states it
};

/// What the files of a command line hold.
struct TrialFiles {
  mocap::Trials set;
  mocap::Body body;  ///< mean over the clips; the standard body if there is no clip
  bool standard_body = false;
  std::vector<synthesizer::Source> files;
  struct LeftOut {
    std::string file, reason;
  };
  std::vector<LeftOut> left_out;  ///< clips without a trial
};

/// Reads clips (.bvh, .amc) and sets of trials (.csv). @param progress  called with the number of
/// files read.
/// @throws ConfigError for files that cannot be read, figures that are not known, sets that do not
/// fit together, or if no trial is left
TrialFiles read_trial_files(const std::vector<std::string>& files, const TrialFileOptions& options,
                            const std::function<void(std::size_t)>& progress);

/// SHA-256 of a file in hex. @throws ConfigError
std::string sha256_of(const std::string& file);

}  // namespace mimesis::tool
