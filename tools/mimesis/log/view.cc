// `mimesis log view`: everything of the inputs, and drawings for viewers on topics view/... beside
// it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/model/files.h"
#include "common/model/viewer.h"
#include "common/runtime/param_source.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/packet_process.h"
#include "tools/mimesis/log/replay_log.h"
#include "tools/mimesis/log/restore.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/log/view_drawings.h"

namespace mimesis::tool {
namespace {

/// The layers to draw.
struct ViewLayers {
  bool fields = false, roadmap = false, table = false;
  bool all = false;  ///< all drawings that the log has the topics for
};

/// Announcements of the nodes of a log at their start, by name.
using Setups = std::map<std::string, v1::NodeStart>;

/// A topic of the log and the node that published on it.
struct SeenTopic {
  std::string topic, node;
};

Setups read_setups(const std::vector<OpenLog>& logs) {
  Setups setups;
  for (Life& life : find_lives(logs)) setups.emplace(life.node(), std::move(life.start));
  return setups;
}

/// The topic of this type: `preferred` if it is one of them, else the first by name.
std::optional<SeenTopic> topic_of(const std::vector<OpenLog>& logs, const std::string& type,
                                  const std::string& preferred = "") {
  std::optional<SeenTopic> found;
  for (const OpenChannel& c : channels_of(logs)) {
    const auto rank = [&](const std::string& topic) {
      return std::pair(topic != preferred, topic);
    };
    const std::string& topic = c.channel->topic;
    if (c.type() == type && (!found || rank(topic) < rank(found->topic))) {
      found = {topic, sender_of(*c.channel)};
    }
  }
  return found;
}

runtime::Yaml parameters_of(const v1::NodeStart& start) {
  return runtime::parse_yaml(start.parameters(), start.node() + "/start");
}

/// The parameter group `view` of a node, checked.
std::optional<image::View> view_in(const v1::NodeStart& start) {
  const runtime::Yaml all = parameters_of(start);
  const runtime::Yaml* section = all.find("view");
  if (section == nullptr) return std::nullopt;
  image::View view;
  const runtime::Variables none(*section);
  runtime::ParamReader reader(start.node(), section, none, {});
  view.visit(reader);
  reader.finish();
  return view;
}

/// The announcement of the planner; without parameters if the log does not hold it.
v1::NodeStart planner_of(const Setups& setups) {
  for (const auto& [node, start] : setups) {
    if (start.executable() == "mimesis_planner") return start;
  }
  return {};
}

/// The calibrated view of the camera that publishes `image`: a parameter `view` of a node that
/// takes these images, else of the one that makes them.
std::optional<image::View> view_of(const Setups& setups, const SeenTopic& image) {
  for (const auto& [node, start] : setups) {
    const auto takes_it = [&](const v1::TopicInfo& input) { return input.topic() == image.topic; };
    if (!std::ranges::any_of(start.inputs(), takes_it)) continue;
    if (auto view = view_in(start)) return view;
  }
  const auto maker = setups.find(image.node);
  return maker == setups.end() ? std::nullopt : view_in(maker->second);
}

/// @throws VerbEnd if a layer cannot be drawn: the log lacks its topic.
void require_topics(const ViewLayers& layers, const std::vector<OpenLog>& logs) {
  using Layer = std::tuple<const char*, bool, const google::protobuf::Descriptor*>;
  for (const auto& [option, asked, type] :
       {Layer{"--fields", layers.fields, v1::FieldActivity::descriptor()},
        {"--roadmap", layers.roadmap, v1::Scene::descriptor()},
        {"--table", layers.table, v1::Scene::descriptor()}}) {
    if (!asked || topic_of(logs, type->full_name())) continue;
    throw VerbEnd{fmt::format("{}: no topic of type {} in the log", option, type->full_name()), 3};
  }
}

/// Turns messages of a log into drawings.
class LayerPainter {
 public:
  /// Precondition: nothing is missing. @throws ConfigError if the log names a robot or parameters
  /// that this version does not know.
  LayerPainter(const ViewLayers& layers, const std::vector<OpenLog>& logs)
      : layers_(layers), logs_(logs) {
    const Setups setups = read_setups(logs);
    if (const auto image = topic_of(logs, "foxglove.RawImage", "camera/image")) {
      camera_ = view_of(setups, *image);
    }
    if (wanted<v1::Scene>(layers.roadmap)) add_roadmap(planner_of(setups));
    if (wanted<v1::FieldActivity>(layers.fields)) {
      follow<v1::FieldActivity>([](const v1::FieldActivity& fields, const Draw& draw) {
        draw("view/fields", to_board(fields), std::chrono::nanoseconds(fields.header().stamp_ns()));
        return true;
      });
    }
    if (wanted<v1::Scene>(layers.table)) {
      follow<v1::Scene>([](const v1::Scene& scene, const Draw& draw) {
        const kin::Table table = model::from_proto(scene);
        if (!finite(table)) return false;
        const std::chrono::nanoseconds stamp(scene.header().stamp_ns());
        draw("view/table", model::to_table(table, stamp), stamp);
        return true;
      });
    }
  }

