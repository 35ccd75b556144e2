#pragma once
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/cycles.h"
#include "common/motion/model/motion_model.h"
#include "common/motion/retarget/to_robot.h"

namespace mimesis::tool {

struct RobotChoice {
  std::string file;  ///< its description, such as biped.yaml; empty: no robot
  /// Margin at both ends of every joint when clips are retargeted, a quarter of its range at most:
  /// for the overshoot of the mixture [rad].
  double limit_margin_rad = 0.05;
};

/// What retargeting did to a clip.
struct RetargetedClip {
  std::string file;
  long frames = 0;
  retarget::RobotReport report;          ///< limits are those with the margin, speeds the robot's
  retarget::Deviation ankle_m, wrist_m;  ///< deviations of the figure in the model (figure_clip())
};

struct TrialFileOptions {
  mocap::ReadOptions read;
  mocap::CycleOptions cut;
  std::map<std::string, std::string> styles;  ///< by file name without folder, for all its trials
  std::string licence;                        ///< licence of the files, as stated by the user
  bool markers_legs_only = false;             ///< C3D: the legs' markers are enough
  RobotChoice robot;
};

/// Contents of the files of a command line.
struct TrialFiles {
  mocap::Trials set;
  /// Mean over the clips; the robot's; the standard body if there is no clip.
  mocap::Body body;
  bool standard_body = false;
  std::vector<motion::Source> files;
  struct LeftOut {
    std::string file, reason;
  };
  std::vector<LeftOut> left_out;   ///< clips without a trial, markers that are not a person's
  std::vector<std::string> notes;  ///< "file: what its reader took or mended", for the user
  std::vector<RetargetedClip> retargeted;
  std::vector<std::optional<motion::RowLimits>> limits_rad;  ///< by row; empty without a robot
};

/// Reads clips (.bvh, .amc, .c3d) and sets of trials (.csv); with a robot, clips alone. @param
/// progress  called with the number of files read.
/// @throws ConfigError for files that cannot be read, figures that are not known, sets that do not
/// fit together, or if no trial is left
TrialFiles read_trial_files(const std::vector<std::string>& files, const TrialFileOptions& options,
                            const std::function<void(std::size_t)>& progress);

/// A map of joints as YAML, and back: `joints` by body joint and the toes, `axes`, `sole_rad`.
std::string body_map_text(mocap::BodyMap map);
/// @throws ConfigError "file:line:col: ...", see runtime::ParamSource
mocap::BodyMap read_body_map(const std::string& file);

/// SHA-256 of a file in hex. @throws ConfigError
std::string sha256_of(const std::string& file);

}  // namespace mimesis::tool
