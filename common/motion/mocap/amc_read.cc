#include <charconv>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <unordered_map>

#include "common/error.h"
#include "common/motion/mocap/acclaim.h"
#include "common/motion/mocap/clip_limits.h"
#include "common/motion/mocap/file_axes.h"
#include "common/motion/mocap/text_scanner.h"

namespace mimesis::mocap {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

bool starts_number(std::string_view word) {
  return !word.empty() && word.front() >= '0' && word.front() <= '9';
}

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
      if (word.front() == '#') {
        in_.skip_line();
      } else if (word.front() == ':') {
        keyword(word);
      } else if (starts_number(word)) {
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
  void keyword(std::string_view word) {
    if (same_word(word, ":DEGREES")) degrees_ = true;
    if (same_word(word, ":RADIANS")) degrees_ = false;
    in_.skip_line();
  }

  void begin_frame(std::string_view word) {
    long number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size() || number < 0) {
      in_.fail_found(word, "a bone or the number of a frame");
    }
    expect_line_end();
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
    expect_line_end();
    Eigen::Quaterniond M = Eigen::Quaterniond::Identity();
    for (const std::size_t k : bone.turns) {  // about the bone's fixed axes, one after the other
      const double angle = degrees_ ? std::remainder(value[k], 360.0) * kRadians : value[k];
      M = turn_about(bone.freedoms[k].axis, angle) * M;
    }
    put_rotation(rotation_, static_cast<Eigen::Index>(j), frames_ - 1,
                 bone.axes * M * bone.axes.conjugate());
  }

  void expect_line_end() {
    const std::string_view more = in_.word_in_line();
    if (!more.empty()) in_.fail_found(more, "the end of the line");
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

Clip parse_amc(std::string_view text, const std::string& file, const AcclaimSkeleton& asf,
               const ReadOptions& options) {
  check_options(options);
  Clip clip;
  clip.name = base_name(file);
  clip.skeleton = asf.skeleton;
  clip.rate_hz = options.amc_rate_hz;
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
