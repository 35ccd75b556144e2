#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/runtime/value_text.h"
#include "nodes/vision/verb/calibrate_tools.h"

namespace mimesis::tool {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;

/// How three or four numbers tell a turn.
enum class Turn { quaternion, vector, roll_pitch_yaw, kuka, xyz, zyz };

struct Named {
  Turn turn;
  std::vector<std::string> columns;  ///< without unit
  const char* text;
};
const std::vector<Named>& turns() {
  static const std::vector<Named> all{
      {Turn::quaternion, {"qw", "qx", "qy", "qz"}, "a quaternion"},
      {Turn::vector, {"rotvec_x", "rotvec_y", "rotvec_z"}, "a rotation vector"},
      {Turn::roll_pitch_yaw, {"roll", "pitch", "yaw"}, "roll pitch yaw, Rz(3) Ry(2) Rx(1)"},
      {Turn::kuka, {"a", "b", "c"}, "KUKA's A B C, Rz(1) Ry(2) Rx(3)"},
      // No column has these names; they are read by mistake.
      {Turn::xyz, {}, "turns about moving axes, Rx(1) Ry(2) Rz(3)"},
      {Turn::zyz, {}, "turns about moving axes, Rz(1) Ry(2) Rz(3)"}};
  return all;
}

Matrix3d rotation(Turn turn, const Eigen::VectorXd& v) {
  using Eigen::AngleAxisd;
  switch (turn) {
    case Turn::quaternion:
      return Eigen::Quaterniond(v[0], v[1], v[2], v[3]).normalized().toRotationMatrix();
    case Turn::vector:
      return math::exp_so3(v.head<3>());
    case Turn::roll_pitch_yaw:
      return math::rotation_of_rpy(v.head<3>());
    case Turn::kuka:
      return math::rotation_of_rpy(v.head<3>().reverse());
    case Turn::xyz:
      return (AngleAxisd(v[0], Vector3d::UnitX()) * AngleAxisd(v[1], Vector3d::UnitY()) *
              AngleAxisd(v[2], Vector3d::UnitZ()))
          .toRotationMatrix();
    default:
      return (AngleAxisd(v[0], Vector3d::UnitZ()) * AngleAxisd(v[1], Vector3d::UnitY()) *
              AngleAxisd(v[2], Vector3d::UnitZ()))
          .toRotationMatrix();
  }
}

std::string trimmed(std::string_view text) {
  const auto from = text.find_first_not_of(" \t\r"), to = text.find_last_not_of(" \t\r");
  std::string out(from == text.npos ? "" : text.substr(from, to - from + 1));
  if (out.size() >= 2 && out.front() == '"' && out.back() == '"')
    out = out.substr(1, out.size() - 2);
  return out;
}

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// "x_mm" is x and mm; a name without one of these units is itself.
std::pair<std::string, std::string> unit_of(const std::string& column) {
  for (const char* unit : {"m", "mm", "rad", "deg"}) {
    const std::string ending = std::string("_") + unit;
    if (column.ends_with(ending)) return {column.substr(0, column.size() - ending.size()), unit};
  }
  return {column, ""};
}

class Table {
 public:
  Table(const std::string& text, const std::string& name) : name_(name) {
    int line = 0;
    for (std::size_t at = text.starts_with("\xEF\xBB\xBF") ? 3 : 0; at < text.size();) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      add(std::string_view(text).substr(at, end - at), ++line);
      at = end + 1;
    }
    if (rows_.empty()) throw ConfigError(name_ + ": has no poses");
  }

  std::size_t size() const { return rows_.size(); }
  int line(std::size_t row) const { return lines_[row]; }
  const std::vector<std::string>& columns() const { return columns_; }
  bool has(const std::string& column) const { return std::ranges::count(columns_, column) > 0; }
  const std::string& cell(std::size_t row, const std::string& column) const {
    const auto at = std::ranges::find(columns_, column) - columns_.begin();
    return rows_[row][static_cast<std::size_t>(at)];
  }
  double number(std::size_t row, const std::string& column) const {
    const std::string& text = cell(row, column);
    const auto value = runtime::to_double(text);
    if (!value) fail(lines_[row], column + ": expected a number, found '" + text + "'");
    return *value;
  }
  [[noreturn]] void fail(int line, const std::string& what) const {
    throw ConfigError(fmt::format("{}:{}: {}", name_, line, printable(what)));
  }
  int first_line() const { return first_; }

