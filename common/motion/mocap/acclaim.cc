#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <unordered_map>

#include "common/error.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/readers.h"

namespace mimesis::mocap {
namespace {

constexpr double kInch = 0.0254;
constexpr double kAmcRate_hz = 120.0;  // CMU's: the files do not state it

struct FileBone {
  std::string name;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  double length = -1.0;
  std::array<double, 3> angles{};  // angles of `axis`, in the order of its letters
  std::string axis_order;          // "XYZ"; empty: not given
  AcclaimSkeleton::Bone bone;
  int line = 0;
};

// Everything as the file says it, before lengths and angles have their units.
struct Asf {
  double length = 1.0;
  bool degrees = true;
  FileBone root;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::vector<FileBone> bones;
  std::map<std::string, std::vector<std::string>, std::less<>> children;
};

int axis_of(char letter) {
  const int axis = std::toupper(static_cast<unsigned char>(letter)) - 'X';
  return axis >= 0 && axis <= 2 ? axis : -1;
}

// "XYZ" in any order and case.
std::string axis_order(TextScanner& in) {
  const std::string_view word = in.word_in_line();
  std::array<int, 3> seen{};
  for (const char c : word) {
    if (axis_of(c) >= 0) ++seen[static_cast<std::size_t>(axis_of(c))];
  }
  if (word.size() != 3 || seen != std::array<int, 3>{1, 1, 1}) {
    in.fail_found(word, "an order of axes as XYZ");
  }
  return std::string(word);
}

Eigen::Vector3d three(TextScanner& in) {
  const double x = in.number_in_line(), y = in.number_in_line(), z = in.number_in_line();
  return {x, y, z};
}

// Freedoms to the end of the line: of the root (order) or of a bone (dof).
void read_freedoms(TextScanner& in, bool root, AcclaimSkeleton::Bone& bone) {
  bone.freedoms.clear();
  bone.turns.clear();
  for (std::string_view word = in.word_in_line(); !word.empty(); word = in.word_in_line()) {
    const bool turn = word.size() == 2 && (word[0] == 'r' || word[0] == 'R');
    const bool shift = word.size() == 2 && (word[0] == 't' || word[0] == 'T');
    if ((!turn && !(shift && root)) || axis_of(word[1]) < 0) {
      in.fail_found(word, root ? "TX TY TZ RX RY RZ in some order" : "dof rx, ry or rz");
    }
    const AcclaimSkeleton::Freedom freedom{from_file_axis(axis_of(word[1])), shift};
    for (const auto& other : bone.freedoms) {
      if (other.axis == freedom.axis && other.position == shift) {
        in.fail("'" + std::string(word) + "' for the second time");
      }
    }
    if (turn) bone.turns.push_back(bone.freedoms.size());
    bone.freedoms.push_back(freedom);
  }
}

void read_units(TextScanner& in, std::string_view key, Asf& asf) {
  if (same_word(key, "length")) {
    asf.length = in.number_in_line();
    if (!(asf.length > 1e-9 && asf.length < 1e9)) in.fail("length, expected a number above zero");
  } else if (same_word(key, "angle")) {
    const std::string_view unit = in.word_in_line();
    asf.degrees = same_word(unit, "deg");
    if (!asf.degrees && !same_word(unit, "rad")) in.fail_found(unit, "deg or rad");
  }
}

void read_root(TextScanner& in, std::string_view key, Asf& asf) {
  if (same_word(key, "order")) {
    read_freedoms(in, true, asf.root.bone);
  } else if (same_word(key, "axis")) {
    asf.root.axis_order = axis_order(in);
  } else if (same_word(key, "position")) {
    asf.position = three(in);
  } else if (same_word(key, "orientation") && three(in) != Eigen::Vector3d::Zero()) {
    in.fail("orientation of the root, expected 0 0 0");
  }
}

void read_bone(TextScanner& in, std::string_view key, Asf& asf) {
  if (same_word(key, "begin")) {
    asf.bones.emplace_back().line = in.line();
    return;
  }
  if (asf.bones.empty()) in.fail_found(key, "'begin' of a bone");
  FileBone& bone = asf.bones.back();
  if (same_word(key, "name")) {
    bone.name = in.word_in_line();
    if (bone.name.empty()) in.fail_found("", "the name of a bone");
  } else if (same_word(key, "direction")) {
    bone.direction = three(in);
  } else if (same_word(key, "length")) {
    bone.length = in.number_in_line();
    if (bone.length < 0.0) in.fail("length of a bone below zero");
  } else if (same_word(key, "axis")) {
    for (double& angle : bone.angles) angle = in.number_in_line();
    bone.axis_order = axis_order(in);
  } else if (same_word(key, "dof")) {
    read_freedoms(in, false, bone.bone);
  }
}

void read_children(TextScanner& in, std::string_view parent, Asf& asf) {
  if (same_word(parent, "begin") || same_word(parent, "end")) return;
  auto& children = asf.children[std::string(parent)];
  for (std::string_view word = in.word_in_line(); !word.empty(); word = in.word_in_line()) {
    children.emplace_back(word);
  }
}

Asf read_sections(TextScanner& in) {
  Asf asf;
  std::string_view section;
  while (in.next_line()) {
    const std::string_view key = in.word_in_line();
    if (key.front() == ':') {
      section = key;
    } else if (key.front() != '#') {
      if (section == ":units") read_units(in, key, asf);
      if (section == ":root") read_root(in, key, asf);
      if (section == ":bonedata") read_bone(in, key, asf);
      if (section == ":hierarchy") read_children(in, key, asf);
      if (section.empty()) in.fail_found(key, "':' and the name of a section");
    }
    in.skip_line();
  }
  return asf;
}

// C: turns about the fixed axes, one after the other.
Eigen::Quaterniond axes_of(const FileBone& bone, bool degrees) {
  Eigen::Quaterniond C = Eigen::Quaterniond::Identity();
  for (std::size_t k = 0; k < bone.axis_order.size(); ++k) {
    const double angle =
        degrees ? std::remainder(bone.angles[k], 360.0) * kRadians : bone.angles[k];
    C = turn_about(from_file_axis(axis_of(bone.axis_order[k])), angle) * C;
  }
  return C;
}

// The order in which the root's turns are applied is that of `axis`, independent of the columns'
// order.
void order_root_turns(FileBone& root) {
  const auto rank = [&](std::size_t freedom) {
    const int axis = root.bone.freedoms[freedom].axis;
    for (std::size_t k = 0; k < 3; ++k) {
      if (from_file_axis(axis_of(root.axis_order[k])) == axis) return k;
    }
    return std::size_t{3};
  };
  std::sort(root.bone.turns.begin(), root.bone.turns.end(),
            [&](std::size_t a, std::size_t b) { return rank(a) < rank(b); });
}

// Joints depth first from the names of :hierarchy.
class Tree {
 public:
  Tree(const Asf& asf, const std::string& file, double unit_m)
      : asf_(asf), file_(file), unit_m_(unit_m) {
    for (const FileBone& bone : asf.bones) {
      if (bone.name.empty()) fail(bone.line, "a bone without a name");
      if (bone.name == "root" || !by_name_.emplace(bone.name, &bone).second) {
        fail(bone.line, "bone '" + bone.name + "' for the second time");
      }
      if (bone.length < 0.0) fail(bone.line, "bone '" + bone.name + "' without a length");
      if (bone.length > 0.0 && !(bone.direction.norm() > 1e-9)) {
        fail(bone.line, "bone '" + bone.name + "' without a direction");
      }
    }
  }

