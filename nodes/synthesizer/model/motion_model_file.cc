#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "nodes/synthesizer/model/motion_model.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;
using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "mimesis.motion";
constexpr int kVersion = 1;

// --- writing

Json numbers(const Eigen::Ref<const Eigen::VectorXd>& v) {
  Json out = Json::array();
  for (Index i = 0; i < v.size(); ++i) out.push_back(v[i]);
  return out;
}

Json rows_of(const Eigen::MatrixXd& m) {
  Json out = Json::array();
  for (Index i = 0; i < m.rows(); ++i) out.push_back(numbers(m.row(i).transpose()));
  return out;
}

Json body_json(const mocap::Body& body) {
  Json offsets = Json::object();
  for (std::size_t j = 0; j < body.offset_m.size(); ++j) {
    offsets[std::string(mocap::kBodyJointNames[j])] = numbers(body.offset_m[j]);
  }
  const auto pair = [](const std::array<Eigen::Vector3d, 2>& v) {
    return Json{{"left", numbers(v[0])}, {"right", numbers(v[1])}};
  };
  return {{"name", body.name},           {"offset_m", offsets},
          {"toe_m", pair(body.toe_m)},   {"heel_m", pair(body.heel_m)},
          {"hand_m", pair(body.hand_m)}, {"head_top_m", numbers(body.head_top_m)}};
}

Json pattern_json(const Pattern& pattern) {
  const mocap::Trial& t = pattern.trial;
  return {{"clip", t.clip},
          {"style", t.style},
          {"cycle", t.cycle},
          {"first_frame", t.first_frame},
          {"last_frame", t.last_frame},
          {"duration_s", t.duration_s},
          {"step_length_m", t.step_length_m},
          {"turn_rad", t.turn_rad},
          {"task", t.task},
          {"mean_rad", numbers(pattern.mean_rad)},
          {"weight_rad", rows_of(pattern.weight_rad)},
          {"delay_rad", rows_of(pattern.delay_rad)}};
}

Json model_json(const MotionModel& model) {
  Json sources = Json::array(), patterns = Json::array();
  for (const Source& s : model.learned_from) {
    sources.push_back({{"file", s.file}, {"sha256", s.sha256}, {"licence", s.licence}});
  }
  for (const Pattern& p : model.patterns) patterns.push_back(pattern_json(p));
  return {{"format", kFormat},
          {"version", kVersion},
          {"name", model.name},
          {"created_by", model.created_by},
          {"learned_from", sources},
          {"body", body_json(model.body)},
          {"rows", model.rows},
          {"task_names", model.task_names},
          {"fixed", model.fixed},
          {"tied", model.tied},
          {"quality", model.quality},
          {"quality_squared", model.quality_squared},
          {"sources", rows_of(model.sources)},
          {"patterns", patterns}};
}

// --- reading

/// A value in the file and the way to it, for messages.
class Node {
 public:
  Node(const std::string& file, const Json& value, std::string where)
      : file_(file), value_(value), where_(std::move(where)) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw ConfigError(fmt::format("{}: {}{}", file_, where_.empty() ? "" : where_ + ": ", what));
  }
  Node operator[](const char* key) const {
    if (!value_.is_object()) fail("expected an object");
    const auto it = value_.find(key);
    const std::string where = where_.empty() ? key : where_ + "." + key;
    if (it == value_.end()) throw ConfigError(fmt::format("{}: {}: is missing", file_, where));
    return {file_, *it, where};
  }
  std::size_t size() const {
    if (!value_.is_array()) fail("expected a list");
    return value_.size();
  }
  Node at(std::size_t i) const { return {file_, value_[i], fmt::format("{}[{}]", where_, i)}; }

  std::string text() const {
    if (!value_.is_string()) fail("expected a text");
    return value_.get<std::string>();
  }
  bool flag() const {
    if (!value_.is_boolean()) fail("expected true or false");
    return value_.get<bool>();
  }
  long whole() const {
    if (!value_.is_number_integer()) fail("expected a whole number");
    return value_.get<long>();
  }
  double number() const {
    if (!value_.is_number() || !std::isfinite(value_.get<double>())) {
      fail("expected a finite number");
    }
    return value_.get<double>();
  }
  std::vector<std::string> texts() const {
    std::vector<std::string> out;
    for (std::size_t i = 0; i < size(); ++i) out.push_back(at(i).text());
    return out;
  }
  Eigen::VectorXd vector(Index expected) const {
    if (static_cast<Index>(size()) != expected) {
      fail(fmt::format("{} numbers, expected {}", size(), expected));
    }
    Eigen::VectorXd out(expected);
    for (Index i = 0; i < expected; ++i) out[i] = at(static_cast<std::size_t>(i)).number();
    return out;
  }
  Eigen::MatrixXd matrix(Index rows, Index cols) const {
    if (static_cast<Index>(size()) != rows) fail(fmt::format("{} rows, expected {}", size(), rows));
    Eigen::MatrixXd out(rows, cols);
    for (Index i = 0; i < rows; ++i) out.row(i) = at(static_cast<std::size_t>(i)).vector(cols);
    return out;
  }

 private:
  const std::string& file_;
  const Json& value_;
  std::string where_;
};