 private:
  void add(std::string_view text, int line) {
    if (trimmed(text).empty() || trimmed(text)[0] == '#') return;
    if (columns_.empty()) {
      for (const char mark : {';', '\t', ','}) {
        if (text.find(mark) == text.npos) continue;
        mark_ = mark;
        break;
      }
    }
    std::vector<std::string> cells;
    for (std::size_t at = 0; at <= text.size();) {
      const std::size_t end = std::min(text.find(mark_, at), text.size());
      cells.push_back(trimmed(text.substr(at, end - at)));
      at = end + 1;
    }
    if (columns_.empty()) {
      first_ = line;
      for (const std::string& cell : cells) {
        if (runtime::to_double(cell))
          fail(line,
               "expected the names of the columns first, as file,x_m,y_m,z_m,qw,qx,qy,qz; "
               "found '" +
                   cell + "'");
        if (std::ranges::count(columns_, lower(cell)) > 0)
          fail(line, "column '" + cell + "' is there twice");
        columns_.push_back(lower(cell));
      }
      return;
    }
    if (cells.size() != columns_.size())
      fail(line,
           fmt::format("{} values, expected {}: one a column", cells.size(), columns_.size()));
    rows_.push_back(std::move(cells));
    lines_.push_back(line);
  }

  std::string name_;
  char mark_ = ',';
  int first_ = 1;
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<int> lines_;
};

constexpr const char* kTurns =
    "qw qx qy qz; or rotvec_x_rad rotvec_y_rad rotvec_z_rad (of UR: rx ry rz); or roll_rad "
    "pitch_rad yaw_rad (Rz(yaw) Ry(pitch) Rx(roll)); or a_deg b_deg c_deg (of KUKA)";

/// The columns of `names` with their common unit, if all are there.
struct Found {
  std::vector<std::string> columns;
  std::string unit;
};
std::optional<Found> found(const Table& table, const std::vector<std::string>& names,
                           const std::vector<std::string>& units) {
  for (const std::string& unit : units) {
    Found out{{}, unit};
    for (const std::string& name : names)
      out.columns.push_back(unit.empty() ? name : name + "_" + unit);
    if (std::ranges::all_of(out.columns, [&](const std::string& c) { return table.has(c); }))
      return out;
  }
  return std::nullopt;
}

/// A column that is none of the known ones: why.
void refuse_unknown(const Table& table, const std::vector<std::string>& known) {
  for (const std::string& column : table.columns()) {
    if (std::ranges::count(known, column) > 0) continue;
    const std::string name = unit_of(column).first;
    const std::string at = "column '" + column + "'";
    if (name == "x" || name == "y" || name == "z")
      table.fail(table.first_line(),
                 at + ": expected x y z with one unit in their names: x_m or x_mm");
    if (name == "rx" || name == "ry" || name == "rz")
      table.fail(table.first_line(), at + ": arms mean different turns by it; expected " + kTurns);
    for (const Named& each : turns()) {
      if (std::ranges::count(each.columns, name) == 0) continue;
      table.fail(table.first_line(), at + ": expected all of one kind and unit: " + kTurns);
    }
    table.fail(table.first_line(),
               at + ": is not known" + runtime::did_you_mean(column, known) +
                   "; leave out what is neither the picture's file nor the flange's pose");
  }
}

/// Values of some columns, a row each.
std::vector<Eigen::VectorXd> values(const Table& table, const std::vector<std::string>& columns) {
  std::vector<Eigen::VectorXd> out;
  for (std::size_t row = 0; row < table.size(); ++row) {
    Eigen::VectorXd v(static_cast<Eigen::Index>(columns.size()));
    for (std::size_t k = 0; k < columns.size(); ++k)
      v[static_cast<Eigen::Index>(k)] = table.number(row, columns[k]);
    out.push_back(v);
  }
  return out;
}

