#pragma once
#include <chrono>
#include <vector>

#include "common/kin/arm.h"
#include "common/kin/table.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/foxglove/transform.pb.h"

namespace mimesis::model {

/// Scene for viewers of logs: the table in frame "world", the arm's safety balls in "arm/0" ..
/// "arm/n", the object in "object". Entities are locked to their frames, so they are sent once and
/// moved by transforms.
foxglove::SceneUpdate to_entities(const kin::Table& table, const kin::ArmModel& arm,
                                  std::chrono::nanoseconds stamp);

/// Frames "arm/0" .. "arm/n" (`X` of kin::forward, may be empty), "tool" if X is not, "object" and
/// "goal/NAME" in "world".
foxglove::FrameTransforms to_transforms(const kin::ArmModel& arm,
                                        const std::vector<Eigen::Isometry3d>& X,
                                        const Eigen::Isometry3d& X_WO,
                                        const std::vector<kin::GoalPlace>& goals,
                                        std::chrono::nanoseconds stamp);

/// The arm as it looks: link i as a rod from joint to joint in frame "robot/i", the hand in frame
/// "robot/tool". Thinner than its safety balls. `closure`: of the hand, 0 open .. 1 closed [1].
foxglove::SceneUpdate to_robot(const kin::ArmModel& arm, double closure,
                               std::chrono::nanoseconds stamp);

/// Frames "robot/0" .. "robot/n" (`X` of kin::forward) and "robot/tool" in "world".
foxglove::FrameTransforms to_robot_frames(const kin::ArmModel& arm,
                                          const std::vector<Eigen::Isometry3d>& X,
                                          std::chrono::nanoseconds stamp);

}  // namespace mimesis::model
