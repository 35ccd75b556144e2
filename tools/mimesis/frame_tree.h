#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"

namespace google::protobuf {
class Message;
}

namespace mimesis::tool {

/// A transform as messages tell it: the pose of a frame in its parent.
struct FrameTransform {
  std::string parent, child;
  Eigen::Isometry3d X_PC = Eigen::Isometry3d::Identity();  ///< [m]
  std::int64_t stamp_ns = 0;
};

/// The transforms of a foxglove.FrameTransform, a FrameTransforms, or ROS's TFMessage as logs hold
/// it. A rotation that is none makes the pose NaN. @throws ConfigError for another type
std::vector<FrameTransform> transforms_in(const google::protobuf::Message& message);
/// Whether messages of this type have transforms.
bool has_transforms(const std::string& type);

/// Who says where a frame is.
struct FrameSource {
  FrameTransform last;
  std::set<std::string> from;  ///< "TOPIC (NODE)"
  std::uint64_t count = 0;
  std::int64_t first_ns = 0, longest_ns = 0;  ///< of the stamps: the first, the longest gap
  std::set<std::string> parents;              ///< that it was given
};

/// Frames by the last message of each.
class FrameTree {
 public:
  void add(const FrameTransform& transform, const std::string& from);
  const std::map<std::string, FrameSource>& frames() const { return frames_; }
  /// Frames that are parents and have none themselves.
  std::set<std::string> roots() const;
  std::vector<std::string> children(const std::string& parent) const;
  /// Pose of `to` in `from`, over the frame that both hang from. Status: one of them is unknown,
  /// they hang from different roots, or a frame hangs from itself.
  tl::expected<Eigen::Isometry3d, Status> pose(const std::string& from,
                                               const std::string& to) const;

 private:
  /// The frame and those above it. Status: it is unknown, or hangs from itself.
  tl::expected<std::vector<std::string>, Status> up(const std::string& frame) const;

  std::map<std::string, FrameSource> frames_;  ///< by child
};

}  // namespace mimesis::tool
