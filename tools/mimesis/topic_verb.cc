#include <fmt/format.h>
#include <google/protobuf/message.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <deque>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "common/json_text.h"
#include "common/runtime/graph_time.h"
#include "common/runtime/raw.h"
#include "common/runtime/value_text.h"
#include "common/time.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/rate_window.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

struct Topic {
  std::string type;
  bool latched = false;
  std::set<std::string> publishers, subscribers;
};

/// The topics that nodes of a graph publish or listen to, without recorders and taps, which listen
/// to everything.
std::map<std::string, Topic> topics_of(const std::string& graph) {
  std::map<std::string, Topic> topics;
  for (const v1::NodeInfo& node : runtime::GraphView(graph).nodes()) {
    for (const v1::TopicInfo& out : node.outputs()) {
      Topic& topic = topics[out.topic()];
      topic.type = out.type();
      topic.latched = out.latched();
      topic.publishers.insert(node.name());
    }
    for (const v1::TopicInfo& in : node.inputs()) {
      if (in.topic().empty() || in.topic() == "*") continue;
      Topic& topic = topics[in.topic()];
      if (topic.type.empty()) topic.type = in.type();
      topic.subscribers.insert(node.name());
    }
  }
  return topics;
}

enum class Measure { rate, bandwidth, delay };

struct Options {
  std::string graph, topic;
  std::string field;  ///< empty: the whole message
  std::string where;  ///< FIELD=VALUE of those that are printed; empty: all
  std::string bytes = "length";
  bool once = false, reliable = false, json = false;
  Measure measure = Measure::rate;
  int count = 0;           ///< of messages or reports; 0: without end
  int window = 1000;       ///< messages
  double timeout_s = 0.0;  ///< longest wait for each message [s]; 0: none
};

int list_topics(const Options& options) {
  const auto topics = topics_of(options.graph);
  if (options.json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const auto& [name, topic] : topics) {
      list.push_back({{"topic", name},
                      {"type", topic.type},
                      {"latched", topic.latched},
                      {"publishers", topic.publishers},
                      {"subscribers", topic.subscribers}});
    }
    std::cout << json_text(list) << '\n';
    return 0;
  }
  if (topics.empty()) {
    std::cerr << "graph '" << options.graph << "' has no topics\n";
    return 0;
  }
  TextTable table({"TOPIC", "TYPE", "PUBLISHERS", "SUBSCRIBERS"});
  for (const auto& [name, topic] : topics) {
    table.row({name, topic.type, fmt::format("{}", fmt::join(topic.publishers, ",")),
               fmt::format("{}", fmt::join(topic.subscribers, ","))});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  return 0;
}

/// Tells on standard error that a topic is not there (yet).
void note_if_unknown(const std::string& graph, const std::string& topic) {
  const auto topics = topics_of(graph);
  if (topics.contains(topic)) return;
  std::vector<std::string> known;
  for (const auto& [name, ignored] : topics) known.push_back(name);
  std::cerr << "nobody publishes " << topic << " in graph '" << graph << "' yet"
            << runtime::did_you_mean(topic, known) << '\n';
}

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

constexpr int kTimedOut = 3;

Clock::time_point deadline(double timeout_s) {
  return timeout_s > 0.0 ? Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                              std::chrono::duration<double>(timeout_s))
                         : Clock::time_point::max();
}

/// Time until `limit`, at most a second.
std::chrono::milliseconds turn(Clock::time_point limit) {
  using std::chrono::milliseconds;
  const auto now = Clock::now();
  if (limit - now > milliseconds(1000)) return milliseconds(1000);
  return std::max(milliseconds(0), std::chrono::ceil<milliseconds>(limit - now));
}

int timed_out(const std::string& topic, double timeout_s) {
  std::cerr << fmt::format("no message on {} within {:g} s\n", topic, timeout_s);
  return kTimedOut;
}

void print(const runtime::Tapped& tapped, const Json& value, bool field, bool json) {
  if (json) {
    std::cout << json_text(Json{{"topic", tapped.topic},
                                {"seq", tapped.message.seq},
                                {"stamp_ns", tapped.message.stamp.count()},
                                {"source", tapped.message.source},
                                {field ? "value" : "message", value}})
              << std::endl;
  } else if (field) {
    std::cout << (value.is_string() ? value.get<std::string>() : value.dump()) << std::endl;
  } else {
    std::cout << value.dump(2) << "\n---" << std::endl;
  }
}

