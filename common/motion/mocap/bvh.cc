#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/readers.h"

namespace mimesis::mocap {
namespace {

struct Channel {
  int joint = 0, axis = 0;  // axis of this project
  bool position = false;
};

// Offsets and positions are in this project's axes and the file's unit until the end.
struct Bvh {
  Skeleton skeleton;
  std::vector<Channel> channels;  // in the order of the columns of MOTION
  std::vector<int> position_row;  // row of a joint in `positions`, -1: none
  Eigen::MatrixXd positions;      // 3 rows for a joint that has position channels
  Clip clip;
};

Channel channel_of(TextScanner& in, int joint) {
  static constexpr std::array<std::string_view, 6> kNames = {"Xposition", "Yposition", "Zposition",
                                                             "Xrotation", "Yrotation", "Zrotation"};
  const std::string_view name = in.word();
  for (int k = 0; k < 6; ++k) {
    if (same_word(name, kNames[static_cast<std::size_t>(k)])) {
      return {joint, from_file_axis(k % 3), k < 3};
    }
  }
  in.fail_found(name, "a channel: X, Y or Z before position or rotation");
}

void read_channels(TextScanner& in, Bvh& bvh, int joint) {
  const long count = in.integer();
  if (count < 0 || count > 6) in.fail_found(std::to_string(count), "0 to 6 channels");
  const std::size_t first = bvh.channels.size();
  for (long k = 0; k < count; ++k) {
    const Channel channel = channel_of(in, joint);
    for (std::size_t i = first; i < bvh.channels.size(); ++i) {
      const Channel& other = bvh.channels[i];
      if (channel.position && other.position && other.axis == channel.axis) {
        in.fail("a position channel for the second time in joint '" +
                bvh.skeleton.joints[static_cast<std::size_t>(joint)].name + "'");
      }
    }
    bvh.channels.push_back(channel);
  }
}

Eigen::Vector3d read_offset(TextScanner& in) {
  in.expect("OFFSET");
  const double x = in.number(), y = in.number(), z = in.number();
  return from_file_axes({x, y, z});
}

int open_joint(TextScanner& in, Bvh& bvh, int parent) {
  Joint joint{std::string(in.rest_of_line()), parent, Eigen::Vector3d::Zero()};
  if (joint.name.empty()) in.fail_found("", "the name of a joint");
  in.expect("{");
  joint.offset_m = read_offset(in);
  bvh.skeleton.joints.push_back(std::move(joint));
  const int index = static_cast<int>(bvh.skeleton.joints.size()) - 1;
  if (same_word(in.peek(), "CHANNELS")) {
    in.expect("CHANNELS");
    read_channels(in, bvh, index);
  }
  return index;
}

void read_end(TextScanner& in, Bvh& bvh, int parent) {
  in.rest_of_line();  // "Site", followed by any text
  in.expect("{");
  const std::string name = bvh.skeleton.joints[static_cast<std::size_t>(parent)].name + "_end";
  bvh.skeleton.ends.push_back({name, parent, read_offset(in)});
  in.expect("}");
}

void read_hierarchy(TextScanner& in, Bvh& bvh) {
  in.expect("HIERARCHY");
  in.expect("ROOT");
  int joint = open_joint(in, bvh, -1);
  while (joint >= 0) {  // no recursion: a file may nest as deeply as it likes
    const std::string_view word = in.word();
    if (same_word(word, "JOINT")) {
      joint = open_joint(in, bvh, joint);
    } else if (same_word(word, "End") || same_word(word, "EndSite")) {
      read_end(in, bvh, joint);
    } else if (word == "}") {
      joint = bvh.skeleton.joints[static_cast<std::size_t>(joint)].parent;
    } else {
      in.fail_found(word, "JOINT, End Site or '}'");
    }
  }
}

double rate_of(TextScanner& in) {
  const double time_s = in.labelled_number("frametime");
  if (!(time_s > 1e-6 && time_s < 1e6)) in.fail("frame time, expected seconds above zero");
  const double rate_hz = 1.0 / time_s, whole = std::round(rate_hz);
  return whole >= 1.0 && std::abs(rate_hz - whole) < 1e-4 * whole ? whole : rate_hz;
}

// Sizes everything, once the counts are seen to fit the text that is left.
void prepare(TextScanner& in, Bvh& bvh, std::size_t frames, const std::string& file) {
  const std::size_t joints = bvh.skeleton.joints.size();
  bvh.position_row.assign(joints, -1);
  int rows = 0;
  for (const Channel& channel : bvh.channels) {
    int& row = bvh.position_row[static_cast<std::size_t>(channel.joint)];
    if (channel.position && row < 0) row = 3 * rows++;
  }
  if (bvh.channels.empty()) in.fail("no joint has a channel, expected a motion");
  if (frames > (in.bytes_left() + 1) / (2 * bvh.channels.size())) {
    in.fail(std::to_string(frames) + " frames of " + std::to_string(bvh.channels.size()) +
            " numbers, but only " + std::to_string(in.bytes_left()) + " bytes are left");
  }
  check_clip_size(file, in.size(), joints, frames);
  const auto columns = static_cast<Eigen::Index>(frames);
  bvh.positions.resize(3 * rows, columns);
  for (std::size_t j = 0; j < joints; ++j) {
    if (bvh.position_row[j] < 0) continue;
    bvh.positions.middleRows<3>(bvh.position_row[j]).colwise() = bvh.skeleton.joints[j].offset_m;
  }
  bvh.clip.rotation_rad.resize(3 * static_cast<Eigen::Index>(joints), columns);
}

void read_frame(TextScanner& in, Bvh& bvh, Eigen::Index frame) {
  if (!in.next_line()) {
    in.fail_found("", "frame " + std::to_string(frame + 1) + " of " +
                          std::to_string(bvh.clip.rotation_rad.cols()));
  }
  std::size_t c = 0;
  for (std::size_t j = 0; j < bvh.skeleton.joints.size(); ++j) {
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    for (; c < bvh.channels.size() && bvh.channels[c].joint == static_cast<int>(j); ++c) {
      const Channel& channel = bvh.channels[c];
      const double value = in.number_in_line();
      if (channel.position) {
        bvh.positions(bvh.position_row[j] + channel.axis, frame) = value;
      } else {  // each turns about the axes that those before it have turned
        rotation = rotation * turn_about(channel.axis, std::remainder(value, 360.0) * kRadians);
      }
    }
    put_rotation(bvh.clip.rotation_rad, static_cast<Eigen::Index>(j), frame, rotation);
  }
  in.expect_line_end(" after " + std::to_string(bvh.channels.size()) + " numbers, one a channel");
}

void read_motion(TextScanner& in, Bvh& bvh, const std::string& file) {
  in.expect("MOTION");
  const double count = in.labelled_number("frames");
  bvh.clip.rate_hz = rate_of(in);
  const std::size_t frames = in.lines_left();
  if (frames < 1) in.fail_found(in.word(), "one frame or more");
  if (static_cast<double>(frames) != count) {
    bvh.clip.notes.push_back(fmt::format("{} frames are there, not {}", frames, count));
  }
  prepare(in, bvh, frames, file);
  for (std::size_t f = 0; f < frames; ++f) read_frame(in, bvh, static_cast<Eigen::Index>(f));
}

// Joint 1 is the root's only child: root and child become one, where the child is.
void join_root(Bvh& bvh) {
  Clip& clip = bvh.clip;
  const auto child_position = bvh.positions.middleRows<3>(bvh.position_row[1]);
  Eigen::MatrixXd rotation = clip.rotation_rad.bottomRows(clip.rotation_rad.rows() - 3);
  for (Eigen::Index t = 0; t < clip.frames(); ++t) {
    const Eigen::Matrix3d R_WR = math::exp_so3(clip.rotation_rad.col(t).head<3>());
    const Eigen::Matrix3d R_RJ = math::exp_so3(clip.rotation_rad.col(t).segment<3>(3));
    clip.root_position_W_m.col(t) += R_WR * child_position.col(t);
    put_rotation(rotation, 0, t, Eigen::Quaterniond(Eigen::Matrix3d(R_WR * R_RJ)));
  }
  clip.rotation_rad = std::move(rotation);
  Skeleton& skeleton = bvh.skeleton;
  skeleton.joints.erase(skeleton.joints.begin());
  for (Joint& joint : skeleton.joints) --joint.parent;
  for (Joint& end : skeleton.ends) --end.parent;
  bvh.position_row.erase(bvh.position_row.begin());
}

bool only_child(const Skeleton& skeleton) {
  const auto of_root = [](const Joint& joint) { return joint.parent == 0; };
  return skeleton.joints.size() > 1 &&
         std::count_if(skeleton.joints.begin(), skeleton.joints.end(), of_root) == 1 &&
         std::none_of(skeleton.ends.begin(), skeleton.ends.end(), of_root);
}

// The roots become one. Offsets are the positions of frame 0.
void settle_roots(Bvh& bvh) {
  Clip& clip = bvh.clip;
  clip.root_position_W_m.resize(3, clip.frames());
  if (bvh.position_row[0] >= 0) {
    clip.root_position_W_m = bvh.positions.middleRows<3>(bvh.position_row[0]);
  } else {
    clip.root_position_W_m.colwise() = bvh.skeleton.joints[0].offset_m;
  }
  const auto is_placed = [&](int joint) {  // by all three channels
    return std::ranges::count_if(bvh.channels, [joint](const Channel& channel) {
             return channel.position && channel.joint == joint;
           }) == 3;
  };
  for (int child = 1; only_child(bvh.skeleton) && is_placed(child); ++child) join_root(bvh);
  bvh.skeleton.joints[0].offset_m.setZero();
  for (std::size_t j = 1; j < bvh.skeleton.joints.size(); ++j) {
    if (bvh.position_row[j] < 0) continue;
    bvh.skeleton.joints[j].offset_m = bvh.positions.block<3, 1>(bvh.position_row[j], 0);
  }
}

std::vector<Eigen::Matrix3Xd> positions_of(const Bvh& bvh) {
  std::vector<Eigen::Matrix3Xd> positions(bvh.position_row.size());
  for (std::size_t j = 1; j < positions.size(); ++j) {
    if (bvh.position_row[j] >= 0) positions[j] = bvh.positions.middleRows<3>(bvh.position_row[j]);
  }
  return positions;
}

double usual_unit_m(const Skeleton& skeleton) {
  const bool cmu = skeleton.find("Hips") == 0 && skeleton.find("LHipJoint") > 0 &&
                   skeleton.find("RHipJoint") > 0;
  return cmu ? kCmuUnit_m : 0.01;
}

}  // namespace

Clip parse_bvh(std::string_view text, const std::string& file, const ReadOptions& options) {
  check_options(options);
  Bvh bvh;
  TextScanner in(text, file);
  read_hierarchy(in, bvh);
  read_motion(in, bvh, file);
  settle_roots(bvh);
  Clip& clip = bvh.clip;
  clip.name = base_name(file);
  clip.skeleton = std::move(bvh.skeleton);
  settle_clip(file, options, usual_unit_m(clip.skeleton), positions_of(bvh), clip);
  return std::move(bvh.clip);
}

}  // namespace mimesis::mocap
