#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/kin/arm.h"
#include "common/kin/table.h"
#include "common/robot/biped.h"
#include "common/robot/convex_parts.h"
#include "proto/scene.pb.h"

namespace mimesis::model {

/// Reads an arm (models/lwr4.yaml). @throws ConfigError "file:line:col: ..." (see
/// runtime::load_params).
kin::ArmModel load_arm(const std::string& file);

/// Reads a biped (models/biped.yaml). Its `urdf` is a path from the file's folder, or
/// "shared:data/robots/NAME.urdf" for a robot that the repository may not carry
/// (common/shared_data). `frames` are links without mass that the URDF lacks. @throws ConfigError
/// as above, or as robot::read_urdf and robot::make_biped.
robot::Biped load_biped(const std::string& file);
/// Path of the URDF that a biped's file names, which exists. @throws ConfigError as above.
std::string urdf_of_biped(const std::string& file);

/// Actuators of a biped's joints, and limits that the URDF does not contain.
struct BipedDrives {
  std::string kind = "cia402";  ///< kind of actuators, as named in the bridge
  double rate_hz = 200.0;       ///< rate of commands to the joints
  /// Bound on the accelerations of all set-points: several times the need of a walk, so that its
  /// stream passes unchanged.
  double a_max_rad_s2 = 300.0;
};
/// @throws ConfigError as above.
BipedDrives drives_of_biped(const std::string& file);

/// Whether the file is a URDF, by its ending in any case.
bool is_urdf(const std::string& file);
/// Whether the file is a biped's, which names its URDF; an arm's has joints of its own.
bool is_biped(const std::string& file);
/// Rate of the commands to a robot's joints [Hz]: of an arm, a biped or a bare .urdf, which has the
/// default of BipedDrives. @throws ConfigError as above.
double rate_of_robot(const std::string& file);

/// Reads a table (models/bar_table.yaml). `bar_height`: lower edge of the bar above the table
/// [m], instead of the file's. @throws ConfigError as above.
kin::Table load_table(const std::string& file, std::optional<double> bar_height = {});

/// The same of a scene that need have neither bar nor object.
kin::Table load_scene(const std::string& file);

/// The table as a message, without header. Hulls are told by the balls that hold them.
v1::Scene to_proto(const kin::Table& table);
/// The table of a message. Positions are taken as they are; the caller has checked that they are
/// finite.
kin::Table from_proto(const v1::Scene& scene);

inline constexpr double kLeastRate_hz = 10.0, kMostRate_hz = 1000.0;  ///< of commands to joints

/// Path of the URDF `urdf_name` that the file `path` names. @throws ConfigError if there is none
std::string urdf_of(const std::string& path, const std::string& urdf_name);

/// What decides of an arm's link in one group.
struct CoveredLink {
  std::string link;  ///< of the URDF; "frame 3" of an arm without
  int group = 0, frame = 0;
  bool fitted = false;                        ///< else it is the file's own
  std::vector<math::ConvexPart> parts{};      ///< in the link's frame; of one point: balls
  std::optional<robot::OverCoverage> over{};  ///< if the link has collision geometry
};

struct CoveredArm {
  kin::ArmModel arm;
  std::vector<CoveredLink> links;
  /// Fitted links that are not checked against each other, as they touch in every posture.
  std::vector<std::pair<std::string, std::string>> always_touching;
  std::string urdf{}, base{}, tip{};  ///< of its chain: file and links; empty: none
  bool use_visual = false;            ///< links without collision geometry are as they are drawn
  robot::MeshPaths mesh_paths{};
};

/// 256 postures within the limits, one a column [rad] or [m]; equal ones for equal arms.
Eigen::MatrixXd sampled_postures(const kin::ArmModel& arm);
/// Groups that are nearer than 3 mm at posture q, lesser index first; those of neighbours, whose
/// frames one joint connects, are left out.
std::vector<std::pair<int, int>> touching_groups(const kin::ArmModel& arm,
                                                 const Eigen::VectorXd& q);

/// Reads an arm as load_arm does.
/// @param compare  its shape with the geometry of its URDF: CoveredLink::over
CoveredArm load_covered_arm(const std::string& file, bool compare = true);
/// For who judges collisions: an arm without any shape is refused, too.
CoveredArm load_checked_arm(const std::string& file);

}  // namespace mimesis::model
