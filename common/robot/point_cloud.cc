#include "common/robot/point_cloud.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>

#include "common/error.h"

namespace mimesis::robot {
namespace {

constexpr std::uint64_t kMostPoints = 50'000'000;

/// One number as it lies in a file.
struct Scalar {
  std::size_t size = 0;
  char kind = 'F';  // F: float, I: signed, U: unsigned
};

double value_of(const char* bytes, const Scalar& type, bool swapped) {
  std::array<char, 8> raw{};
  std::copy_n(bytes, type.size, raw.begin());
  if (swapped) std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(type.size));
  const auto as = [&raw]<class T>(T value) {
    std::memcpy(&value, raw.data(), sizeof value);
    return static_cast<double>(value);
  };
  if (type.kind == 'F') return type.size == 4 ? as(float{}) : as(double{});
  const bool is_signed = type.kind == 'I';
  switch (type.size) {
    case 1:
      return is_signed ? as(std::int8_t{}) : as(std::uint8_t{});
    case 2:
      return is_signed ? as(std::int16_t{}) : as(std::uint16_t{});
    case 4:
      return is_signed ? as(std::int32_t{}) : as(std::uint32_t{});
    default:
      return is_signed ? as(std::int64_t{}) : as(std::uint64_t{});
  }
}

/// The bytes of a file, read from front to back. Faults say where.
class Bytes {
 public:
  explicit Bytes(const std::string& file) : file_(file) {
    std::ifstream in(file, std::ios::binary);
    std::ostringstream text;
    if (!in || !(text << in.rdbuf())) fail("cannot be read, expected a point cloud (PCD or PLY)");
    data_ = text.str();
  }
  [[noreturn]] void fail(const std::string& why) const { throw ConfigError(file_ + ": " + why); }

  bool starts_with(std::string_view text) const { return data_.starts_with(text); }
  /// The next line, without its end; nothing behind the last.
  std::optional<std::string> line() {
    if (at_ >= data_.size()) return std::nullopt;
    const std::size_t end = std::min(data_.find('\n', at_), data_.size());
    std::string text = data_.substr(at_, end - at_);
    at_ = std::min(end + 1, data_.size());
    if (!text.empty() && text.back() == '\r') text.pop_back();
    return text;
  }
  const char* take(std::uint64_t count, const std::string& what) {
    if (count > data_.size() - at_)
      fail(what + " ends after " + std::to_string(data_.size()) + " bytes, expected " +
           std::to_string(count - (data_.size() - at_)) + " more");
    const char* begin = data_.data() + at_;
    at_ += count;
    return begin;
  }
  double number(std::istringstream& words, const std::string& what) const {
    std::string word;
    if (!(words >> word)) fail(what + " has too few numbers");
    char* end = nullptr;
    const double value = std::strtod(word.c_str(), &end);
    if (end != word.c_str() + word.size()) fail(what + ": '" + word + "', expected a number");
    return value;
  }
  std::uint64_t count(const std::string& word, const std::string& what) const {
    const bool digits = !word.empty() && word.size() < 12 &&
                        std::ranges::all_of(word, [](char c) { return c >= '0' && c <= '9'; });
    const std::uint64_t value = digits ? std::stoull(word) : kMostPoints + 1;
    if (value > kMostPoints)
      fail(what + " '" + word + "', expected 0 .. " + std::to_string(kMostPoints));
    return value;
  }

 private:
  std::string file_, data_;
  std::size_t at_ = 0;
};

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream in(line);
  return {std::istream_iterator<std::string>(in), {}};
}

/// Marc Lehmann's LZF: literal runs, and copies of what came before.
std::string unpacked(const Bytes& in, const char* packed, std::uint64_t size, std::uint64_t whole) {
  std::string out;
  out.reserve(whole);
  const auto byte = [&](std::uint64_t i) -> std::size_t {
    if (i >= size) in.fail("compressed points end too early");
    return static_cast<unsigned char>(packed[i]);
  };
  for (std::uint64_t i = 0; i < size;) {
    const std::size_t control = byte(i++);
    if (control < 32) {
      for (std::size_t k = 0; k <= control; ++k) out.push_back(static_cast<char>(byte(i++)));
    } else {
      std::size_t length = control >> 5;
      if (length == 7) length += byte(i++);
      const std::size_t back = ((control & 31) << 8 | byte(i++)) + 1;
      if (back > out.size()) in.fail("compressed points are damaged");
      for (std::size_t k = 0; k < length + 2; ++k) out.push_back(out[out.size() - back]);
    }
    if (out.size() > whole) in.fail("compressed points are damaged");
  }
  if (out.size() != whole) in.fail("compressed points are damaged");
  return out;
}

