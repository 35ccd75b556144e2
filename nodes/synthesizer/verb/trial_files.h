#pragma once
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/motion/mocap/body_from_markers.h"
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

/// How C3D files are read.
struct MarkerReading {
  bool legs_only = false;      ///< the legs' markers are enough
  mocap::MarkerLabels labels;  ///< of the file; empty: found
};

struct TrialFileOptions {
  mocap::ReadOptions read;
  mocap::CycleOptions cut;
  std::map<std::string, std::string> styles;  ///< by file name without folder, for all its trials
  std::string licence;                        ///< licence of the files, as stated by the user
  MarkerReading markers;
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

/// Reads clips (.c3d, and what read_clip() reads) and sets of trials (.csv); with a robot, clips
/// alone. @param progress  called with the number of files read.
/// @throws ConfigError for files that cannot be read, figures that are not known, sets that do not
/// fit together, or if no trial is left
TrialFiles read_trial_files(const std::vector<std::string>& files, const TrialFileOptions& options,
                            const std::function<void(std::size_t)>& progress);

/// Reads a recording, .c3d or what read_clip() reads, as the 17-joint figure. Status: of markers
/// that are no person, why.
/// @param notes  gets "file: what its reader took or mended"
/// @throws ConfigError as its reader
tl::expected<mocap::BodyClip, Status> read_figure(const std::string& file,
                                                  const mocap::ReadOptions& options,
                                                  const MarkerReading& markers,
                                                  std::vector<std::string>& notes);

/// The map of a file as YAML: of a skeleton `joints` by body joint and the toes, `axes`,
/// `sole_rad`; of a C3D file `markers`, a label for each of the set.
/// @throws ConfigError as the file's reader; for one that shows no person's skeleton
std::string map_text(const std::string& file, const mocap::ReadOptions& options);
/// Reads such a file into what it is a map of. @throws ConfigError "file:line:col: ..."
void read_map(const std::string& file, mocap::ReadOptions& joints, MarkerReading& markers);

/// SHA-256 of a file in hex. @throws ConfigError
std::string sha256_of(const std::string& file);

}  // namespace mimesis::tool
