#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/motion/mocap/bvh.h"
#include "common/motion/mocap/file_axes.h"
#include "common/motion/mocap/text_scanner.h"
#include "common/motion/mocap/write_text.h"

namespace mimesis::mocap {
namespace {

constexpr int kDecimals = 7;  // of ° and of the file's unit: 2e-9 rad, 1e-8 m or less
constexpr double kDegrees = 180.0 / std::numbers::pi;

struct Writer {
  const Skeleton& skeleton;
  double unit_m;
  std::string text;
  std::vector<std::size_t> order;  // of the columns: joints depth first

  void number(double value) {
    text += ' ';
    append_fixed(text, value, kDecimals);
  }
  void offset(const Eigen::Vector3d& offset_m, const std::string& indent) {
    const Eigen::Vector3d v = to_file_axes(offset_m) / unit_m;
    text += indent + "{\n" + indent + "\tOFFSET";
    for (int k = 0; k < 3; ++k) number(v[k]);
    text += '\n';
  }
  void end(const Eigen::Vector3d& offset_m, const std::string& indent) {
    text += indent + "End Site\n";
    offset(offset_m, indent);
    text += indent + "}\n";
  }
  void open(std::size_t j, const std::string& indent) {
    const Joint& joint = skeleton.joints[j];
    text += indent + (j == 0 ? "ROOT " : "JOINT ") + joint.name + '\n';
    offset(joint.offset_m, indent);
    text += indent + "\tCHANNELS ";
    text += j == 0 ? "6 Xposition Yposition Zposition " : "3 ";
    text += "Zrotation Yrotation Xrotation\n";
    order.push_back(j);
  }
  void hierarchy();
};

// Depth first without recursion: `open_joints` is the way from the root.
void Writer::hierarchy() {
  std::vector<std::vector<std::size_t>> children(skeleton.joints.size());
  std::vector<std::vector<const Joint*>> ends(skeleton.joints.size());
  for (std::size_t j = 1; j < skeleton.joints.size(); ++j) {
    children[static_cast<std::size_t>(skeleton.joints[j].parent)].push_back(j);
  }
  for (const Joint& end : skeleton.ends) ends[static_cast<std::size_t>(end.parent)].push_back(&end);
  struct Open {
    std::size_t joint, next_child;
  };
  std::vector<Open> open_joints;
  const auto enter = [&](std::size_t j) {
    const std::string indent(open_joints.size(), '\t');
    open(j, indent);
    for (const Joint* e : ends[j]) end(e->offset_m, indent + '\t');
    if (ends[j].empty() && children[j].empty()) end(Eigen::Vector3d::Zero(), indent + '\t');
    open_joints.push_back({j, 0});
  };
  text += "HIERARCHY\n";
  enter(0);
  while (!open_joints.empty()) {
    Open& top = open_joints.back();
    if (top.next_child < children[top.joint].size()) {
      enter(children[top.joint][top.next_child++]);
    } else {
      open_joints.pop_back();
      text += std::string(open_joints.size(), '\t') + "}\n";
    }
  }
}

// Angles z, y, x [°] with R = Rz·Ry·Rx. Where y is ±90° only z ∓ x counts: x is zero then.
Eigen::Vector3d angles_zyx(const Eigen::Matrix3d& R) {
  const double cos_y = std::hypot(R(0, 0), R(1, 0));
  const double y = std::atan2(-R(2, 0), cos_y);
  if (cos_y < 1e-9) return Eigen::Vector3d(std::atan2(-R(0, 1), R(1, 1)), y, 0.0) * kDegrees;
  return Eigen::Vector3d(std::atan2(R(1, 0), R(0, 0)), y, std::atan2(R(2, 1), R(2, 2))) * kDegrees;
}

void check_names(const Clip& clip) {
  for (const Joint& joint : clip.skeleton.joints) {
    const std::string& n = joint.name;
    if (n.empty() || n.find_first_of("{}\r\n") != n.npos || n.front() <= ' ' || n.back() <= ' ') {
      throw ConfigError(
          one_line(clip.name + ": joint '" + n + "', expected a name that BVH can hold"));
    }
  }
}

}  // namespace

std::string bvh_text(const Clip& clip) {
  check_writable(clip);
  check_names(clip);
  Writer out{clip.skeleton, bvh_unit_m(clip.skeleton), {}, {}};
  out.hierarchy();
  out.text += "MOTION\nFrames: " + std::to_string(clip.frames()) + "\nFrame Time: ";
  append_exact(out.text, 1.0 / clip.rate_hz);
  out.text += '\n';
  for (Eigen::Index t = 0; t < clip.frames(); ++t) {
    const Eigen::Vector3d p = to_file_axes(clip.root_position_W_m.col(t)) / out.unit_m;
    append_fixed(out.text, p.x(), kDecimals);
    out.number(p.y());
    out.number(p.z());
    for (const std::size_t j : out.order) {
      const Eigen::Vector3d w = clip.rotation_rad.block<3, 1>(3 * static_cast<Eigen::Index>(j), t);
      const Eigen::Vector3d zyx = angles_zyx(math::exp_so3(to_file_axes(w)));
      for (int k = 0; k < 3; ++k) out.number(zyx[k]);
    }
    out.text += '\n';
  }
  return std::move(out.text);
}

void write_bvh(const Clip& clip, const std::string& file) { write_bytes(file, bvh_text(clip)); }

}  // namespace mimesis::mocap