using Columns = std::vector<Eigen::Vector3d>;

Columns read_pcd(Bytes& in, Viewpoint viewpoint) {
  struct Field {
    std::string name;
    Scalar type;
    std::size_t count = 1, offset = 0;  // in a point, in bytes
  };
  std::vector<Field> fields;
  std::map<std::string, std::vector<std::string>> header;
  std::string data;
  while (data.empty()) {
    const auto line = in.line();
    if (!line) in.fail("the header of a PCD has no DATA");
    const std::vector<std::string> words = words_of(*line);
    if (words.empty() || words[0].starts_with("#")) continue;
    if (words[0] == "DATA") data = words.size() > 1 ? words[1] : "?";
    header[words[0]] = {words.begin() + 1, words.end()};
  }
  const auto& names = header.contains("FIELDS") ? header["FIELDS"] : header["COLUMNS"];
  const auto &sizes = header["SIZE"], &types = header["TYPE"], &counts = header["COUNT"];
  if (names.empty() || sizes.size() != names.size() || types.size() != names.size() ||
      (!counts.empty() && counts.size() != names.size()))
    in.fail("FIELDS, SIZE, TYPE and COUNT of a PCD, expected one of each for each field");
  std::size_t point_bytes = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    Field field{names[i], {in.count(sizes[i], "SIZE"), types[i][0]}, 1, point_bytes};
    if (!counts.empty()) field.count = in.count(counts[i], "COUNT");
    const std::size_t size = field.type.size;
    const bool known = field.type.kind == 'F'
                           ? size == 4 || size == 8
                           : (field.type.kind == 'I' || field.type.kind == 'U') &&
                                 (size == 1 || size == 2 || size == 4 || size == 8);
    if (field.count < 1 || field.count > 10'000)
      in.fail("COUNT of field " + field.name + ", expected 1 .. 10000");
    if (!known)
      in.fail("field " + field.name + " of TYPE " + types[i] + " and SIZE " + sizes[i] +
              ", expected F of 4 or 8, I or U of 1, 2, 4 or 8 bytes");
    point_bytes += size * field.count;
    fields.push_back(std::move(field));
  }
  std::array<const Field*, 3> xyz{};
  for (const Field& field : fields) {
    const std::size_t axis = std::string_view("xyz").find(field.name);
    if (field.name.size() == 1 && axis < 3) xyz[axis] = &field;
  }
  if (!xyz[0] || !xyz[1] || !xyz[2]) in.fail("no fields x, y and z in FIELDS");
  std::uint64_t count = 0;
  if (header["POINTS"].size() == 1) {
    count = in.count(header["POINTS"][0], "POINTS");
  } else if (header["WIDTH"].size() == 1 && header["HEIGHT"].size() == 1) {
    count = in.count(header["WIDTH"][0], "WIDTH") * in.count(header["HEIGHT"][0], "HEIGHT");
    if (count > kMostPoints) in.fail("WIDTH times HEIGHT, expected at most 50000000 points");
  } else {
    in.fail("POINTS of a PCD, expected their number");
  }
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();  // of the viewpoint
  if (const auto& pose = header["VIEWPOINT"]; !pose.empty()) {
    std::array<double, 7> v{};
    if (pose.size() != v.size()) in.fail("VIEWPOINT, expected x y z and a quaternion w x y z");
    for (std::size_t i = 0; i < v.size(); ++i) {
      std::istringstream word(pose[i]);
      v[i] = in.number(word, "VIEWPOINT");
    }
    const Eigen::Quaterniond q(v[3], v[4], v[5], v[6]);
    if (!(std::abs(q.norm() - 1.0) < 1e-2)) in.fail("VIEWPOINT has no unit quaternion");
    X.linear() = q.normalized().toRotationMatrix();
    X.translation() = Eigen::Vector3d(v[0], v[1], v[2]);
    if (viewpoint == Viewpoint::refuse && !X.isApprox(Eigen::Isometry3d::Identity(), 1e-9))
      in.fail(
          "VIEWPOINT is not the origin, expected `viewpoint: apply` if points are told in its "
          "frame, or `ignore` if they are not");
    if (viewpoint == Viewpoint::ignore) X.setIdentity();
  }
  Columns points;
  points.reserve(count);
  if (data == "ascii") {
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto line = in.line();
      if (!line)
        in.fail("ends after " + std::to_string(i) + " points, expected " + std::to_string(count));
      std::istringstream words(*line);
      const std::string what = "point " + std::to_string(i);
      Eigen::Vector3d p;
      for (const Field& field : fields) {
        for (std::size_t k = 0; k < field.count; ++k) {
          const double value = in.number(words, what);
          for (int axis = 0; axis < 3; ++axis)
            if (xyz[static_cast<std::size_t>(axis)] == &field && k == 0) p[axis] = value;
        }
      }
      points.push_back(X * p);
    }
    return points;
  }
  std::string soa;
  const char* begin = nullptr;
  const bool packed = data == "binary_compressed";
  if (packed) {
    std::array<std::uint32_t, 2> length{};
    std::memcpy(length.data(), in.take(8, "the compressed part"), 8);
    if (length[1] != count * point_bytes) in.fail("compressed points are not as many as POINTS");
    soa = unpacked(in, in.take(length[0], "the compressed part"), length[0], length[1]);
    begin = soa.data();
  } else if (data == "binary") {
    begin = in.take(count * point_bytes, "the binary part");
  } else {
    in.fail("DATA " + data + ", expected ascii, binary or binary_compressed");
  }
  for (std::uint64_t i = 0; i < count; ++i) {
    Eigen::Vector3d p;
    for (int axis = 0; axis < 3; ++axis) {
      const Field& field = *xyz[static_cast<std::size_t>(axis)];
      const std::uint64_t at = packed ? field.offset * count + i * field.type.size * field.count
                                      : i * point_bytes + field.offset;
      p[axis] = value_of(begin + at, field.type, std::endian::native == std::endian::big);
    }
    points.push_back(X * p);
  }
  return points;
}

