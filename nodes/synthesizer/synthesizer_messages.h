#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nodes/synthesizer/director.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/motion.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::synthesizer {

/// Why a message cannot be obeyed, for log lines and MotionStatus.reason; empty if it can.
std::string fault(const v1::MotionGoal& goal, const Characters& characters);
std::string fault(const v1::StyleWish& wish, const Characters& characters);
std::string fault(const v1::Beat& beat);
std::string fault(const v1::GaitCommand& gait, const Characters& characters);
std::string fault(const v1::WalkFeedback& feedback);
std::string fault(const v1::HeadSight& sight);

/// Shares of all styles of the repertoire, sum 1. The wish has no fault.
std::vector<double> to_shares(const v1::StyleWish& wish, const Repertoire& repertoire);
GaitWish to_gait(const v1::GaitCommand& gait);

/// Rows of the director's character as they may be sent: within the model's joint limits.
struct LimitedMotion {
  std::span<const float> angles_rad;
  std::span<const double> velocity_rad_s;
};
/// The motion of one.
void to_proto(const Director& director, int i, const LimitedMotion& limited, v1::Motion& motion);
/// All of them, within joint limits. The lists keep their memory from message to message.
void to_proto(const Director& director, v1::MotionBatch& batch);
/// Without header. `plan`: null if there is none.
v1::MotionStatus to_proto(int i, const Progress& progress);

/// Precondition of both: the message has no fault.
RobotFeedback to_feedback(const v1::WalkFeedback& message);
/// `age_s`: since the image was taken.
DrawerSenses::Sight to_sight(const v1::HeadSight& message, double age_s);

/// By row of a model, the row of the 17-joint figure; -1: none, a robot's joint.
std::vector<int> body_rows(std::span<const std::string> rows);
/// A figure for viewers: limbs, trunk and head of an adult's thickness, in W.
void add_figure(const mocap::Body& body, const mocap::BodyPose& pose,
                foxglove::SceneEntity& entity);

/// Figures for viewers: bodies of a few, lines of many. Robots draw themselves.
class FigureDrawing {
 public:
  /// Empty if the director's rows are not those of a body, or it leads a robot.
  static std::optional<FigureDrawing> of(const Director& director);

  /// All in one entity, in W.
  foxglove::SceneUpdate draw(const Director& director, std::chrono::nanoseconds now) const;

 private:
  FigureDrawing() = default;

  std::vector<int> body_row_;  ///< by row of the model
};

}  // namespace mimesis::synthesizer
