#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "common/math/so3.h"
#include "common/motion/mocap/clip_file.h"

namespace mimesis::mocap {

/// Walks over a text file that is in memory, word by word or line by line, and knows the line
/// number for messages. Blanks are space, tab, CR, vertical tab and form feed. Lines that begin
/// with
/// '#' are passed over.
class TextScanner {
 public:
  /// Both are kept as views; `file` is named in errors.
  TextScanner(std::string_view text, std::string_view file) : text_(text), file_(file) {
    if (text_.substr(0, 3) == "\xEF\xBB\xBF") at_ = begin_ = 3;  // byte order mark of UTF-8
  }

  /// Next word, over line ends; '{' and '}' are words of their own. Empty at the end of the file.
  std::string_view word();
  /// Next word on this line, empty at its end.
  std::string_view word_in_line();
  /// The rest of this line, trimmed, up to '{' if there is one.
  std::string_view rest_of_line();
  /// Goes to the next line that holds a word; false at the end of the file.
  bool next_line();
  void skip_line();
  /// A finite number, the next word on this line or (`number`) of the file. @throws ConfigError
  double number_in_line();
  double number();
  long integer();
  /// The value of a line "LABEL: value"; letter case, blanks in the label and the colon do not
  /// matter. @throws ConfigError
  double labelled_number(std::string_view label);
  /// Number of lines from here on that hold a word.
  std::size_t lines_left() const;

  /// Takes the next word and compares, letter case aside. @throws ConfigError
  void expect(std::string_view wanted);
  /// Refuses another word on this line; `expected` goes on "the end of the line". @throws
  /// ConfigError
  void expect_line_end(const std::string& expected = "");
  /// The next word is not taken.
  std::string_view peek();

  /// "file:line: what". Line of the word last taken. @throws ConfigError always
  [[noreturn]] void fail(const std::string& what) const;
  /// "file:line: found 'x', expected ..."; an empty word is the end of line or file.
  [[noreturn]] void fail_found(std::string_view found, const std::string& expected) const;

  int line() const { return line_; }
  std::size_t bytes_left() const { return text_.size() - at_; }
  std::size_t size() const { return text_.size(); }

 private:
  void skip_blanks();
  bool first_in_line() const;
  std::string_view take_word();
  double to_number(std::string_view word) const;

  std::string_view text_, file_;
  std::size_t at_ = 0, begin_ = 0;
  int line_ = 1;
};

/// Equal but for the case of ASCII letters.
bool same_word(std::string_view a, std::string_view b);

/// The whole file. @throws ConfigError if it cannot be read
std::string read_bytes(const std::string& file);
/// Without the folder.
std::string base_name(const std::string& file);

/// Motion files are y up, facing +z, left +x; this project is z up, facing +x, left +y. So the axes
/// permute, (x, y, z)_project = (z, x, y)_file, for points, axes and axis-angle vectors alike.
inline Eigen::Vector3d from_file_axes(const Eigen::Vector3d& v) { return {v.z(), v.x(), v.y()}; }
/// 0, 1, 2 = x, y, z of the file -> the same axis in this project.
inline int from_file_axis(int axis) { return (axis + 1) % 3; }

inline constexpr double kCmuUnit_m = 0.0254 / 0.45;  ///< CMU's unit of length

inline constexpr double kRadians = std::numbers::pi / 180.0;  ///< one degree in radians

/// Rotation by an angle [rad] about coordinate axis 0, 1 or 2.
inline Eigen::Quaterniond turn_about(int axis, double angle_rad) {
  Eigen::Quaterniond q(std::cos(0.5 * angle_rad), 0.0, 0.0, 0.0);
  q.vec()[axis] = std::sin(0.5 * angle_rad);
  return q;
}

/// Writes the axis-angle vector of `rotation` into rows 3j..3j+2 of a column: the one nearest to
/// that of the column before, in column 0 the one nearest to zero (of length <= π).
template <typename Matrix>
void put_rotation(Matrix& rotation_rad, Eigen::Index joint, Eigen::Index frame,
                  const Eigen::Quaterniond& rotation) {
  const Eigen::Vector3d v = math::log_so3(rotation);
  auto block = rotation_rad.template block<3, 1>(3 * joint, frame);
  if (frame == 0) {
    block = v;
  } else {
    block = math::nearest_axis_angle(v, rotation_rad.template block<3, 1>(3 * joint, frame - 1));
  }
}

/// A clip must not need more memory than its file justifies: a joint moved in one frame is 24 bytes
/// in a clip and two or more in a file, and joints that the file does not move are few.
/// @throws ConfigError
void check_clip_size(const std::string& file, std::size_t file_bytes, std::size_t joints,
                     std::size_t frames);

/// No person is as large or goes as far as 10 km: such lengths overflow in later computations.
/// @throws ConfigError
void check_lengths(const std::string& file, const Clip& clip);

/// Ends the reading of a clip whose lengths are in the file's unit, y up: the figure's map tells
/// unit and axis that is up; joints that move a little within their parents get their mean offset.
/// @param usual_unit_m  see ReadOptions::unit_m
/// @param positions  by joint, within the parent in each frame; empty: it keeps still
/// @throws ConfigError as parse_bvh() for lengths, and check_body_map()
void settle_clip(const std::string& file, const ReadOptions& options, double usual_unit_m,
                 const std::vector<Eigen::Matrix3Xd>& positions, Clip& clip);

/// @throws ConfigError
void check_options(const ReadOptions& options);

}  // namespace mimesis::mocap
