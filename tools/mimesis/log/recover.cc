#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/log/stream_reader.h"
#include "tools/mimesis/log/human.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/rewrite.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/stop_signals.h"

namespace mimesis::tool {
namespace {

class Recovery {
 public:
  Recovery(const log::Source& in, const log::Summary& summary, NewLog& out)
      : in_(in), summary_(summary), reader_(in), out_(out) {}

  tl::expected<Recovered, Status> run() {
    const StopSignals stop;
    Progress progress("recover", in_.size());
    while (const log::Record* record = reader_.next()) {
      if (stop.requested()) {
        result_.interrupted = true;
        return result_;
      }
      if (auto done = take(*record); !done) return tl::unexpected(done.error());
      progress.at(reader_.offset());
    }
    conclude();
    if (auto done = note_losses(); !done) return tl::unexpected(done.error());
    return result_;
  }

 private:
  log::Result take(const log::Record& record) {
    if (const auto* message = std::get_if<log::Message>(&record)) return take_message(*message);
    if (std::holds_alternative<log::Schema>(record) ||
        std::holds_alternative<log::Channel>(record)) {
      ids_.clear();
    } else if (const auto* attachment = std::get_if<log::Attachment>(&record)) {
      ++result_.attachments;
      return out_.attach(*attachment);
    } else if (const auto* metadata = std::get_if<log::Metadata>(&record)) {
      ++result_.metadata;
      return out_.add_metadata(*metadata);
    } else if (std::holds_alternative<log::DataEnd>(record)) {
      data_end_ = reader_.offset();
    } else if (const auto* statistics = std::get_if<log::Statistics>(&record)) {
      statistics_ = *statistics;
    }
    return {};
  }

  log::Result take_message(const log::Message& message) {
    const auto id = channel(message.channel_id);
    if (!id) return tl::unexpected(id.error());
    follow(message);
    log::Message copy = message;
    copy.channel_id = *id;
    return out_.write(copy);
  }

  /// Id in the output. A channel whose definition is nowhere in the file gets a name from its id.
  tl::expected<std::uint16_t, Status> channel(std::uint16_t id) {
    if (const auto known = ids_.find(id); known != ids_.end()) return known->second;
    const auto find = [](const auto& first, const auto& second, std::uint16_t key) {
      const auto it = first.find(key);
      if (it != first.end()) return &it->second;
      const auto other = second.find(key);
      return other == second.end() ? nullptr : &other->second;
    };
    const log::Channel* defined = find(reader_.channels(), summary_.channels, id);
    log::Channel placeholder;
    placeholder.topic = fmt::format("unknown/channel_{}", id);
    const log::Channel& chosen = defined == nullptr ? placeholder : *defined;
    const log::Schema* schema = find(reader_.schemas(), summary_.schemas, chosen.schema_id);
    const auto out = out_.channel(chosen, schema);
    if (!out) return out;
    RecoveredTopic& topic = result_.topics[id];
    topic.topic = chosen.topic;
    topic.node = sender_of(chosen);
    topic.placeholder = defined == nullptr;
    ids_.emplace(id, *out);
    return out;
  }

  void follow(const log::Message& message) {
    RecoveredTopic& topic = result_.topics.at(message.channel_id);
    const std::uint64_t damages = reader_.damage_count();
    const Sequence::Step step =
        message.sequence == 0 ? Sequence::Step{} : topic.sequence.next(message.sequence);
    if (step.missing > 0) {
      topic.missing.push_back({message.sequence - step.missing, step.missing, topic.last_ns,
                               message.log_time, damages > topic.damages_before});
    }
    ++topic.messages;
    topic.last_ns = message.log_time;
    topic.damages_before = damages;
  }

  void conclude() {
    result_.damages = reader_.damages();
    result_.damage_count = reader_.damage_count();
    result_.complete = reader_.complete();
    if (statistics_) {
      for (const auto& [id, count] : statistics_->channel_message_counts) {
        if (count == 0) continue;
        RecoveredTopic& topic = result_.topics[id];
        topic.expected = count;
        result_.lost |= topic.messages != count;
        if (!topic.topic.empty()) continue;  // else: not one message could be read
        const auto channel = summary_.channels.find(id);
        const bool known = channel != summary_.channels.end();
        topic.topic = known ? channel->second.topic : fmt::format("unknown/channel_{}", id);
        topic.node = known ? sender_of(channel->second) : "";
        topic.placeholder = !known;
      }
    }
    // Behind the data stands only what can be made again; a file may end where a record does.
    const std::uint64_t data_end = data_end_.value_or(in_.size());
    result_.lost |= result_.damage_count > result_.damages.size();
    for (const log::Damage& d : result_.damages) result_.lost |= d.offset < data_end;
    const bool data_sum_wrong = std::ranges::any_of(
        result_.damages, [&](const log::Damage& d) { return data_end_ && d.offset == *data_end_; });
    result_.lost |= data_sum_wrong;
  }