/// The field of `where` has its value.
bool is_wanted(const google::protobuf::Message& message, const std::string& where) {
  if (where.empty()) return true;
  const std::size_t sign = where.find('=');
  const auto value = field_json(message, where.substr(0, sign));
  return (value.is_string() ? value.get<std::string>() : value.dump()) == where.substr(sign + 1);
}

/// Prints messages; returns the exit code.
int echo_topic(const Options& options) {
  runtime::Tap tap(
      options.graph, [&](const std::string& topic) { return topic == options.topic; },
      options.reliable ? runtime::Policy::reliable : runtime::Policy::latest);
  runtime::TypePool types;
  const int count = options.once ? 1 : options.count;
  auto limit = deadline(options.timeout_s);
  for (int printed = 0; count == 0 || printed < count;) {
    const auto tapped = tap.next(turn(limit));
    if (!tapped) {
      if (Clock::now() >= limit) return timed_out(options.topic, options.timeout_s);
      continue;
    }
    const auto message = types.make(tapped->type, tap.descriptors(tapped->type_hash));
    if (message == nullptr || !message->ParseFromString(tapped->message.payload)) {
      std::cerr << options.topic << ": a message is not a valid " << tapped->type << '\n';
      return 1;
    }
    if (!is_wanted(*message, options.where)) {
      if (Clock::now() >= limit) return timed_out(options.topic, options.timeout_s);
      continue;
    }
    const bool field = !options.field.empty();
    print(*tapped,
          field ? field_json(*message, options.field)
                : to_json(*message,
                          options.bytes == "base64" ? BytesText::base64 : BytesText::length),
          field, options.json);
    ++printed;
    limit = deadline(options.timeout_s);
  }
  return 0;
}

/// Sizes or ages of the last messages.
class Samples {
 public:
  explicit Samples(std::size_t most) : most_(most) {}
  void add(double value) {
    values_.push_back(value);
    if (values_.size() > most_) values_.pop_front();
  }
  bool empty() const { return values_.empty(); }
  double least() const { return *std::ranges::min_element(values_); }
  double most() const { return *std::ranges::max_element(values_); }
  double mean() const {
    return std::accumulate(values_.begin(), values_.end(), 0.0) /
           static_cast<double>(values_.size());
  }

 private:
  std::size_t most_;
  std::deque<double> values_;
};

/// A line about the last messages: JSON, and for people.
std::pair<Json, std::string> measured(const Options& options, const RateWindow::Rate& rate,
                                      const Samples& samples) {
  const std::string& topic = options.topic;
  switch (options.measure) {
    case Measure::rate:
      return {{{"topic", topic},
               {"rate_hz", rate.hz},
               {"min_s", rate.min_s},
               {"max_s", rate.max_s},
               {"messages", rate.messages}},
              fmt::format("{:.3f} Hz   between messages {:.4f} .. {:.4f} s   {} messages", rate.hz,
                          rate.min_s, rate.max_s, rate.messages)};
    case Measure::bandwidth:
      return {{{"topic", topic},
               {"bytes_s", samples.mean() * rate.hz},
               {"mean_bytes", samples.mean()},
               {"min_bytes", samples.least()},
               {"max_bytes", samples.most()},
               {"messages", rate.messages}},
              fmt::format("{}/s   messages of {} ({} .. {})",
                          bytes_text(static_cast<std::uint64_t>(samples.mean() * rate.hz)),
                          bytes_text(static_cast<std::uint64_t>(samples.mean())),
                          bytes_text(static_cast<std::uint64_t>(samples.least())),
                          bytes_text(static_cast<std::uint64_t>(samples.most())))};
    case Measure::delay:
      break;
  }
  return {{{"topic", topic},
           {"mean_s", samples.mean()},
           {"min_s", samples.least()},
           {"max_s", samples.most()},
           {"messages", rate.messages}},
          fmt::format("{:.6f} s   {:.6f} .. {:.6f} s   {} messages", samples.mean(),
                      samples.least(), samples.most(), rate.messages)};
}