Columns read_ply(Bytes& in) {
  static const std::map<std::string, Scalar> kTypes{
      {"char", {1, 'I'}},  {"int8", {1, 'I'}},    {"uchar", {1, 'U'}},  {"uint8", {1, 'U'}},
      {"short", {2, 'I'}}, {"int16", {2, 'I'}},   {"ushort", {2, 'U'}}, {"uint16", {2, 'U'}},
      {"int", {4, 'I'}},   {"int32", {4, 'I'}},   {"uint", {4, 'U'}},   {"uint32", {4, 'U'}},
      {"float", {4, 'F'}}, {"float32", {4, 'F'}}, {"double", {8, 'F'}}, {"float64", {8, 'F'}}};
  struct Property {
    std::string name;
    Scalar type;
    std::optional<Scalar> length{};  // of a list
  };
  struct Element {
    std::string name;
    std::uint64_t count = 0;
    std::vector<Property> properties{};
  };
  std::vector<Element> elements;
  std::string format;
  in.line();
  for (;;) {
    const auto line = in.line();
    if (!line) in.fail("the header of a PLY has no end_header");
    const std::vector<std::string> words = words_of(*line);
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    const auto type = [&](std::size_t i) {
      const auto known = kTypes.find(words[i]);
      if (known == kTypes.end()) in.fail("'" + *line + "', expected a type of PLY");
      return known->second;
    };
    if (words[0] == "format" && words.size() > 1) {
      format = words[1];
    } else if (words[0] == "element" && words.size() == 3) {
      elements.push_back({words[1], in.count(words[2], "element " + words[1])});
    } else if (words[0] == "property" && !elements.empty() && words.size() == 3) {
      elements.back().properties.push_back({words[2], type(1)});
    } else if (words[0] == "property" && !elements.empty() && words.size() == 5 &&
               words[1] == "list") {
      elements.back().properties.push_back({words[4], type(3), type(2)});
    } else {
      in.fail("'" + *line + "', expected element, property or comment");
    }
  }
  const bool ascii = format == "ascii", big = format == "binary_big_endian";
  if (!ascii && !big && format != "binary_little_endian")
    in.fail("format '" + format + "', expected ascii or binary");
  for (const Element& element : elements) {
    if (element.name == "face" && element.count > 0)
      in.fail("has " + std::to_string(element.count) +
              " faces, expected points alone: a mesh goes to `meshes`");
  }
  const bool swapped = big != (std::endian::native == std::endian::big);
  Columns points;
  for (const Element& element : elements) {
    const bool vertex = element.name == "vertex";
    std::array<bool, 3> has{};
    for (const Property& property : element.properties) {
      const std::size_t axis = std::string_view("xyz").find(property.name);
      if (property.name.size() == 1 && axis < 3 && !property.length) has[axis] = true;
    }
    if (vertex && !(has[0] && has[1] && has[2])) in.fail("vertex has no x, y and z");
    for (std::uint64_t i = 0; i < element.count; ++i) {
      const std::string what = element.name + " " + std::to_string(i);
      Eigen::Vector3d p = Eigen::Vector3d::Zero();
      std::istringstream words;
      if (ascii) {
        const auto line = in.line();
        if (!line) in.fail("ends before " + what);
        words.str(*line);
      }
      const auto next = [&](const Scalar& type) {
        return ascii ? in.number(words, what) : value_of(in.take(type.size, what), type, swapped);
      };
      for (const Property& property : element.properties) {
        if (property.length) {
          const double length = next(*property.length);
          if (!(length >= 0.0 && length < 1e6)) in.fail(what + ": length of a list");
          for (double k = 0.0; k < length; ++k) next(property.type);
          continue;
        }
        const double value = next(property.type);
        const std::size_t axis = std::string_view("xyz").find(property.name);
        if (property.name.size() == 1 && axis < 3) p[static_cast<Eigen::Index>(axis)] = value;
      }
      if (vertex) points.push_back(p);
    }
    if (vertex) return points;
  }
  in.fail("has no element vertex");
}

}  // namespace

