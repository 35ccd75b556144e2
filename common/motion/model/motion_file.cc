// The file of a motion model: reading and writing.
#include <Eigen/Core>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "common/error.h"
#include "common/json_text.h"
#include "common/motion/mocap/body.h"
#include "common/motion/model/motion_model.h"

namespace mimesis::motion {
namespace {

using Json = nlohmann::ordered_json;

/// A value in the file and its path, as in "patterns[3].mean_rad", for errors that tell where the
/// file does not fit.
class Node {
 public:
  Node(const Json& value, std::string path) : value_(value), path_(std::move(path)) {}

  /// @throws ConfigError if it is no object, or lacks the key
  Node at(std::string_view key) const {
    if (!value_.is_object()) fail(value_.type_name(), "an object");
    const auto it = value_.find(key);
    const std::string path = path_.empty() ? std::string(key) : path_ + '.' + std::string(key);
    if (it == value_.end()) throw ConfigError(path + " is missing");
    return {*it, path};
  }

  Node at(std::size_t index) const {
    return {value_.at(index), path_ + '[' + std::to_string(index) + ']'};
  }

  bool has(std::string_view key) const { return value_.is_object() && value_.contains(key); }
  bool is_null() const { return value_.is_null(); }
  std::size_t size() const {
    if (!value_.is_array()) fail(value_.type_name(), "an array");
    return value_.size();
  }

  /// Refuses all but an array of `count` elements.
  void expect_size(std::size_t count) const {
    if (size() != count) {
      fail("an array of " + std::to_string(size()), std::to_string(count) + " elements");
    }
  }

  std::string text() const {
    if (!value_.is_string()) fail(value_.type_name(), "a text");
    return value_.get<std::string>();
  }

  bool boolean() const {
    if (!value_.is_boolean()) fail(value_.type_name(), "true or false");
    return value_.get<bool>();
  }

  long integer() const {
    if (!value_.is_number_integer()) fail(value_.type_name(), "a whole number");
    return value_.get<long>();
  }

  double number() const {
    if (!value_.is_number()) fail(value_.type_name(), "a number");
    const auto x = value_.get<double>();
    if (!std::isfinite(x)) fail("not finite", "a number");
    return x;
  }

  std::vector<std::string> texts() const {
    std::vector<std::string> out;
    for (std::size_t i = 0; i < size(); ++i) out.push_back(at(i).text());
    return out;
  }

  std::vector<double> numbers() const {
    std::vector<double> out;
    for (std::size_t i = 0; i < size(); ++i) out.push_back(at(i).number());
    return out;
  }

  Eigen::VectorXd vector(Eigen::Index count) const {
    expect_size(static_cast<std::size_t>(count));
    const std::vector<double> values = numbers();
    return Eigen::Map<const Eigen::VectorXd>(values.data(), count);
  }

  Eigen::Vector3d point() const { return vector(3); }
  /// Array of `rows` arrays of `cols` numbers; -1: as many as there are, the same in all rows.
  Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index cols) const {
    if (rows >= 0) expect_size(static_cast<std::size_t>(rows));
    const auto count = static_cast<Eigen::Index>(size());
    if (cols < 0) cols = count == 0 ? 0 : static_cast<Eigen::Index>(at(std::size_t{0}).size());
    Eigen::MatrixXd out(count, cols);
    for (Eigen::Index r = 0; r < count; ++r) {
      out.row(r) = at(static_cast<std::size_t>(r)).vector(cols).transpose();
    }
    return out;
  }

  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw ConfigError((path_.empty() ? "the file" : path_) + " is " + found + ", expected " +
                      expected);
  }

 private:
  const Json& value_;
  std::string path_;
};

Json to_json(const Eigen::VectorXd& v) { return std::vector<double>(v.begin(), v.end()); }

Json to_json(const Eigen::MatrixXd& m) {
  Json out = Json::array();
  for (Eigen::Index r = 0; r < m.rows(); ++r) out.push_back(to_json(Eigen::VectorXd(m.row(r))));
  return out;
}

constexpr const char* kFormat = "mimesis.motion";
constexpr long kVersion = 1;
/// Larger ones are no models: a period of 100 samples is enough for all that people do.
constexpr std::uintmax_t kLargestFile = std::uintmax_t{256} << 20U;

Json points_to_json(const std::array<Eigen::Vector3d, 2>& points) {
  return {{"left", to_json(Eigen::VectorXd(points[mocap::kLeft]))},
          {"right", to_json(Eigen::VectorXd(points[mocap::kRight]))}};
}