/// Prints rate, bandwidth or delay of a topic once a second; returns the exit code.
int measure_topic(const Options& options) {
  runtime::Tap tap(
      options.graph, [&](const std::string& topic) { return topic == options.topic; },
      runtime::Policy::latest);
  const runtime::GraphTime time(runtime::graph_directory(options.graph));
  RateWindow window(static_cast<std::size_t>(options.window));
  Samples samples(static_cast<std::size_t>(options.window));
  auto report = Clock::now() + std::chrono::seconds(1);
  auto limit = deadline(options.timeout_s);
  for (int reports = 0; options.count == 0 || reports < options.count;) {
    if (const auto tapped = tap.next(turn(std::min(limit, report)))) {
      if (options.measure == Measure::delay && tapped->publisher != nullptr &&
          tapped->publisher->clock() != "wall") {
        std::cerr << fmt::format(
            "{}: node '{}' is on the clock '{}', whose time stands still between steps: only "
            "messages with wall time have a delay\n",
            options.topic, tapped->publisher->name(), tapped->publisher->clock());
        return 1;
      }
      window.add(Clock::now(), tapped->message.seq);
      samples.add(options.measure == Measure::delay
                      ? to_seconds(time.now() - tapped->message.stamp)
                      : static_cast<double>(tapped->message.payload.size()));
      limit = deadline(options.timeout_s);
    }
    if (Clock::now() >= limit) return timed_out(options.topic, options.timeout_s);
    if (Clock::now() < report) continue;
    report += std::chrono::seconds(1);
    const auto rate = window.rate();
    if (!rate) continue;
    const auto [json, text] = measured(options, *rate, samples);
    std::cout << (options.json ? json_text(json) : text) << std::endl;
    ++reports;
  }
  return 0;
}

/// Who publishes and who listens, and what a message looks like.
int topic_info(const Options& options) {
  const auto nodes = runtime::GraphView(options.graph).nodes();
  Json publishers = Json::array(), subscribers = Json::array(), fields;
  std::string type, descriptors;
  bool latched = false;
  for (const v1::NodeInfo& node : nodes) {
    for (const v1::TopicInfo& out : node.outputs()) {
      if (out.topic() != options.topic) continue;
      type = out.type();
      latched = out.latched();
      publishers.push_back({{"node", node.name()},
                            {"port", out.port()},
                            {"host", node.host()},
                            {"pid", node.pid()},
                            {"clock", node.clock()}});
    }
    for (const v1::TopicInfo& in : node.inputs()) {
      if (in.topic() != options.topic) continue;
      if (type.empty()) type = in.type();
      subscribers.push_back({{"node", node.name()},
                             {"port", in.port()},
                             {"host", node.host()},
                             {"policy", in.policy()},
                             {"obeys", in.obeys()}});
    }
    const auto set = node.descriptors().find(type);
    if (!type.empty() && set != node.descriptors().end()) descriptors = set->second;
  }
  if (type.empty()) return kTimedOut;  // told already
  runtime::TypePool types;
  if (const auto message = types.make(type, descriptors)) fields = to_json(*message);
  if (options.json) {
    const Json all{{"topic", options.topic},     {"type", type},
                   {"latched", latched},         {"publishers", publishers},
                   {"subscribers", subscribers}, {"empty_message", fields}};
    std::cout << json_text(all) << '\n';
    return 0;
  }
  std::cout << fmt::format("topic  {}{}\ntype   {}\n", options.topic, latched ? " (latched)" : "",
                           type);
  TextTable table({"", "NODE", "PORT", "HOST", "POLICY"});
  const auto text = [](const Json& entry, const char* key) {
    return entry[key].get<std::string>();
  };
  for (const Json& p : publishers)
    table.row({"publishes", text(p, "node"), text(p, "port"), text(p, "host"), ""});
  for (const Json& s : subscribers) {
    const std::string obeys = text(s, "obeys");
    table.row({"listens", text(s, "node"), text(s, "port"), text(s, "host"),
               text(s, "policy") + (obeys.empty() ? "" : ", of " + obeys + " alone")});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  std::cout << "empty message for topic pub: " << json_text(fields) << '\n';
  return 0;
}

}  // namespace