  void build(AcclaimSkeleton& out) {
    struct Next {
      std::string_view name;
      int parent;
    };
    std::vector<Next> open{{"root", -1}};  // last first
    while (!open.empty()) {
      const auto [name, parent] = open.back();
      open.pop_back();
      const int index = add(out, name, parent);
      const auto found = asf_.children.find(name);
      if (found == asf_.children.end() || found->second.empty()) {
        add_tip(out, index);
        continue;
      }
      for (auto child = found->second.rbegin(); child != found->second.rend(); ++child) {
        open.push_back({*child, index});
      }
    }
    for (const FileBone& bone : asf_.bones) {
      if (by_name_.contains(bone.name)) {
        fail(bone.line, "bone '" + bone.name + "' does not hang on the root in :hierarchy");
      }
    }
  }

 private:
  [[noreturn]] void fail(int line, const std::string& what) const {
    throw ConfigError(one_line(file_ + ':' + std::to_string(line) + ": " + what));
  }
  int add(AcclaimSkeleton& out, std::string_view name, int parent) {
    const FileBone* bone = &asf_.root;
    if (parent >= 0) {
      const auto found = by_name_.find(name);
      if (found == by_name_.end()) {
        throw ConfigError(one_line(file_ + ": bone '" + std::string(name) +
                                   "' in :hierarchy, expected every bone of :bonedata there once"));
      }
      bone = found->second;
      by_name_.erase(found);  // once only: neither two parents nor a ring
    }
    Joint& joint = out.skeleton.joints.emplace_back(Joint{std::string(name), parent});
    if (parent >= 0) joint.offset_m = tips_[static_cast<std::size_t>(parent)];
    out.bones.push_back(bone->bone);
    out.bones.back().axes = axes_of(*bone, asf_.degrees);
    tips_.emplace_back(Eigen::Vector3d::Zero());
    if (bone->length > 0.0) {
      tips_.back() = from_file_axes(bone->direction.normalized()) * (bone->length * unit_m_);
    }
    return static_cast<int>(out.bones.size()) - 1;
  }