  /// Draws what holds from the first message on: the camera's place and calibration, if the log has
  /// images and says how the camera stands.
  void begin(std::chrono::nanoseconds stamp, const Draw& draw) const {
    if (!camera_) return;
    draw("view/camera", to_calibration(*camera_, stamp), stamp);
    draw("view/camera_frames", to_camera_frames(*camera_, stamp), stamp);
  }
  /// Passes over messages of other topics.
  void see(const log::MergedReader::Item& item, const Draw& draw) {
    const auto [first, last] = painters_.equal_range(item.channel->topic);
    bool drawn = true;
    for (auto painter = first; painter != last; ++painter)
      drawn &= painter->second(item.message->data, draw);
    if (!drawn) ++failed_[item.channel->topic];
  }
  /// One line per topic with messages that could not be drawn: cut off, or not of this robot.
  std::vector<std::string> problems() const {
    std::vector<std::string> lines;
    for (const auto& [topic, count] : failed_) {
      lines.push_back(
          fmt::format("{}: {} messages cannot be drawn: damaged, or not finite", topic, count));
    }
    return lines;
  }

 private:
  /// The layer drawn from messages T is asked for, by itself or among all that the log has.
  template <class T>
  bool wanted(bool asked) const {
    return (asked || layers_.all) && topic_of(logs_, T::descriptor()->full_name());
  }
  /// The program mimesis_roadmap plans as the planner did (nodes/planner/drawing).
  /// @throws ConfigError if it is asked for and not there, or does not know these parameters
  void add_roadmap(const v1::NodeStart& planner) {
    constexpr const char* kName = "mimesis_roadmap";
    constexpr double kLongest_s = 600.0;  // for one roadmap
    if (launch::find_executable(kName).empty()) {
      const std::string why =
          fmt::format("--roadmap: there is no program {} beside this one or on PATH", kName);
      if (layers_.roadmap) throw ConfigError(why);
      std::cerr << why << ": the roadmap is left out\n";
    } else {
      const auto command = [](int socket) -> launch::Command {
        return {{kName, std::to_string(socket)}, {}};
      };
      const auto program = std::make_shared<PacketProcess>(kName, command, kLongest_s);
      const auto ask = [program](const google::protobuf::MessageLite& request) {
        foxglove::SceneUpdate drawing;
        program->ask(request, drawing);
        return drawing;
      };
      ask(planner);
      const auto view = std::make_shared<RoadmapView>([ask](const auto& scene, const auto& status) {
        ask(scene);
        return ask(status);
      });
      follow<v1::Scene>(view);
      follow<v1::TaskStatus>(view);
    }
  }
  /// Calls `see(message, draw)` for messages on the topic of type T, if there is one; it returns
  /// false if the message could not be drawn.
  template <class T>
  void follow(std::function<bool(const T&, const Draw&)> see) {
    const auto source = topic_of(logs_, T::descriptor()->full_name());
    if (!source) return;
    painters_.emplace(source->topic, [see](std::string_view payload, const Draw& draw) {
      T message;
      return parse(payload, message) && see(message, draw);
    });
  }
  template <class T, class View>
  void follow(const std::shared_ptr<View>& view) {
    follow<T>([view](const T& message, const Draw& draw) { return view->see(message, draw); });
  }

