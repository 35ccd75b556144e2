// `mimesis topic pub`: publishes messages that are given as JSON.
#include <fmt/format.h>
#include <google/protobuf/message.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
#include "common/runtime/raw.h"
#include "common/runtime/value_text.h"
#include "common/runtime/zmq_bus.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/json_depth.h"
#include "tools/mimesis/stop_signals.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using Clock = std::chrono::steady_clock;

struct PubOptions : GraphOptions {
  std::string topic, name;
  std::vector<std::string> words;  ///< [TYPE] [MESSAGE]
  double rate_hz = 0.0;            ///< 0: once, or lines as they come
  int count = 0;                   ///< 0: without end
  int wait_for = -1;               ///< subscribers; -1: those that are there
  bool from_stdin = false, latched = false;
  bool into_live = false;  ///< though running nodes publish it, or could move a robot by it
};

/// The type of a topic: the one given, or that of its publishers and subscribers, with descriptors.
struct TopicType {
  std::string type, descriptors;
};
/// @throws VerbFailure
TopicType type_of(const std::vector<v1::NodeInfo>& nodes, const std::string& topic,
                  std::string type) {
  for (const v1::NodeInfo& node : nodes) {
    for (const auto* topics : {&node.inputs(), &node.outputs()}) {
      for (const v1::TopicInfo& t : *topics) {
        if (t.topic() == topic && type.empty()) type = t.type();
      }
    }
  }
  if (type.empty()) {
    throw VerbFailure{fmt::format("nobody in the graph knows {}: name its type, or a topic that is "
                                  "there{}",
                                  topic, runtime::did_you_mean(topic, topic_names(nodes))),
                      kNotFound};
  }
  std::vector<std::string> known;
  for (const v1::NodeInfo& node : nodes) {
    for (const auto& [name, set] : node.descriptors()) {
      if (name == type) return {type, set};
      known.push_back(name);
    }
  }
  // Nodes announce the types that they send; those that they take may stand in the same files.
  runtime::TypePool pool;
  for (const v1::NodeInfo& node : nodes) {
    for (const auto& [name, set] : node.descriptors()) {
      if (pool.make(type, set) != nullptr) return {type, set};
    }
  }
  throw VerbFailure{fmt::format("no node of the graph knows the type {}{}", type,
                                runtime::did_you_mean(type, known)),
                    kNotFound};
}

/// header.stamp_ns and header.seq, as nodes fill them; a message without a header stays as it is.
void fill_header(google::protobuf::Message& message, runtime::Time stamp, std::uint64_t seq) {
  const auto* header = message.GetDescriptor()->FindFieldByName("header");
  if (header == nullptr || header->message_type() == nullptr || header->is_repeated()) return;
  auto* part = message.GetReflection()->MutableMessage(&message, header);
  const auto set = [part](const char* name, std::uint64_t value) {
    const auto* field = part->GetDescriptor()->FindFieldByName(name);
    if (field != nullptr && field->cpp_type() == field->CPPTYPE_UINT64 && !field->is_repeated())
      part->GetReflection()->SetUInt64(part, field, value);
  };
  set("stamp_ns", static_cast<std::uint64_t>(stamp.count()));
  set("seq", seq);
}

/// The message in a line: itself, or in what `topic echo --json` prints.
std::string message_in(const std::string& line, const std::string& topic) {
  if (nested_deeper(line, 100)) throw ConfigError(topic + ": JSON nested deeper than 100");
  const auto json = nlohmann::ordered_json::parse(line, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) throw ConfigError(topic + ": no JSON: " + line.substr(0, 80));
  const bool echoed = json.is_object() && json.contains("topic") && json.contains("message");
  return echoed ? json_text(json["message"]) : line;
}

class Publisher {
 public:
  Publisher(const PubOptions& options, const TopicType& type)
      : options_(options),
        message_(types_.make(type.type, type.descriptors)),
        bus_(bus_options(options)),
        out_(bus_.advertise_raw(options.topic, type.type, type.descriptors,
                                {.latched = options.latched})) {
    bus_.ready();
  }

  /// False if they did not come in time, told on standard error.
  bool wait_for_subscribers(const StopSignals& stop) {
    const auto deadline = Clock::now() + milliseconds(options_.timeout_s);
    for (;;) {
      const std::size_t wanted = options_.wait_for >= 0
                                     ? static_cast<std::size_t>(options_.wait_for)
                                     : (listeners() > 0 ? 1 : 0);
      if (out_->subscribers() >= wanted || stop.requested()) return true;
      if (Clock::now() >= deadline) {
        std::cerr << fmt::format("{} has {} of {} subscribers after {:g} s\n", options_.topic,
                                 out_->subscribers(), wanted, options_.timeout_s);
        return false;
      }
      serve_until(std::min(deadline, Clock::now() + std::chrono::milliseconds(20)));
    }
  }
  /// @throws ConfigError if it is no message of the topic
  void check(const std::string& json) {
    message_->Clear();
    from_json(json, options_.topic, *message_);
  }
  void send(const std::string& json) {
    check(json);
    const runtime::Time stamp = bus_.time().now();
    fill_header(*message_, stamp, ++seq_);
    out_->send_raw(message_->SerializeAsString(), stamp);
  }
  void serve_until(Clock::time_point time) { bus_.wait(time); }
  /// All that reliable subscribers wait for is sent.
  void finish() { bus_.flush(-1); }
  std::uint64_t sent() const { return seq_; }