mocap::Body read_body(const Node& in) {
  mocap::Body body;
  body.name = in["name"].text();
  const Node offsets = in["offset_m"];
  for (std::size_t j = 0; j < body.offset_m.size(); ++j) {
    body.offset_m[j] = offsets[std::string(mocap::kBodyJointNames[j]).c_str()].vector(3);
  }
  const auto pair = [&](const char* key) {
    return std::array<Eigen::Vector3d, 2>{in[key]["left"].vector(3), in[key]["right"].vector(3)};
  };
  body.toe_m = pair("toe_m");
  body.heel_m = pair("heel_m");
  body.hand_m = pair("hand_m");
  body.head_top_m = in["head_top_m"].vector(3);
  return body;
}

Pattern read_pattern(const Node& in, Index rows, Index sources, Index tasks) {
  Pattern out;
  mocap::Trial& t = out.trial;
  t.clip = in["clip"].text();
  t.style = in["style"].text();
  t.cycle = static_cast<int>(in["cycle"].whole());
  t.first_frame = in["first_frame"].whole();
  t.last_frame = in["last_frame"].whole();
  t.duration_s = in["duration_s"].number();
  if (t.duration_s <= 0.0) in["duration_s"].fail("expected more than 0");
  t.step_length_m = in["step_length_m"].number();
  t.turn_rad = in["turn_rad"].number();
  const Eigen::VectorXd task = in["task"].vector(tasks);
  t.task.assign(task.begin(), task.end());
  out.mean_rad = in["mean_rad"].vector(rows);
  out.weight_rad = in["weight_rad"].matrix(rows, sources);
  out.delay_rad = in["delay_rad"].matrix(rows, sources);
  return out;
}

MotionModel read_model(const Node& in) {
  if (in["format"].text() != kFormat) {
    in["format"].fail(fmt::format("'{}', expected '{}'", in["format"].text(), kFormat));
  }
  if (in["version"].whole() != kVersion) {
    in["version"].fail(fmt::format("{}, expected {}", in["version"].whole(), kVersion));
  }
  MotionModel model;
  model.name = in["name"].text();
  model.created_by = in["created_by"].text();
  const Node learned = in["learned_from"];
  for (std::size_t i = 0; i < learned.size(); ++i) {
    const Node s = learned.at(i);
    model.learned_from.push_back({s["file"].text(), s["sha256"].text(), s["licence"].text()});
  }
  model.body = read_body(in["body"]);
  model.rows = in["rows"].texts();
  model.task_names = in["task_names"].texts();
  model.tied = in["tied"].flag();
  model.quality = in["quality"].number();
  model.quality_squared = in["quality_squared"].number();
  const Node sources = in["sources"], patterns = in["patterns"];
  if (model.rows.empty()) in["rows"].fail("empty, expected at least one row");
  if (sources.size() == 0 || sources.at(0).size() < 4) {
    sources.fail("expected at least one source of at least 4 samples");
  }
  const auto count = static_cast<Index>(sources.size());
  model.sources = sources.matrix(count, static_cast<Index>(sources.at(0).size()));
  const long fixed = in["fixed"].whole();
  if (fixed < 0 || fixed > count) in["fixed"].fail(fmt::format("{} of {} sources", fixed, count));
  model.fixed = static_cast<int>(fixed);
  if (patterns.size() == 0) patterns.fail("empty, expected at least one pattern");
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    model.patterns.push_back(read_pattern(patterns.at(i), static_cast<Index>(model.rows.size()),
                                          count, static_cast<Index>(model.task_names.size())));
  }
  return model;
}

/// The same checks for a model that is about to be written.
void check(const MotionModel& model, const std::string& file) {
  const Json json = model_json(model);
  read_model(Node(file, json, ""));
}

}  // namespace

MotionModel load_motion_model(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw ConfigError(file + ": cannot be read, expected a motion model");
  Json json;
  try {
    json = Json::parse(in);
  } catch (const nlohmann::json::parse_error& e) {
    throw ConfigError(
        fmt::format("{}: not JSON (at byte {}), expected a motion model", file, e.byte));
  }
  return read_model(Node(file, json, ""));
}

void save_motion_model(const MotionModel& model, const std::string& file) {
  check(model, file);
  const std::filesystem::path target(file), part(file + ".part");
  std::ofstream out(part, std::ios::binary);
  out << model_json(model).dump() << '\n';
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(part, target, error);
  if (!out || error) {
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    throw ConfigError(file + ": cannot be written");
  }
}

}  // namespace mimesis::synthesizer
