#include "nodes/planner/verb/srdf.h"

#include <fmt/format.h>
#include <tinyxml.h>

#include <algorithm>
#include <optional>
#include <set>

#include "common/error.h"
#include "common/runtime/value_text.h"

namespace mimesis::tool {
namespace {

class Reader {
 public:
  Reader(const std::string& file, const robot::RobotTree& tree) : file_(file), tree_(tree) {}

  Srdf read() {
    TiXmlDocument document(file_);
    if (!document.LoadFile())
      throw ConfigError(fmt::format("{}:{}: {}, expected an SRDF", file_, document.ErrorRow(),
                                    document.ErrorDesc()));
    const TiXmlElement* robot = document.RootElement();
    if (robot == nullptr || robot->ValueStr() != "robot") fail(robot, "expected a `robot`");
    for (auto* e = robot->FirstChildElement("virtual_joint"); e != nullptr;
         e = e->NextSiblingElement("virtual_joint"))
      to_world_.insert(text(*e, "name"));
    for (auto* e = robot->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (e->ValueStr().starts_with("xacro:")) fail(e, "is xacro, expected what xacro makes of it");
      if (e->ValueStr() == "group") group(*e);
      if (e->ValueStr() == "group_state") state(*e);
      if (e->ValueStr() == "disable_collisions") disabled(*e);
    }
    return std::move(out_);
  }

 private:
  [[noreturn]] void fail(const TiXmlElement* e, const std::string& what) const {
    throw ConfigError(fmt::format("{}:{}: {}", file_, e != nullptr ? e->Row() : 1, what));
  }
  std::string text(const TiXmlElement& e, const char* name) const {
    const char* value = e.Attribute(name);
    if (value == nullptr) fail(&e, fmt::format("{} has no {}", e.ValueStr(), name));
    return value;
  }
  std::string lacks(const TiXmlElement& e, const char* what, const std::string& name) const {
    return fmt::format("{}:{}: {} '{}', expected one of {}", file_, e.Row(), what, name,
                       tree_.name());
  }
  /// By the link that it carries; nothing if the robot has no such joint.
  std::optional<int> joint(const std::string& name) const {
    const auto& links = tree_.links();
    const auto found = std::ranges::find(links, name, &robot::Link::joint);
    if (found == links.end() || name.empty()) return std::nullopt;
    return static_cast<int>(found - links.begin());
  }

  void group(const TiXmlElement& e) {
    const std::string name = text(e, "name");
    if (const auto* chain = e.FirstChildElement("chain")) {
      Srdf::Chain& made = out_.chains[name] = {text(*chain, "base_link"), text(*chain, "tip_link")};
      for (const std::string& link : {made.base, made.tip})
        if (tree_.find_link(link) < 0) made.fault = lacks(*chain, "link", link);
      return;
    }
    std::vector<int> carried;  // links
    for (auto* j = e.FirstChildElement("joint"); j != nullptr; j = j->NextSiblingElement("joint")) {
      const std::string joint_name = text(*j, "name");
      const auto found = joint(joint_name);
      if (found) {
        carried.push_back(*found);
      } else if (!to_world_.contains(joint_name)) {
        out_.chains[name].fault = lacks(*j, "joint", joint_name);
        return;
      }
    }
    std::ranges::sort(carried);
    if (carried.empty()) return;
    for (std::size_t i = 1; i < carried.size(); ++i)
      if (tree_.link(carried[i]).parent != carried[i - 1]) return;  // no chain
    const int parent = tree_.link(carried.front()).parent;
    out_.chains[name] = {tree_.link(parent).name, tree_.link(carried.back()).name};
  }

  void state(const TiXmlElement& e) {
    Srdf::State state{text(e, "name"), "", {}};
    if (const char* group = e.Attribute("group")) state.group = group;
    for (auto* j = e.FirstChildElement("joint"); j != nullptr; j = j->NextSiblingElement("joint")) {
      const std::string value = text(*j, "value");
      const auto number = runtime::to_double(value);
      if (value.find(' ') != std::string::npos) continue;  // of a joint with more than one
      if (!number) fail(j, fmt::format("value '{}', expected a number", value));
      state.joints[text(*j, "name")] = *number;
    }
    out_.states.push_back(std::move(state));
  }

  void disabled(const TiXmlElement& e) {
    const char* reason = e.Attribute("reason");
    out_.disabled.push_back(
        {{text(e, "link1"), text(e, "link2")}, reason != nullptr ? reason : ""});
  }

  std::string file_;
  std::set<std::string> to_world_;  // joints that the SRDF alone knows
  const robot::RobotTree& tree_;
  Srdf out_;
};

}  // namespace

Srdf read_srdf(const std::string& file, const robot::RobotTree& tree) {
  return Reader(file, tree).read();
}

}  // namespace mimesis::tool