  void add_tip(AcclaimSkeleton& out, int joint) {
    const auto j = static_cast<std::size_t>(joint);
    out.skeleton.ends.push_back({out.skeleton.joints[j].name + "_end", joint, tips_[j]});
  }

  const Asf& asf_;
  const std::string& file_;
  double unit_m_;
  std::map<std::string_view, const FileBone*> by_name_;  // those not yet in the tree
  std::vector<Eigen::Vector3d> tips_;                    // tips of the joints [m]
};

class AmcReader {
 public:
  AmcReader(std::string_view text, const std::string& file, const AcclaimSkeleton& asf)
      : in_(text, file), file_(file), asf_(asf), degrees_(asf.degrees) {
    seen_in_.assign(asf.bones.size(), -1);
    for (std::size_t j = 0; j < asf.bones.size(); ++j) {
      by_name_.emplace(asf.skeleton.joints[j].name, j);
      if (!asf.bones[j].freedoms.empty()) ++moved_;
    }
  }

  void read(Clip& clip) {
    while (in_.next_line()) {
      const std::string_view word = in_.word_in_line();
      if (word.front() == '#' || word.front() == ':') {
        if (same_word(word, ":DEGREES")) degrees_ = true;
        if (same_word(word, ":RADIANS")) degrees_ = false;
        in_.skip_line();
      } else if (word.front() >= '0' && word.front() <= '9') {
        begin_frame(word);
      } else {
        read_bone(word);
      }
    }
    end_frame();
    if (frames_ == 0) in_.fail_found("", "a first frame");
    clip.rotation_rad = rotation_.leftCols(frames_);
    clip.root_position_W_m = position_.leftCols(frames_);
  }

 private:
  void begin_frame(std::string_view word) {
    long number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size() || number < 0) {
      in_.fail_found(word, "a bone or the number of a frame");
    }
    in_.expect_line_end();
    if (frames_ > 0) end_frame();
    if (frames_ > 0 && number != number_ + 1) {
      in_.fail_found(word, "frame " + std::to_string(number_ + 1));
    }
    number_ = number;
    check_clip_size(file_, in_.size(), asf_.bones.size(), static_cast<std::size_t>(frames_) + 1);
    if (frames_ == rotation_.cols()) {
      const Eigen::Index columns = std::max<Eigen::Index>(16, 2 * frames_);
      rotation_.conservativeResize(3 * static_cast<Eigen::Index>(asf_.bones.size()), columns);
      position_.conservativeResize(3, columns);
    }
    rotation_.col(frames_).setZero();
    position_.col(frames_) = asf_.root_position_m;
    ++frames_;
    seen_ = 0;
  }

