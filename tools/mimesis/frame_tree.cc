#include "tools/mimesis/frame_tree.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <limits>

#include "common/runtime/value_text.h"

namespace mimesis::tool {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// A field that the type must have.
const FieldDescriptor& field(const Message& message, const char* name) {
  const FieldDescriptor* found = message.GetDescriptor()->FindFieldByName(name);
  if (found == nullptr) {
    throw ConfigError(fmt::format("{} has no field '{}', expected a transform",
                                  message.GetDescriptor()->full_name(), name));
  }
  return *found;
}

const Message& part(const Message& message, const char* name) {
  return message.GetReflection()->GetMessage(message, &field(message, name));
}
double number(const Message& message, const char* name) {
  return message.GetReflection()->GetDouble(message, &field(message, name));
}
std::int64_t integer(const Message& message, const char* name) {
  const FieldDescriptor& f = field(message, name);
  const auto& reflection = *message.GetReflection();
  switch (f.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return reflection.GetInt32(message, &f);
    case FieldDescriptor::CPPTYPE_UINT32:
      return reflection.GetUInt32(message, &f);
    default:
      return reflection.GetInt64(message, &f);
  }
}
std::string text(const Message& message, const char* name) {
  return message.GetReflection()->GetString(message, &field(message, name));
}

FrameTransform transform_in(const Message& m) {
  const bool ros = m.GetDescriptor()->FindFieldByName("header") != nullptr;
  const Message& pose = ros ? part(m, "transform") : m;
  const Message& p = part(pose, "translation");
  const Message& q = part(pose, "rotation");
  FrameTransform out;
  out.parent = ros ? text(part(m, "header"), "frame_id") : text(m, "parent_frame_id");
  out.child = text(m, "child_frame_id");
  const Message& stamp = ros ? part(part(m, "header"), "stamp") : part(m, "timestamp");
  out.stamp_ns = 1'000'000'000 * integer(stamp, ros ? "sec" : "seconds") +
                 integer(stamp, ros ? "nanosec" : "nanos");
  const Eigen::Quaterniond R(number(q, "w"), number(q, "x"), number(q, "y"), number(q, "z"));
  out.X_PC.translation() << number(p, "x"), number(p, "y"), number(p, "z");
  if (std::abs(R.norm() - 1.0) < 1e-2) {
    out.X_PC.linear() = R.normalized().toRotationMatrix();
  } else {
    out.X_PC.matrix().setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return out;
}

/// "/base" and "base" are one frame: ROS 1 wrote the slash.
std::string frame_name(const std::string& name) {
  return name.substr(name.starts_with('/') ? 1 : 0);
}

}  // namespace

bool has_transforms(const std::string& type) {
  return type == "foxglove.FrameTransform" || type == "foxglove.FrameTransforms" ||
         type == "tf2_msgs/msg/TFMessage" || type == "tf2_msgs.msg.TFMessage";
}

std::vector<FrameTransform> transforms_in(const Message& message) {
  const FieldDescriptor* list = message.GetDescriptor()->FindFieldByName("transforms");
  if (list == nullptr) return {transform_in(message)};
  if (!list->is_repeated() || list->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
    throw ConfigError(list->full_name() + " is no list of transforms");
  }
  std::vector<FrameTransform> all;
  const auto& reflection = *message.GetReflection();
  for (int i = 0; i < reflection.FieldSize(message, list); ++i) {
    all.push_back(transform_in(reflection.GetRepeatedMessage(message, list, i)));
  }
  return all;
}

void FrameTree::add(const FrameTransform& transform, const std::string& from) {
  FrameTransform named = transform;
  named.parent = frame_name(transform.parent);
  named.child = frame_name(transform.child);
  FrameSource& source = frames_[named.child];
  if (source.count++ == 0) {
    source.first_ns = named.stamp_ns;
  } else {
    source.longest_ns = std::max(source.longest_ns, named.stamp_ns - source.last.stamp_ns);
  }
  source.from.insert(from);
  source.parents.insert(named.parent);
  source.last = std::move(named);
}

std::set<std::string> FrameTree::roots() const {
  std::set<std::string> roots;
  for (const auto& [child, source] : frames_) {
    if (!frames_.contains(source.last.parent)) roots.insert(source.last.parent);
  }
  return roots;
}

std::vector<std::string> FrameTree::children(const std::string& parent) const {
  std::vector<std::string> found;
  for (const auto& [child, source] : frames_) {
    if (source.last.parent == parent) found.push_back(child);
  }
  return found;
}

tl::expected<std::vector<std::string>, Status> FrameTree::up(const std::string& frame) const {
  std::vector<std::string> way{frame};
  for (auto at = frames_.find(frame); at != frames_.end(); at = frames_.find(way.back())) {
    const std::string& parent = at->second.last.parent;
    if (std::ranges::find(way, parent) != way.end()) {
      return tl::unexpected(
          Status{fmt::format("frame '{}' hangs from itself: {}", parent, fmt::join(way, " <- "))});
    }
    way.push_back(parent);
  }
  if (way.size() == 1 && !roots().contains(frame)) {
    std::vector<std::string> known;
    for (const auto& [child, source] : frames_) known.push_back(child);
    for (const std::string& root : roots()) known.push_back(root);
    return tl::unexpected(
        Status{"frame '" + frame + "' is unknown" + runtime::did_you_mean(frame, known)});
  }
  return way;
}

tl::expected<Eigen::Isometry3d, Status> FrameTree::pose(const std::string& from,
                                                        const std::string& to) const {
  const auto a = up(frame_name(from)), b = up(frame_name(to));
  if (!a) return tl::unexpected(a.error());
  if (!b) return tl::unexpected(b.error());
  const auto shared = std::ranges::find_first_of(*a, *b);
  if (shared == a->end()) {
    return tl::unexpected(Status{fmt::format(
        "no way from '{}' to '{}': they hang from '{}' and '{}'", from, to, a->back(), b->back())});
  }
  const auto in_shared = [&](const std::vector<std::string>& way) {
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    for (const std::string& frame : way) {
      if (frame == *shared) break;
      X = frames_.at(frame).last.X_PC * X;
    }
    return X;
  };
  return in_shared(*a).inverse() * in_shared(*b);
}

}  // namespace mimesis::tool
