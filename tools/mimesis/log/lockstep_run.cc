#include "tools/mimesis/log/lockstep_run.h"

#include <fmt/format.h>

#include <optional>

#include "common/runtime/own_topics.h"
#include "proto/steps.pb.h"

namespace mimesis::tool {

RunLimit run_limit(const std::vector<OpenLog>& logs, const std::string& until_topic) {
  auto verdicts = merged(
      logs, {.channel = [&](const log::Channel& channel) { return channel.topic == until_topic; }});
  if (const Item* verdict = verdicts.next()) {
    return {verdict->message->log_time, fmt::format("{} ended the run", until_topic), false};
  }
  std::optional<std::pair<std::uint64_t, std::string>> first;  // graph time, node
  auto steps = merged(logs, {.channel = [](const log::Channel& channel) {
                        return runtime::is_own_topic(channel.topic, runtime::kStepsPort);
                      }});
  v1::StepLog log;
  while (const Item* item = steps.next()) {
    if (!parse(*item, log)) continue;
    for (const v1::StepRecord& step : log.steps()) {
      if (step.kind() != v1::STEP_KIND_STOP || (first && first->first <= step.time_ns())) continue;
      first = {step.time_ns(), sender_of(*item->channel)};
    }
  }
  if (!first) return {span_of(logs).end_ns, "the log ends", true};
  return {first->first == 0 ? 0 : first->first - 1, fmt::format("node '{}' stopped", first->second),
          false};
}

const std::map<std::string, std::set<std::string>>& wall_fields() {
  static const std::map<std::string, std::set<std::string>> kFields{
      {"mimesis.v1.ClockTime", {"wall_ns"}},
      {"mimesis.v1.TaskStatus", {"plan_compute_s"}},
      {"mimesis.v1.WalkerStatus", {"mean_tick_s", "worst_tick_s"}},
      {"mimesis.v1.CrowdStatus", {"mean_step_s", "worst_step_s"}},
      {"mimesis.v1.CrowdOutcome", {"steps_1_s", "agent_steps_1_s"}}};
  return kFields;
}

bool in_lockstep(const std::vector<OpenLog>& logs) {
  bool lockstep = false;
  each_metadata(
      logs, "mimesis.launch",
      [&](const log::Metadata& launch) {
        const auto clock = launch.metadata.find("clock");
        lockstep = clock != launch.metadata.end() && clock->second == "lockstep";
      },
      /*silent=*/true);
  return lockstep;
}

}  // namespace mimesis::tool