  void end_frame() {
    if (seen_ == moved_ || frames_ == 0) return;
    for (std::size_t j = 0; j < asf_.bones.size(); ++j) {
      if (!asf_.bones[j].freedoms.empty() && seen_in_[j] != frames_) {
        in_.fail("frame " + std::to_string(number_) + " has no line of '" +
                 asf_.skeleton.joints[j].name + "', expected every bone with dof");
      }
    }
  }

  void read_bone(std::string_view name) {
    const auto found = by_name_.find(name);
    if (found == by_name_.end()) in_.fail_found(name, "a bone of the .asf");
    if (frames_ == 0) in_.fail_found(name, "the number of the first frame");
    const std::size_t j = found->second;
    if (seen_in_[j] == frames_) in_.fail("bone '" + std::string(name) + "' twice in a frame");
    seen_in_[j] = frames_;
    const AcclaimSkeleton::Bone& bone = asf_.bones[j];
    if (!bone.freedoms.empty()) ++seen_;
    double value[6] = {};
    for (std::size_t k = 0; k < bone.freedoms.size(); ++k) {
      value[k] = in_.number_in_line();
      if (!bone.freedoms[k].position) continue;
      position_(bone.freedoms[k].axis, frames_ - 1) += value[k] * asf_.unit_m;
    }
    in_.expect_line_end();
    Eigen::Quaterniond M = Eigen::Quaterniond::Identity();
    for (const std::size_t k : bone.turns) {  // about the bone's fixed axes, one after the other
      const double angle = degrees_ ? std::remainder(value[k], 360.0) * kRadians : value[k];
      M = turn_about(bone.freedoms[k].axis, angle) * M;
    }
    put_rotation(rotation_, static_cast<Eigen::Index>(j), frames_ - 1,
                 bone.axes * M * bone.axes.conjugate());
  }

  TextScanner in_;
  const std::string& file_;
  const AcclaimSkeleton& asf_;
  bool degrees_;
  std::unordered_map<std::string_view, std::size_t> by_name_;
  std::size_t moved_ = 0, seen_ = 0;   // bones with dof: in all, in this frame
  std::vector<Eigen::Index> seen_in_;  // frame of a bone's last line, from 1
  Eigen::Index frames_ = 0;
  long number_ = 0;
  Eigen::MatrixXd rotation_;
  Eigen::Matrix3Xd position_;
};

}  // namespace

AcclaimSkeleton parse_asf(std::string_view text, const std::string& file,
                          const ReadOptions& options) {
  check_options(options);
  TextScanner in(text, file);
  Asf asf = read_sections(in);
  if (asf.root.bone.freedoms.empty()) in.fail("no 'order' in :root, expected TX TY TZ RX RY RZ");
  if (asf.root.axis_order.empty()) in.fail("no 'axis' in :root, expected an order as XYZ");
  order_root_turns(asf.root);
  asf.root.axis_order.clear();  // its own axes are the world's
  AcclaimSkeleton out;
  out.unit_m = options.unit_m > 0.0 ? options.unit_m : kInch / asf.length;
  out.degrees = asf.degrees;
  out.root_position_m = from_file_axes(asf.position) * out.unit_m;
  Tree(asf, file, out.unit_m).build(out);
  return out;
}

Clip parse_amc(std::string_view text, const std::string& file, const AcclaimSkeleton& asf,
               const ReadOptions& options) {
  check_options(options);
  Clip clip;
  clip.name = base_name(file);
  clip.skeleton = asf.skeleton;
  clip.rate_hz = kAmcRate_hz;
  AmcReader(text, file, asf).read(clip);
  check_lengths(file, clip);
  return clip;
}

std::string find_asf(const std::string& amc) {
  const std::filesystem::path path(amc);
  std::string stem = path.stem().string(), tried;
  while (true) {
    const std::filesystem::path asf = path.parent_path() / (stem + ".asf");
    if (std::filesystem::exists(asf)) return asf.string();
    tried += (tried.empty() ? "" : ", ") + asf.filename().string();
    const std::size_t cut = stem.rfind('_');
    if (cut == stem.npos || cut == 0) break;
    stem.resize(cut);
  }
  throw ConfigError(amc + ": no skeleton beside it, expected " + tried);
}

}  // namespace mimesis::mocap