  const ViewLayers& layers_;
  const std::vector<OpenLog>& logs_;
  std::optional<image::View> camera_;
  using Painter = std::function<bool(std::string_view payload, const Draw&)>;
  std::multimap<std::string, Painter> painters_;  ///< by topic
  std::map<std::string, std::uint64_t> failed_;   ///< messages by topic
};

struct ViewOptions {
  std::vector<std::string> inputs;  ///< logs, taken as one
  OutputOptions output;
  ViewLayers layers;
  bool json = false;
};

/// Returns the exit code. @throws ConfigError, VerbEnd
int log_view(const ViewOptions& options) {
  const std::vector<OpenLog> logs = open_whole_logs(options.inputs);
  require_topics(options.layers, logs);
  LayerPainter painter(options.layers, logs);
  NewLog out(options.output, logs);
  struct Channel {
    std::uint16_t id = 0;
    std::uint32_t sequence = 0;
  };
  std::map<std::string, Channel> channels;  // by topic
  std::uint64_t log_time = 0;               // of the drawings that follow
  std::string payload;
  const Draw draw = [&](const std::string& topic, const auto& message, auto stamp) {
    Channel& channel = channels[topic];
    if (channel.id == 0) {
      const auto& type = *message.GetDescriptor();
      const log::Schema schema{0, type.full_name(), "protobuf", runtime::descriptor_set(type)};
      // Latched: each message is whole, and the last is all that somebody who comes later needs.
      channel.id = out.channel(
          {.topic = topic,
           .message_encoding = "protobuf",
           .metadata = {{"node", "view"},
                        {"latched", "true"},
                        {"type_hash", fmt::format("{:016x}", runtime::type_hash(type))}}},
          &schema);
    }
    message.SerializeToString(&payload);
    out.write({channel.id, ++channel.sequence, log_time, static_cast<std::uint64_t>(stamp.count()),
               payload});
  };
  LatchedRepeats repeats;
  bool begun = false;
  out.read("view", logs, {}, [&](const Item& item) {
    log_time = item.message->log_time;
    if (!begun) painter.begin(std::chrono::nanoseconds(log_time), draw);
    begun = true;
    if (repeats.repeated(item)) return;
    out.copy(item);
    painter.see(item, draw);
  });
  out.copy_attachments(logs);
  out.copy_metadata(logs, read_losses(logs));
  for (const std::string& line : painter.problems()) std::cerr << line << '\n';
  auto drawn = nlohmann::ordered_json::object();  // messages by topic
  for (const auto& [topic, channel] : channels) drawn[topic] = channel.sequence;
  return out.conclude(options.json, {{"drawn", drawn}});
}

}  // namespace

void add_view(CLI::App& verb, int& exit_code) {
  CLI::App* view = verb.add_subcommand(
      "view", "Writes a log for viewers: fields, roadmap, table in 3-D beside the messages");
  auto o = std::make_shared<ViewOptions>();
  add_input_output(*view, o->inputs, o->output);
  view->add_flag("--fields", o->layers.fields, "Activity of the neural fields, on a board");
  view->add_flag("--roadmap", o->layers.roadmap, "The planner's roadmap");
  view->add_flag("--table", o->layers.table, "The table as the planner knows it");
  view->add_flag("--all", o->layers.all, "All of these for which the log has topics");
  add_output_options(*view, o->output);
  view->add_flag("--json", o->json, "Print the result as one JSON object");
  view->footer(
      "For Foxglove, Lichtblick and Rerun: see docs/viewers.md. Exit code 3 if what is asked for "
      "has no topic.\n"
      "Example: mimesis log view run.mcap run-view.mcap --all");
  on_run(*view, exit_code, [o] {
    take_output(o->inputs, o->output);
    return log_view(*o);
  });
}

}  // namespace mimesis::tool