 private:
  static runtime::BusOptions bus_options(const PubOptions& options) {
    runtime::BusOptions bus;
    bus.name = options.name;
    bus.graph = options.graph;
    if (options.into_live) bus.into_live = {options.topic};
    return bus;
  }
  std::size_t listeners() const {
    std::size_t count = 0;
    for (const v1::NodeInfo& node : bus_.known_nodes()) {
      count += static_cast<std::size_t>(std::ranges::count(
          node.inputs(), options_.topic, [](const auto& in) { return in.topic(); }));
    }
    return count;
  }

  const PubOptions& options_;
  runtime::TypePool types_;
  std::unique_ptr<google::protobuf::Message> message_;
  runtime::ZmqBus bus_;
  std::unique_ptr<runtime::RawOut> out_;
  std::uint64_t seq_ = 0;
};

int publish(PubOptions& options) {
  std::string type, json;
  for (const std::string& word : options.words) {
    (word.starts_with('{') ? json : type) = word;
  }
  if (options.from_stdin && !json.empty())
    throw ConfigError("topic pub: --stdin and a message: which of them?");
  const auto nodes = runtime::GraphView(options.graph).nodes();
  const TopicType known = type_of(nodes, options.topic, type);
  if (options.name.empty()) options.name = "pub-" + std::to_string(getpid());
  if (launched_as().empty() && !options.into_live) {
    demand_leave({.verb = "mimesis topic pub",
                  .self = options.name,
                  .topics = {options.topic},
                  .into_live = {}},
                 nodes);
  }
  const StopSignals stop;
  Publisher publisher(options, known);
  std::string line = json.empty() ? "{}" : json;
  if (!options.from_stdin) publisher.check(message_in(line, options.topic));
  if (!publisher.wait_for_subscribers(stop)) return kNotFound;
  const auto period = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(options.rate_hz > 0.0 ? 1.0 / options.rate_hz : 0.0));
  const bool once = options.rate_hz == 0.0 && !options.from_stdin;
  const auto count = static_cast<std::uint64_t>(once && options.count == 0 ? 1 : options.count);
  auto due = Clock::now();
  while (!stop.requested() && (count == 0 || publisher.sent() < count)) {
    if (options.from_stdin && !std::getline(std::cin, line)) break;
    if (line.empty()) continue;
    publisher.send(message_in(line, options.topic));
    due += period;
    publisher.serve_until(due);
  }
  publisher.finish();
  if (options.json) {
    std::cout << json_text(nlohmann::ordered_json{{"topic", options.topic},
                                                  {"type", known.type},
                                                  {"messages", publisher.sent()}})
              << '\n';
  }
  return stop.requested() ? 128 + stop.signal() : 0;
}

}  // namespace

void add_pub(CLI::App& topic, int& exit_code) {
  CLI::App* pub = topic.add_subcommand("pub", "Publishes messages given as JSON");
  auto o = std::make_shared<PubOptions>();
  pub->add_option("topic", o->topic, "Name of the topic")->required();
  pub->add_option(
         "words", o->words,
         "[TYPE] [MESSAGE]: the type if nobody in the graph knows the topic; JSON with the "
         "field names of the .proto file (default: {})")
      ->expected(0, 2);
  pub->add_flag("--stdin", o->from_stdin,
                "A message a line from standard input, also what `topic echo --json` prints");
  pub->add_option("-r,--rate", o->rate_hz, "Publish again and again at this rate [Hz]")
      ->check(number_above_zero);
  pub->add_option("-n,--count", o->count, "Number of messages, then end")->check(number_above_zero);
  pub->add_option("-w,--wait", o->wait_for,
                  "Wait for so many subscribers (default: one, if there is any)");
  pub->add_flag("--latched", o->latched, "Late joiners get the last message while this runs");
  pub->add_flag("--into-live", o->into_live,
                "Publish even though running nodes publish the topic or could move a robot by it");
  pub->add_option("--name", o->name, "Name of the publishing node (default: pub-PID)");
  add_graph_options(*pub, *o, "subscribers");
  pub->footer(
      "header.stamp_ns and header.seq are filled. Ends after one message unless -r, -n or --stdin "
      "say otherwise.\n"
      "Examples:\n  mimesis topic pub planner/status '{\"state\": \"TASK_STATE_IDLE\"}'\n"
      "  mimesis topic echo a/status --json | mimesis topic pub b/status mimesis.v1.TaskStatus "
      "--stdin");
  pub->callback([=, &exit_code] {
    o->graph = chosen_graph(*o);
    try {
      exit_code = publish(*o);
    } catch (const VerbFailure& failure) {
      std::cerr << failure.line << '\n';
      exit_code = failure.exit_code;
    }
  });
}

}  // namespace mimesis::tool
