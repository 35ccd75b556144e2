#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "tools/mimesis/log/replay_log.h"

namespace mimesis::tool {
namespace {

enum class Named { port, service, parameter, model_file };

struct FormerName {
  Named what;
  std::string_view program;  ///< empty: of every node
  std::string_view before, now;
};

// A row stays for ever: logs are kept. Parameters that went need none, the node names them.
constexpr FormerName kFormerNames[] = {
    // 0.1: joint states and enabling by their names; the obstacle of [M18] is the bar
    {Named::port, "mimesis_bridge", "arm", "joint_states"},
    {Named::port, "mimesis_sim_drives", "arm", "joint_states"},
    {Named::port, "mimesis_sim_powercube", "arm", "joint_states"},
    {Named::port, "mimesis_sim_body", "arm", "joint_states"},
    {Named::port, "mimesis_world", "arm", "joint_states"},
    {Named::port, "mimesis_planner", "arm", "joint_states"},
    {Named::port, "mimesis_camera", "arm", "joint_states"},
    {Named::port, "mimesis_walker", "joints", "joint_states"},
    {Named::service, "mimesis_bridge", "arm", "enable"},
    {Named::service, "mimesis_bridge", "disarm", "disable"},
    {Named::parameter, "mimesis_bridge", "arming", "enable"},
    {Named::parameter, "mimesis_cognition", "architecture", "network"},
    {Named::parameter, "mimesis_camera", "bridge_height_m", "bar_height_m"},
    {Named::parameter, "mimesis_camera", "bridge_removed", "bar_removed"},
    {Named::parameter, "mimesis_world", "bridge_height_m", "bar_height_m"},
    {Named::parameter, "mimesis_vision", "table.doubt", "table.inflation_sigma"},
    {Named::model_file, "", "bridge_table.yaml", "bar_table.yaml"},
    {Named::model_file, "", "bridge_ladder.yaml", "bar_fields.yaml"},
    {Named::model_file, "", "bundle_ladder.yaml", "bundle_fields.yaml"},
    {Named::model_file, "", "prototype_ladder.yaml", "prototype_fields.yaml"},
    {Named::model_file, "", "sequence_ladder.yaml", "sequence_fields.yaml"},
};

const FormerName* former(Named what, std::string_view program, std::string_view before) {
  const auto* it = std::ranges::find_if(kFormerNames, [&](const FormerName& f) {
    return f.what == what && f.before == before && (f.program.empty() || f.program == program);
  });
  return it == std::end(kFormerNames) ? nullptr : it;
}

/// A line of NodeStart.parameters: "    key: value", two spaces a level, as dump_params writes it.
struct Line {
  std::size_t depth = 0;
  std::string_view key, value;  ///< no key: an element of a list, or nothing
};

Line parse_line(std::string_view text) {
  Line line;
  const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
  line.depth = begin / 2;
  const std::size_t colon = text.find(':', begin);
  if (colon == text.npos || text[begin] == '-' || text[begin] == '"') return line;
  line.key = text.substr(begin, colon - begin);
  line.value = text.substr(std::min(text.find_first_not_of(' ', colon + 1), text.size()));
  return line;
}

std::optional<std::string> renamed_line(std::string_view program, std::string_view text,
                                        std::vector<std::string>& path,
                                        std::vector<std::string>& notes) {
  const Line line = parse_line(text);
  if (line.key.empty()) return std::nullopt;
  path.resize(std::min(path.size(), line.depth));
  path.emplace_back(line.key);
  std::string_view key = line.key;
  std::string value(line.value);
  if (const FormerName* f =
          former(Named::parameter, program, fmt::format("{}", fmt::join(path, ".")))) {
    key = f->now.substr(f->now.rfind('.') + 1);
    notes.push_back(fmt::format("parameter {} is called {} now", f->before, f->now));
  }
  if (value.size() >= 2 && value.front() == '"') {
    const FormerName* f = former(Named::model_file, program, value.substr(1, value.size() - 2));
    if (f != nullptr) {
      notes.push_back(fmt::format("models/{} is called {} now", f->before, f->now));
      value = fmt::format("\"{}\"", f->now);
    }
  }
  if (key == line.key && value == line.value) return std::nullopt;
  return fmt::format("{}{}: {}", std::string(2 * line.depth, ' '), key, value);
}

std::string renamed_parameters(std::string_view program, std::string_view text,
                               std::vector<std::string>& notes) {
  std::string out;
  std::vector<std::string> path;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    out += renamed_line(program, line, path, notes).value_or(std::string(line));
    out += '\n';
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

}  // namespace

std::vector<std::string> rename_former(v1::NodeStart& start) {
  const std::string program = std::filesystem::path(start.executable()).filename();
  std::vector<std::string> notes;
  for (auto* topics : {start.mutable_inputs(), start.mutable_outputs()}) {
    for (v1::TopicInfo& topic : *topics) {
      const FormerName* f = former(Named::port, program, topic.port());
      if (f == nullptr) continue;
      notes.push_back(fmt::format("port {} is called {} now", f->before, f->now));
      topic.set_port(std::string(f->now));
    }
  }
  start.set_parameters(renamed_parameters(program, start.parameters(), notes));
  return notes;
}

void rename_former(std::string_view program, v1::StepLog& steps) {
  const std::string name = std::filesystem::path(program).filename();
  const auto rename = [&](Named what, const std::string& before, auto set) {
    if (const FormerName* f = former(what, name, before)) set(std::string(f->now));
  };
  for (v1::InputSource& source : *steps.mutable_sources())
    rename(Named::port, source.port(), [&](const std::string& now) { source.set_port(now); });
  for (v1::StepRecord& step : *steps.mutable_steps()) {
    for (v1::ServedRequest& request : *step.mutable_requests()) {
      rename(Named::service, request.service(),
             [&](const std::string& now) { request.set_service(now); });
    }
  }
}

}  // namespace mimesis::tool