Json body_to_json(const mocap::Body& body) {
  Json joints = Json::object();
  for (std::size_t j = 0; j < mocap::kBodyJoints; ++j) {
    joints[std::string(mocap::kBodyJointNames[j])] = to_json(Eigen::VectorXd(body.offset_m[j]));
  }
  return {{"name", body.name},
          {"offset_m", joints},
          {"heel_m", points_to_json(body.heel_m)},
          {"toe_m", points_to_json(body.toe_m)},
          {"hand_m", points_to_json(body.hand_m)},
          {"head_top_m", to_json(Eigen::VectorXd(body.head_top_m))}};
}

std::array<Eigen::Vector3d, 2> points_from(const Node& node) {
  return {node.at("left").point(), node.at("right").point()};
}

mocap::Body body_from(const Node& node) {
  mocap::Body body;
  body.name = node.at("name").text();
  const Node joints = node.at("offset_m");
  for (std::size_t j = 0; j < mocap::kBodyJoints; ++j) {
    body.offset_m[j] = joints.at(mocap::kBodyJointNames[j]).point();
  }
  body.heel_m = points_from(node.at("heel_m"));
  body.toe_m = points_from(node.at("toe_m"));
  body.hand_m = points_from(node.at("hand_m"));
  body.head_top_m = node.at("head_top_m").point();
  return body;
}

Json pattern_to_json(const Pattern& p, bool with_delays) {
  Json out = {{"clip", p.trial.clip},
              {"style", p.trial.style},
              {"cycle", p.trial.cycle},
              {"first_frame", p.trial.first_frame},
              {"last_frame", p.trial.last_frame},
              {"duration_s", p.trial.duration_s},
              {"step_length_m", p.trial.step_length_m},
              {"turn_rad", p.trial.turn_rad},
              {"task", p.trial.task},
              {"mean_rad", to_json(p.mean_rad)},
              {"weight_rad", to_json(p.weight_rad)}};
  if (with_delays) out["delay_rad"] = to_json(p.delay_rad);
  return out;
}

Pattern pattern_from(const Node& node, const MotionModel& model, const Eigen::MatrixXd* delay_rad) {
  const auto rows = static_cast<Eigen::Index>(model.rows.size());
  const Eigen::Index sources = model.sources.rows();
  Pattern p;
  p.trial.clip = node.at("clip").text();
  p.trial.style = node.at("style").text();
  p.trial.cycle = static_cast<int>(node.at("cycle").integer());
  p.trial.first_frame = node.at("first_frame").integer();
  p.trial.last_frame = node.at("last_frame").integer();
  p.trial.duration_s = node.at("duration_s").number();
  if (p.trial.duration_s <= 0.0) node.at("duration_s").fail("not positive", "a time in s");
  p.trial.step_length_m = node.at("step_length_m").number();
  p.trial.turn_rad = node.at("turn_rad").number();
  p.trial.task = node.at("task").numbers();
  node.at("task").expect_size(model.task_names.size());
  p.mean_rad = node.at("mean_rad").vector(rows);
  p.weight_rad = node.at("weight_rad").matrix(rows, sources);
  p.delay_rad = delay_rad ? *delay_rad : node.at("delay_rad").matrix(rows, sources);
  return p;
}

Json limits_to_json(const MotionModel& m) {
  Json out = Json::array();
  for (const auto& limits : m.limits_rad) {
    out.push_back(limits ? Json{limits->lower, limits->upper} : Json(nullptr));
  }
  return out;
}

Json model_to_json(const MotionModel& m) {
  Json files = Json::array();
  for (const Source& s : m.learned_from) {
    files.push_back({{"file", s.file}, {"sha256", s.sha256}, {"licence", s.licence}});
  }
  Json out = {{"format", kFormat},
              {"version", kVersion},
              {"name", m.name},
              {"created_by", m.created_by},
              {"learned_from", files},
              {"quality", {{"Q", m.quality}, {"Q2", m.quality_squared}}},
              {"body", body_to_json(m.body)},
              {"rows", m.rows},
              {"task_names", m.task_names},
              {"fixed", m.fixed},
              {"tied", m.tied},
              {"sources", to_json(m.sources)}};
  if (!m.limits_rad.empty()) out["limits_rad"] = limits_to_json(m);
  if (m.tied && !m.patterns.empty()) out["delay_rad"] = to_json(m.patterns.front().delay_rad);
  out["patterns"] = Json::array();
  for (const Pattern& p : m.patterns) out["patterns"].push_back(pattern_to_json(p, !m.tied));
  return out;
}

std::vector<std::optional<RowLimits>> limits_from(const Node& node, std::size_t rows) {
  node.expect_size(rows);
  std::vector<std::optional<RowLimits>> out(rows);
  for (std::size_t r = 0; r < rows; ++r) {
    const Node row = node.at(r);
    if (row.is_null()) continue;
    row.expect_size(2);
    out[r] = {row.at(std::size_t{0}).number(), row.at(std::size_t{1}).number()};
    if (out[r]->lower >= out[r]->upper) row.fail("empty", "lower < upper");
  }
  return out;
}