void add_topic(CLI::App& program, int& exit_code) {
  CLI::App* topic = program.add_subcommand("topic");
  topic->require_subcommand(1);
  auto o = std::make_shared<Options>();
  const auto add_common = [o](CLI::App* verb) {
    verb->add_option("--graph", o->graph,
                     "Name of the graph (default: MIMESIS_GRAPH, or the only one that runs)");
    verb->add_flag("--json", o->json, "Machine-readable output (tools/mimesis/README.md)");
  };
  const auto on = [o, &exit_code](CLI::App* verb, int (*run)(const Options&)) {
    verb->callback([=, &exit_code] {
      o->graph = chosen_graph({.graph = o->graph});
      if (!o->topic.empty()) note_if_unknown(o->graph, o->topic);
      exit_code = run(*o);
    });
  };

  CLI::App* list =
      topic->add_subcommand("list", "Topics with their types, publishers and subscribers");
  add_common(list);
  list->footer("Examples:\n  mimesis topic list\n  mimesis topic list --json --graph demo");
  on(list, list_topics);

  CLI::App* echo = topic->add_subcommand("echo", "Prints messages as they come");
  echo->add_option("topic", o->topic, "Name of the topic")->required();
  echo->add_flag("--once", o->once, "One message, then end");
  echo->add_option("-n", o->count, "Number of messages, then end")->check(number_above_zero);
  echo->add_option("--field", o->field, "Only this field, such as header.seq or blobs.0.u_px");
  echo->add_option("--where", o->where, "Only messages with this field, such as settled=true")
      ->check([](const std::string& text) {
        return text.find('=') == std::string::npos ? "expected FIELD=VALUE" : std::string();
      });
  echo->add_option("--bytes", o->bytes, "Fields of bytes: their length, or base64 (for topic pub)")
      ->check(CLI::IsMember({"length", "base64"}))
      ->capture_default_str();
  echo->add_flag("--reliable", o->reliable,
                 "Lose none: the publisher waits with what does not fit");
  echo->add_option("--timeout", o->timeout_s, "Longest wait for a message [s]; then exit code 3")
      ->check(number_above_zero);
  add_common(echo);
  echo->footer(
      "Examples:\n  mimesis topic echo planner/status --once\n"
      "  mimesis topic echo bridge/joint_states --field position_rad --json -n 10");
  on(echo, echo_topic);

  CLI::App* hz = topic->add_subcommand("hz", "Rate of a topic, once a second");
  CLI::App* bw = topic->add_subcommand("bw", "Bandwidth of a topic, once a second");
  CLI::App* delay = topic->add_subcommand(
      "delay", "Time from the stamp of messages to their arrival here, once a second");
  for (const auto& [verb, measure, examples] :
       {std::tuple(hz, Measure::rate,
                   "Examples:\n  mimesis topic hz camera/image\n  mimesis topic hz "
                   "bridge/joint_states -w 200 "
                   "-n 1 --json"),
        {bw, Measure::bandwidth,
         "Examples:\n  mimesis topic bw camera/image\n  mimesis topic bw bridge/joint_states -n 1 "
         "--json"},
        {delay, Measure::delay,
         "Examples:\n  mimesis topic delay camera/image\n  mimesis topic delay bridge/joint_states "
         "-n 1 "
         "--json"}}) {
    verb->add_option("topic", o->topic, "Name of the topic")->required();
    verb->add_option("-w,--window", o->window, "Messages to look at")
        ->check(CLI::Range(2, 1'000'000));
    verb->add_option("-n", o->count, "Number of lines, then end")->check(number_above_zero);
    verb->add_option("--timeout", o->timeout_s, "Longest wait for a message [s]; then exit code 3")
        ->check(number_above_zero);
    add_common(verb);
    verb->footer(examples);
    verb->preparse_callback([o, measure = measure](std::size_t) { o->measure = measure; });
    on(verb, measure_topic);
  }

  CLI::App* info = topic->add_subcommand("info", "Publishers, subscribers and type of a topic");
  info->add_option("topic", o->topic, "Name of the topic")->required();
  add_common(info);
  info->footer(
      "Examples:\n  mimesis topic info camera/image\n  mimesis topic info bridge/joint_states "
      "--json");
  on(info, topic_info);

  add_pub(*topic, exit_code);
}

}  // namespace mimesis::tool