std::vector<Isometry3d> poses(Turn turn, double unit_m, double unit_rad,
                              const std::vector<Eigen::VectorXd>& places,
                              const std::vector<Eigen::VectorXd>& turned) {
  std::vector<Isometry3d> out;
  for (std::size_t i = 0; i < places.size(); ++i) {
    Isometry3d X = Isometry3d::Identity();
    X.translation() = unit_m * places[i];
    X.linear() = rotation(turn, unit_rad * turned[i]);
    out.push_back(X);
  }
  return out;
}

/// The four numbers of a quaternion, which stand under w x y z, in another order.
std::vector<Eigen::VectorXd> reordered(const std::vector<Eigen::VectorXd>& rows,
                                       const std::array<int, 4>& from) {
  std::vector<Eigen::VectorXd> out;
  for (const Eigen::VectorXd& q : rows)
    out.emplace_back(Eigen::Vector4d(q[from[0]], q[from[1]], q[from[2]], q[from[3]]));
  return out;
}

void read_poses(const Table& table, const std::string& file_column, ArmPoses& out) {
  const auto place = found(table, {"x", "y", "z"}, {"m", "mm"});
  std::optional<Found> turn;
  const Named* kind = nullptr;
  for (const Named& each : turns()) {
    if (each.columns.empty()) continue;
    const bool bare = each.turn == Turn::quaternion;
    auto here = found(table, each.columns,
                      bare ? std::vector<std::string>{""} : std::vector<std::string>{"rad", "deg"});
    if (here && turn)
      table.fail(table.first_line(), "two kinds of turn: " + turn->columns[0] + " and " +
                                         here->columns[0] + "; expected one");
    if (!here) continue;
    turn = std::move(here);
    kind = &each;
  }
  std::vector<std::string> known{file_column};
  for (const auto& each : {place, turn})
    if (each) known.insert(known.end(), each->columns.begin(), each->columns.end());
  refuse_unknown(table, known);
  if (!place) table.fail(table.first_line(), "expected the columns x_m y_m z_m, or x_mm y_mm z_mm");
  if (!turn) table.fail(table.first_line(), std::string("expected the turn: ") + kTurns);

  const auto places = values(table, place->columns), turned = values(table, turn->columns);
  const double unit_m = place->unit == "mm" ? 1e-3 : 1.0;
  const bool degrees = turn->unit == "deg";
  constexpr double kTurnOver = 2.0 * std::numbers::pi + 0.01, kUnit = 0.01;
  for (std::size_t i = 0; i < turned.size(); ++i) {
    if (kind->turn == Turn::quaternion && std::abs(turned[i].norm() - 1.0) > kUnit)
      table.fail(table.line(i), fmt::format("qw qx qy qz: expected a quaternion of length 1, this "
                                            "has {:.4g}",
                                            turned[i].norm()));
    if (turn->unit == "rad" && turned[i].cwiseAbs().maxCoeff() > kTurnOver)
      table.fail(table.line(i),
                 fmt::format("{}: {:g} rad is more than a turn; if these are "
                             "degrees, name the columns so: {}",
                             fmt::join(turn->columns, " "), turned[i].cwiseAbs().maxCoeff(),
                             unit_of(turn->columns[0]).first + "_deg"));
  }
  const double unit_rad = degrees ? kDegree : 1.0;
  out.readings.push_back({"", poses(kind->turn, unit_m, unit_rad, places, turned)});
  if (kind->turn == Turn::quaternion) {
    out.readings.push_back(
        {"the quaternions are written w x y z, under the names x y z w",
         poses(kind->turn, unit_m, 1.0, places, reordered(turned, {1, 2, 3, 0}))});
    out.readings.push_back(
        {"the quaternions are written x y z w, under the names w x y z",
         poses(kind->turn, unit_m, 1.0, places, reordered(turned, {3, 0, 1, 2}))});
    return;
  }
  for (const Named& each : turns()) {
    if (each.turn == Turn::quaternion) continue;
    for (const bool other : {false, true}) {
      if (each.turn == kind->turn && !other) continue;
      std::string name = other ? degrees ? "the angles are radians, not degrees"
                                         : "the angles are degrees, not radians"
                               : "";
      if (each.turn != kind->turn)
        name += (name.empty() ? "" : ", and if ") +
                fmt::format("the three angles are {}, not {}", each.text, kind->text);
      const double unit = other != degrees ? kDegree : 1.0;
      out.readings.push_back({name, poses(each.turn, unit_m, unit, places, turned)});
    }
  }
}

