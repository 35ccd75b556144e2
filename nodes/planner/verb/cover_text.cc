#include "nodes/planner/verb/cover_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/mimesis/verb.h"

namespace mimesis::tool {

std::vector<std::pair<std::string, std::string>> touching_at_home(
    const model::CoveredArm& covered) {
  const kin::ArmModel& arm = covered.arm;
  std::vector<std::pair<std::string, std::string>> names;
  for (const auto& pair : model::touching_groups(arm, arm.home)) {
    if (std::ranges::count(arm.self_pairs, pair) == 0) continue;
    names.emplace_back(arm.groups[static_cast<std::size_t>(pair.first)],
                       arm.groups[static_cast<std::size_t>(pair.second)]);
  }
  return names;
}

std::string touching_text(const model::CoveredArm& covered) {
  std::string text;
  for (const auto& [a, b] : covered.always_touching)
    text += fmt::format("not checked against each other, as they touch in every posture: {}, {}\n",
                        a, b);
  for (const auto& [a, b] : touching_at_home(covered))
    text += fmt::format("they touch at home, where no plan can begin: {}, {}\n", a, b);
  return text;
}

std::string cover_text(const model::CoveredArm& covered) {
  const kin::ArmModel& arm = covered.arm;
  std::vector<std::string> groups, obstacles;
  for (const std::string& group : arm.groups) groups.push_back(yaml_word(group));
  const auto name = [&](int group) { return groups[static_cast<std::size_t>(group)]; };
  for (const int group : arm.env_groups) obstacles.push_back(name(group));
  std::string text =
      fmt::format("groups: [{}]\nobstacle_groups: [{}]\nself_pairs:{}\n", fmt::join(groups, ", "),
                  fmt::join(obstacles, ", "), arm.self_pairs.empty() ? " []" : "");
  for (const auto& [a, b] : arm.self_pairs)
    text += fmt::format("  - {{a: {}, b: {}}}\n", name(a), name(b));
  std::string balls, parts;
  for (const model::CoveredLink& link : covered.links) {
    const bool frame = link.link.starts_with("frame ");
    const std::string place = fmt::format(
        "{}, group: {}", frame ? "frame: " + link.link.substr(6) : "link: " + yaml_word(link.link),
        name(link.group));
    constexpr double kDigits_m = 1e-6;  // what they leave out
    for (const math::ConvexPart& part : link.parts) {
      if (part.points.rows() == 1) {
        balls +=
            fmt::format("  - {{{}, center_m: [{:.6f}], radius_m: {:.6f}}}\n", place,
                        fmt::join(std::vector(part.points.data(), part.points.data() + 3), ", "),
                        std::max(part.radius + kDigits_m, 1e-4));
        continue;
      }
      std::vector<double> numbers;
      for (const auto& point : part.points.rowwise())
        for (const double v : point) numbers.push_back(v);
      parts += fmt::format("  - {{{}, radius_m: {:.6f}, points_m: [{:.6f}]}}\n", place,
                           part.radius + kDigits_m, fmt::join(numbers, ", "));
    }
  }
  if (!balls.empty()) text += "balls:\n" + balls;
  if (!parts.empty()) text += "parts:  # hulls of points x y z, rounded\n" + parts;
  return text;
}

}  // namespace mimesis::tool