MotionModel model_from(const Node& node) {
  if (const std::string format = node.at("format").text(); format != kFormat) {
    node.at("format").fail("'" + mocap::one_line(format) + "'", std::string("'") + kFormat + "'");
  }
  if (const long version = node.at("version").integer(); version != kVersion) {
    node.at("version").fail(std::to_string(version), std::to_string(kVersion));
  }
  MotionModel m;
  m.name = node.at("name").text();
  m.created_by = node.at("created_by").text();
  const Node files = node.at("learned_from");
  for (std::size_t i = 0; i < files.size(); ++i) {
    const Node file = files.at(i);
    m.learned_from.push_back(
        {file.at("file").text(), file.at("sha256").text(), file.at("licence").text()});
  }
  m.quality = node.at("quality").at("Q").number();
  m.quality_squared = node.at("quality").at("Q2").number();
  m.body = body_from(node.at("body"));
  m.rows = node.at("rows").texts();
  m.task_names = node.at("task_names").texts();
  m.tied = node.at("tied").boolean();
  if (node.has("limits_rad")) m.limits_rad = limits_from(node.at("limits_rad"), m.rows.size());
  m.sources = node.at("sources").matrix(-1, -1);
  if (m.sources.rows() < 1 || m.sources.cols() < 2) {
    node.at("sources").fail("empty", "one source of two samples at least");
  }
  const long fixed = node.at("fixed").integer();
  if (fixed < 0 || fixed > m.sources.rows()) {
    node.at("fixed").fail(std::to_string(fixed), "0 to " + std::to_string(m.sources.rows()));
  }
  m.fixed = static_cast<int>(fixed);
  Eigen::MatrixXd delay_rad;
  if (m.tied) {
    delay_rad =
        node.at("delay_rad").matrix(static_cast<Eigen::Index>(m.rows.size()), m.sources.rows());
  }
  const Node patterns = node.at("patterns");
  if (patterns.size() == 0) patterns.fail("empty", "one pattern at least");
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    m.patterns.push_back(pattern_from(patterns.at(i), m, m.tied ? &delay_rad : nullptr));
  }
  return m;
}

/// One line for each thing, so that files can be compared: patterns, rows of sources.
void write(const Json& model, std::ostream& out) {
  out << "{\n";
  std::size_t left = model.size();
  for (const auto& [key, value] : model.items()) {
    out << Json(key).dump() << ": ";
    if (key == "patterns" || key == "sources" || key == "learned_from") {
      out << '[';
      for (std::size_t i = 0; i < value.size(); ++i) {
        out << (i == 0 ? "\n " : ",\n ") << json_text(value[i]);
      }
      out << "\n]";
    } else {
      out << json_text(value);
    }
    out << (--left > 0 ? ",\n" : "\n");
  }
  out << "}\n";
}

std::string read_file(const std::string& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) throw ConfigError(file + ": " + error.message() + ", expected a motion model");
  if (size > kLargestFile) throw ConfigError(file + ": larger than a motion model can be (256 MB)");
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw ConfigError(file + ": cannot be read: " + std::strerror(errno));
  return text.str();
}

}  // namespace

MotionModel parse_motion_model(std::string_view text, const std::string& file) {
  try {
    const Json json = Json::parse(text);
    return model_from(Node(json, ""));
  } catch (const nlohmann::json::parse_error& e) {
    throw ConfigError(file + ": byte " + std::to_string(e.byte) +
                      ": no JSON there, expected a motion model (*.motion.json)");
  } catch (const nlohmann::json::out_of_range&) {
    throw ConfigError(file + ": a number is too large, expected a motion model (*.motion.json)");
  } catch (const ConfigError& e) {
    throw ConfigError(file + ": " + e.what());
  }
}

MotionModel load_motion_model(const std::string& file) {
  return parse_motion_model(read_file(file), file);
}

void save_motion_model(const MotionModel& model, const std::string& file) {
  // a device or pipe of that name must not be replaced by a file
  using enum std::filesystem::file_type;
  std::error_code error;
  if (const auto kind = std::filesystem::status(file, error).type();
      kind != regular && kind != not_found && kind != none) {
    throw ConfigError(file + ": cannot be written, expected a file or a new name");
  }
  const std::string temporary = file + ".part";
  std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
  write(model_to_json(model), out);
  out.close();
  if (out) std::filesystem::rename(temporary, file, error);
  if (!out || error) {
    const std::string why = error ? error.message() : std::strerror(errno);
    std::filesystem::remove(temporary, error);
    throw ConfigError(file + ": cannot be written: " + why);
  }
}

}  // namespace mimesis::motion