Eigen::Matrix3Xd read_point_cloud(const std::string& file, Viewpoint viewpoint) {
  Bytes in(file);
  const bool ply = in.starts_with("ply");
  if (in.starts_with("version https://git-lfs"))
    in.fail("is a pointer of Git LFS, expected the cloud itself: git lfs pull");
  if (!ply && !in.starts_with("# .PCD") && !in.starts_with("VERSION") && !in.starts_with("#"))
    in.fail("is no point cloud, expected PCD or PLY");
  Columns points = ply ? read_ply(in) : read_pcd(in, viewpoint);
  std::erase_if(points, [](const Eigen::Vector3d& p) { return !p.allFinite(); });
  if (points.empty()) in.fail("has no finite point, expected some");
  Eigen::Matrix3Xd columns(3, std::ssize(points));
  for (Eigen::Index i = 0; i < columns.cols(); ++i)
    columns.col(i) = points[static_cast<std::size_t>(i)];
  return columns;
}

std::vector<math::RoundBound> balls_of_points(const Eigen::Matrix3Xd& points, double cell_m,
                                              double radius_m) {
  std::map<std::array<std::int64_t, 3>, std::vector<Eigen::Index>> cells;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    std::array<std::int64_t, 3> cell{};
    for (int axis = 0; axis < 3; ++axis)
      cell[static_cast<std::size_t>(axis)] =
          static_cast<std::int64_t>(std::floor(points(axis, i) / cell_m));
    cells[cell].push_back(i);
  }
  std::vector<math::RoundBound> balls;
  balls.reserve(cells.size());
  for (const auto& [cell, inside] : cells) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Index i : inside) box.extend(Eigen::Vector3d(points.col(i)));
    math::RoundBound ball{box.center(), 0.0};
    for (const Eigen::Index i : inside)
      ball.radius = std::max(ball.radius, (points.col(i) - ball.center).norm());
    ball.radius += radius_m;
    balls.push_back(ball);
  }
  return balls;
}

}  // namespace mimesis::robot