  /// Into the output: whoever checks it later knows why its counts do not fit.
  log::Result note_losses() {
    if (!result_.lost) return {};
    log::Metadata note{kRecoveredName, {{"damages", std::to_string(result_.damage_count)}}};
    for (const auto& [id, topic] : result_.topics) {
      if (topic.expected.value_or(0) <= topic.messages) continue;
      note.metadata[fmt::format("{} ({})", topic.topic, topic.node)] =
          fmt::format("missing={}", *topic.expected - topic.messages);
    }
    return out_.add_metadata(note);
  }

  const log::Source& in_;
  const log::Summary& summary_;  ///< definitions that stand behind the messages that need them
  log::StreamReader reader_;
  NewLog& out_;
  Recovered result_;
  std::map<std::uint16_t, std::uint16_t> ids_;  ///< input -> output; void after a new definition
  std::optional<std::uint64_t> data_end_;
  std::optional<log::Statistics> statistics_;
};

using nlohmann::ordered_json;

constexpr std::size_t kRunsShown = 10;  // per topic; all are in the JSON
constexpr int kInterruptedCode = 130;

std::string recovered_text(const RecoveredTopic& topic) {
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

ordered_json recovered_json(const RecoveredTopic& topic) {
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

ordered_json recovery_json(const std::string& input, const Recovered& recovered) {
  ordered_json out{{"input", input},
                   {"complete", recovered.complete},
                   {"lost", recovered.lost},
                   {"topics", ordered_json::array()},
                   {"damages", ordered_json::array()}};
  for (const auto& [id, topic] : recovered.topics) out["topics"].push_back(recovered_json(topic));
  for (const log::Damage& d : recovered.damages) {
    out["damages"].push_back({{"offset", d.offset}, {"what", d.what}});
  }
  return out;
}

}  // namespace

tl::expected<Recovered, Status> recover(const log::Source& in, const log::Summary& summary,
                                        NewLog& out) {
  return Recovery(in, summary, out).run();
}

std::string recovery_text(const std::string& input, const Recovered& recovered) {
  std::string text;
  for (const log::Damage& d : recovered.damages) {
    text += fmt::format("{}: byte {}: {}\n", input, d.offset, d.what);
  }
  if (recovered.damage_count > recovered.damages.size()) {
    text +=
        fmt::format("{}: and {} more\n", input, recovered.damage_count - recovered.damages.size());
  }
  for (const auto& [id, topic] : recovered.topics) text += recovered_text(topic);
  if (!recovered.complete) {
    std::uint64_t last = 0;
    for (const auto& [id, topic] : recovered.topics) last = std::max(last, topic.last_ns);
    text += fmt::format("{}: was not closed: what came after {} is not in the file\n", input,
                        human_time(last));
  }
  return text;
}

int log_recover(RecoverOptions options) {
  const auto source = log::open_file(options.input);
  if (!source) throw VerbEnd{source.error().reason, 3};
  const auto summary = log::summarize(**source);
  if (!summary) throw VerbEnd{options.input + ": " + summary.error().reason, 1};
  options.output.profile = summary->header.profile;
  NewLog out(options.output, {options.input});
  const auto recovered = recover(**source, *summary, out);
  if (recovered && recovered->interrupted) {
    throw VerbEnd{"interrupted: '" + out.path() + "' was not written", kInterruptedCode};
  }
  log::Result done;
  if (!recovered) done = tl::unexpected(recovered.error());
  if (done) done = out.finish(/*verify=*/true);
  if (!done) throw VerbEnd{done.error().reason + "; '" + out.path() + "' was not written", 1};
  std::cerr << recovery_text(options.input, *recovered) << out.line() << ", read back: whole\n";
  if (options.json) {
    auto object = out.json();
    object.update(recovery_json(options.input, *recovered));
    print_json(object);
  }
  return recovered->lost ? 1 : 0;
}

void add_recover(CLI::App& verb, int& exit_code) {
  CLI::App* recover = verb.add_subcommand(
      "recover",
      "Writes all that can be read of a damaged log into a new one (like mcap recover, ros2 bag "
      "reindex)");
  struct Options : RecoverOptions {
    std::vector<std::string> inputs;
  };
  auto o = std::make_shared<Options>();
  add_input_output(*recover, o->inputs, o->output);
  add_output_options(*recover, o->output);
  recover->add_flag("--json", o->json, "Print what is missing as one JSON object");
  recover->footer(
      "The output is read back and compared before it gets its name; the input is never changed.\n"
      "Exit code 0: nothing that was in the file is missing (a log that was not closed ends "
      "early,\n"
      "that is all); 1: the output is good, but something is missing: standard error says what.\n"
      "Logs of a killed recorder open without this.\n"
      "Example: mimesis log recover broken.mcap -o whole.mcap");
  on_run(*recover, exit_code, [o] {
    take_output(o->inputs, o->output);
    if (o->inputs.size() != 1) throw ConfigError("expected one log to recover");
    o->input = o->inputs.front();
    return log_recover(*o);
  });
}

}  // namespace mimesis::tool
