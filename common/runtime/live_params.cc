#include "common/runtime/live_params.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "common/error.h"
#include "common/runtime/describe.h"
#include "common/runtime/log.h"
#include "common/runtime/param_source.h"
#include "common/runtime/value_text.h"
#include "proto/params.pb.h"

namespace mimesis::runtime {
namespace {

using Values = std::vector<std::pair<std::string, std::string>>;

std::vector<ParamInfo> values_of(AnyNode& node) {
  return param_values([&node](ParamVisitor& v) { node.visit(v); });
}

std::string with_unit(const std::string& key) {
  const std::string unit = param_unit(key);
  return unit.empty() ? "" : " " + unit;
}

/// @throws ConfigError with one line for each value that is refused: "camera.noise: 50 is outside
/// [0, 40]"
void demand_changeable(const std::string& owner, const AnyNode& node,
                       const std::vector<ParamInfo>& infos, const Values& sets) {
  std::vector<std::string> keys, lines;
  for (const ParamInfo& info : infos) keys.push_back(info.key);
  for (const auto& [key, value] : sets) {
    const auto info = std::ranges::find(infos, key, &ParamInfo::key);
    if (info == infos.end()) {
      lines.push_back(
          fmt::format("{}.{}: unknown parameter{}", owner, key, did_you_mean(key, keys)));
    } else if (!info->changeable || !node.changeable()) {
      lines.push_back(fmt::format(
          "{}.{}: cannot change while the node runs: set it in the launch file or by --set", owner,
          key));
    }
  }
  if (!lines.empty()) throw ConfigError(fmt::format("{}", fmt::join(lines, "\n")));
}

void change(const std::string& owner, AnyNode& node, const Values& sets) {
  const std::vector<ParamInfo> before = values_of(node);
  demand_changeable(owner, node, before, sets);
  try {
    node.change([&](const VisitParams& visit) {
      const Yaml nothing;
      const Variables variables(nothing);
      ParamReader reader(owner, nullptr, variables, sets);
      visit(reader);
      reader.finish();
    });
  } catch (const ConfigError& e) {
    std::string line = e.what();
    constexpr std::string_view kPlace = "--set: ";
    for (std::size_t at; (at = line.find(kPlace)) != std::string::npos;)
      line.erase(at, kPlace.size());
    if (sets.size() == 1 && line.ends_with(']')) line += with_unit(sets.front().first);
    throw ConfigError(line);
  }
  const std::vector<ParamInfo> after = values_of(node);
  for (std::size_t i = 0; i < std::min(before.size(), after.size()); ++i) {
    if (before[i].value == after[i].value) continue;
    info("parameter {}: {} instead of {}{}", after[i].key, after[i].value, before[i].value,
         with_unit(after[i].key));
  }
}

constexpr std::array kLevelNames{"debug", "info", "warn", "error"};  // as enum class Level

/// @throws ConfigError
Level level_of(const std::string& name) {
  const auto level = std::ranges::find(kLevelNames, name);
  if (level == kLevelNames.end()) {
    throw ConfigError(fmt::format("log level '{}': expected one of {}{}", name,
                                  fmt::join(kLevelNames, ", "),
                                  did_you_mean(name, {kLevelNames.begin(), kLevelNames.end()})));
  }
  return static_cast<Level>(level - kLevelNames.begin());
}

v1::ParamSet answer(AnyNode& node, bool described) {
  v1::ParamSet all;
  for (const ParamInfo& info : values_of(node)) {
    v1::Param& param = *all.add_params();
    param.set_key(info.key);
    param.set_value(info.value);
    param.set_changeable(info.changeable && node.changeable());
    if (!described) continue;
    param.set_type(info.type);
    param.set_unit(param_unit(info.key));
    param.set_allowed(info.allowed);
    param.set_meaning(param_meaning(info.key));
  }
  return all;
}

}  // namespace

void serve_params(Bus& bus, AnyNode& node) {
  bus.serve("params", v1::ParamRequest::default_instance(), v1::ParamSet::default_instance(),
            [&node, owner = bus.node(), level = std::string()](
                const std::string& bytes) mutable -> tl::expected<std::string, Status> {
              v1::ParamRequest request;
              if (!request.ParseFromString(bytes)) return tl::unexpected(Status{"not a request"});
              Values sets;
              for (const v1::ParamValue& set : request.set())
                sets.emplace_back(set.key(), set.value());
              try {
                const bool levelled = !request.log_level().empty();
                const Level least = levelled ? level_of(request.log_level()) : Level::info;
                if (!sets.empty()) change(owner, node, sets);
                if (levelled) set_log_level(least);
                if (levelled) level = request.log_level();
              } catch (const ConfigError& e) {
                return tl::unexpected(Status{e.what()});
              }
              v1::ParamSet all = answer(node, request.described());
              all.set_log_level(level);
              return all.SerializeAsString();
            });
}

}  // namespace mimesis::runtime