void read_joints(const Table& table, const std::string& file_column, const kin::ArmModel& arm,
                 ArmPoses& out) {
  constexpr double kBeyond = 0.05;  // a joint may stand that far behind its limit [rad, m]
  std::vector<std::string> columns, known{file_column};
  bool any_degrees = false, any_radians = false;
  for (std::size_t i = 0; i < arm.links.size(); ++i) {
    const bool slides = arm.links[i].slides;
    const std::string name = fmt::format("a{}", i + 1);
    const auto here =
        found(table, {name},
              slides ? std::vector<std::string>{"m"} : std::vector<std::string>{"rad", "deg"});
    if (!here)
      table.fail(table.first_line(),
                 fmt::format("expected the column A{}_{} of the arm '{}', which has {} joints",
                             i + 1, slides ? "m" : "rad", arm.name, arm.links.size()));
    any_degrees = any_degrees || here->unit == "deg";
    any_radians = any_radians || here->unit == "rad";
    columns.push_back(here->columns[0]);
  }
  if (any_degrees && any_radians)
    table.fail(table.first_line(), "joints in rad and in deg: expected one of both");
  known.insert(known.end(), columns.begin(), columns.end());
  refuse_unknown(table, known);
  const auto rows = values(table, columns);
  const auto joints = [&](const Eigen::VectorXd& row, double unit) {
    Eigen::VectorXd q = row;
    for (Eigen::Index k = 0; k < q.size(); ++k)
      if (!arm.links[static_cast<std::size_t>(k)].slides) q[k] *= unit;
    return q;
  };
  vision::PoseReading given, other;
  other.name =
      any_degrees ? "the angles are radians, not degrees" : "the angles are degrees, not radians";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::VectorXd q = joints(rows[i], any_degrees ? kDegree : 1.0);
    for (Eigen::Index k = 0; k < q.size(); ++k) {
      const bool inside = q[k] > arm.q_min[k] - kBeyond && q[k] < arm.q_max[k] + kBeyond;
      if (inside || arm.links[static_cast<std::size_t>(k)].endless) continue;
      table.fail(
          table.line(i),
          fmt::format("{}: {:g} is outside of the joint's limits, {:.4g} to {:.4g}{}",
                      columns[static_cast<std::size_t>(k)], rows[i][k], arm.q_min[k], arm.q_max[k],
                      any_degrees ? " rad" : "; if these are degrees, name the columns A1_deg"));
    }
    given.X_WF.push_back(kin::end_effector(arm, q));
    other.X_WF.push_back(kin::end_effector(arm, joints(rows[i], any_degrees ? 1.0 : kDegree)));
  }
  out.readings = {std::move(given), std::move(other)};
}

}  // namespace

ArmPoses read_arm_poses(const std::string& text, const std::string& name,
                        const kin::ArmModel* arm) {
  const Table table(text, name);
  std::string file_column;
  for (const char* each : {"file", "picture", "image"}) {
    if (!table.has(each)) continue;
    if (!file_column.empty())
      table.fail(table.first_line(), "columns '" + file_column + "' and '" + each +
                                         "' are both the picture's file; expected one");
    file_column = each;
  }
  if (file_column.empty())
    table.fail(table.first_line(), "expected a column 'file', the picture of each pose");
  ArmPoses out;
  std::map<std::string, int> seen;
  for (std::size_t row = 0; row < table.size(); ++row) {
    const std::string& file = table.cell(row, file_column);
    if (file.empty()) table.fail(table.line(row), "the picture's file is missing");
    const auto [at, fresh] = seen.emplace(file, table.line(row));
    if (!fresh)
      table.fail(table.line(row),
                 fmt::format("picture '{}' is in line {} already", file, at->second));
    out.files.push_back(file);
    out.lines.push_back(table.line(row));
  }
  arm != nullptr ? read_joints(table, file_column, *arm, out) : read_poses(table, file_column, out);
  return out;
}

}  // namespace mimesis::tool
