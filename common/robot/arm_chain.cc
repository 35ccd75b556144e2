#include "common/robot/arm_chain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "common/error.h"

namespace mimesis::robot {
namespace {

bool holds(const std::string& name, std::string_view part) {
  const auto same = [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; };
  return std::search(name.begin(), name.end(), part.begin(), part.end(), same) != name.end();
}

bool is_called(const Link& link, std::string_view part) {
  return holds(link.joint, part) || holds(link.name, part);
}

class ChainFinder {
 public:
  explicit ChainFinder(const RobotTree& tree) : tree_(tree) {}

  int tip_beyond(int base) {
    follow(base, 0);
    const int most = std::ranges::max(ends_, {}, &End::joints).joints;
    std::vector<End> longest;
    std::ranges::copy_if(ends_, std::back_inserter(longest),
                         [most](const End& end) { return end.joints == most; });
    if (most == 0)
      throw ConfigError(
          fmt::format("{}: no joint moves beyond link '{}'", tree_.name(), tree_.link(base).name));
    if (longest.size() == 1) return longest.front().tip;
    std::vector<std::string> tips;
    for (const End& end : longest) tips.push_back('\'' + tree_.link(end.tip).name + '\'');
    throw ConfigError(fmt::format("{}: {} chains of {} joints, expected as tip (--tip) one of {}",
                                  tree_.name(), longest.size(), most, fmt::join(tips, ", ")));
  }

 private:
  /// Shorter ones that fork are trunks with arms, longer ones are arms with fingers.
  static constexpr int kLeastArm = 4;
  struct End {
    int tip = 0, joints = 0;
  };

  /// All links that are fixed to this one, itself first; `moved`: the next ones that move.
  std::vector<int> fixed_to(int link, std::vector<int>& moved) const {
    std::vector<int> all{link};
    for (std::size_t i = 0; i < all.size(); ++i) {
      for (int l = all[i] + 1; l < std::ssize(tree_.links()); ++l) {
        if (tree_.link(l).parent != all[i]) continue;
        (tree_.link(l).type == JointType::fixed ? all : moved).push_back(l);
      }
    }
    return all;
  }

  /// By its name. A "gripper" that carries more joints is the palm.
  bool is_finger(int link) const {
    constexpr std::string_view kFingers[] = {"finger", "jaw", "knuckle", "thumb", "claw"};
    const Link& named = tree_.link(link);
    if (std::ranges::any_of(kFingers, [&](auto part) { return is_called(named, part); }))
      return true;
    std::vector<int> moved;
    fixed_to(link, moved);
    return moved.empty() && is_called(named, "gripper");
  }

  void follow(int link, int joints) {
    std::vector<int> moved;
    const std::vector<int> body = fixed_to(link, moved);
    const bool hand =
        joints >= kLeastArm && !moved.empty() && (moved.size() > 1 || is_finger(moved.front()));
    if (hand) return ends_.push_back({tree_.link(moved.front()).parent, joints});
    if (moved.empty()) return ends_.push_back({tool_of(body), joints});
    for (const int next : moved) follow(next, joints + 1);
  }

  int tool_of(const std::vector<int>& body) const {
    constexpr std::string_view kTools[] = {"tool0",   "tcp",   "end_effector",
                                           "ee_link", "grasp", "tool"};
    for (const std::string_view tool : kTools) {
      for (const int link : body) {
        if (holds(tree_.link(link).name, tool)) return link;
      }
    }
    return body.front();
  }

  const RobotTree& tree_;
  std::vector<End> ends_;
};

}  // namespace

ArmChain find_arm_chain(const RobotTree& tree, const std::string& base, const std::string& tip) {
  const int first = base.empty() ? 0 : tree.require_link(base);
  const int last = tip.empty() ? ChainFinder(tree).tip_beyond(first) : tree.require_link(tip);
  ArmChain chain{tree.link(first).name, tree.link(last).name, {}, {}};
  for (int l = last; l != first; l = tree.link(l).parent) {
    if (l < 0)
      throw ConfigError(
          fmt::format("{}: link '{}' does not carry '{}'", tree.name(), chain.base, chain.tip));
    if (tree.link(l).type != JointType::fixed) chain.joints.insert(chain.joints.begin(), l);
  }
  for (int l = first + 1; l < std::ssize(tree.links()); ++l) {
    const Link& link = tree.link(l);
    const bool beside = tree.carries(first, l) && std::ranges::count(chain.joints, l) == 0;
    if (beside && link.type != JointType::fixed && link.mimics.empty())
      chain.fixed.emplace_back(link.joint, std::min(std::max(0.0, link.lower), link.upper));
  }
  return chain;
}

}  // namespace mimesis::robot
