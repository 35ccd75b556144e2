#include "tools/mimesis/log/recover_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "tools/mimesis/log/human.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kRunsShown = 10;  // per topic; all are in the JSON
constexpr int kInterrupted = 130;

std::string topic_text(const RecoveredTopic& topic) {
  std::string text;
  if (topic.placeholder) {
    text += fmt::format("{}: the definition of this channel is gone: without topic and type\n",
                        topic.topic);
  }
  const std::string name =
      topic.node.empty() ? topic.topic : fmt::format("{} ({})", topic.topic, topic.node);
  if (topic.expected && *topic.expected != topic.messages) {
    text += fmt::format("{}: {} of {} messages\n", name, topic.messages, *topic.expected);
  }
  for (std::size_t i = 0; i < topic.missing.size() && i < kRunsShown; ++i) {
    const MissingRun& run = topic.missing[i];
    text += fmt::format("{}: missing seq {} to {} ({}), between {} and {}{}\n", name, run.first_seq,
                        run.first_seq + run.messages - 1, run.messages, human_time(run.after_ns),
                        human_time(run.before_ns),
                        run.damaged ? "" : ": never recorded, the file is whole there");
  }
  if (topic.missing.size() > kRunsShown) {
    text += fmt::format("{}: and {} more gaps\n", name, topic.missing.size() - kRunsShown);
  }
  return text;
}

ordered_json topic_json(const RecoveredTopic& topic) {
  ordered_json missing = ordered_json::array();
  for (const MissingRun& run : topic.missing) {
    missing.push_back({{"first_seq", run.first_seq},
                       {"messages", run.messages},
                       {"after_ns", run.after_ns},
                       {"before_ns", run.before_ns},
                       {"damaged", run.damaged}});
  }
  return {{"topic", topic.topic},
          {"node", topic.node},
          {"messages", topic.messages},
          {"expected", topic.expected ? ordered_json(*topic.expected) : ordered_json(nullptr)},
          {"last_ns", topic.last_ns},
          {"missing", missing}};
}

}  // namespace

std::string recovery_text(const std::string& input, const Recovered& recovered) {
  std::string text;
  for (const log::Damage& d : recovered.damages) {
    text += fmt::format("{}: byte {}: {}\n", input, d.offset, d.what);
  }
  if (recovered.damage_count > recovered.damages.size()) {
    text +=
        fmt::format("{}: and {} more\n", input, recovered.damage_count - recovered.damages.size());
  }
  for (const auto& [id, topic] : recovered.topics) text += topic_text(topic);
  if (!recovered.complete) {
    std::uint64_t last = 0;
    for (const auto& [id, topic] : recovered.topics) last = std::max(last, topic.last_ns);
    text += fmt::format("{}: was not closed: what came after {} is not in the file\n", input,
                        human_time(last));
  }
  return text;
}

ordered_json recovery_json(const std::string& input, const Recovered& recovered) {
  ordered_json out{{"input", input},
                   {"complete", recovered.complete},
                   {"lost", recovered.lost},
                   {"topics", ordered_json::array()},
                   {"damages", ordered_json::array()}};
  for (const auto& [id, topic] : recovered.topics) out["topics"].push_back(topic_json(topic));
  for (const log::Damage& d : recovered.damages) {
    out["damages"].push_back({{"offset", d.offset}, {"what", d.what}});
  }
  return out;
}

int log_recover(RecoverOptions options) {
  const auto source = log::open_file(options.input);
  if (!source) {
    std::cerr << source.error().reason << '\n';
    return 3;
  }
  const auto summary = log::summarize(**source);
  if (!summary) {
    std::cerr << options.input << ": " << summary.error().reason << '\n';
    return 1;
  }
  options.output.profile = summary->header.profile;
  NewLog out(options.output, {options.input});
  const auto recovered = recover(**source, *summary, out);
  if (recovered && recovered->interrupted) {
    std::cerr << "interrupted: '" << out.path() << "' was not written\n";
    return kInterrupted;
  }
  log::Result done;
  if (!recovered) done = tl::unexpected(recovered.error());
  if (done) done = out.finish(/*verify=*/true);
  if (!done) {
    std::cerr << done.error().reason << "; '" << out.path() << "' was not written\n";
    return 1;
  }
  std::cerr << recovery_text(options.input, *recovered) << out.line() << ", read back: whole\n";
  if (options.json) {
    auto object = out.json();
    object.update(recovery_json(options.input, *recovered));
    std::cout << object.dump(-1, ' ', false, ordered_json::error_handler_t::replace) << '\n';
  }
  return recovered->lost ? 1 : 0;
}

}  // namespace mimesis::tool
