#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/json_text.h"
#include "common/math/so3.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/frame_tree.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/log/field_columns.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

struct Options {
  GraphOptions graph;
  std::vector<std::string> logs;  ///< empty: the running graph
  std::string from, to, at;
  double seconds = 1.0, rate_hz = 1.0;
  int count = 0;
};

/// Hands on every message with transforms: of logs, or of the graph for `wait`. `take` returns
/// false to end.
using Take = std::function<bool(const std::vector<FrameTransform>&, const std::string& from)>;

std::string source_text(const std::string& topic, const std::string& node) {
  return node.empty() ? topic : topic + " (" + node + ")";
}

void read_logs(const Options& o, const Take& take) {
  const std::vector<OpenLog> logs = open_logs(o.logs);
  const Span span = span_of(logs);
  LogTimes times;
  if (!o.at.empty()) times.end = parse_log_time("--at", o.at, span) + 1;
  LogDecoder decoder;
  bool go_on = true;
  const auto has = [&](const log::Channel& channel) {
    for (const OpenChannel& c : channels_of(logs)) {
      if (c.channel == &channel) return has_transforms(c.type());
    }
    return false;
  };
  scan_logs(logs, {has, times.start, times.end}, "transforms", [&](const Item& item) {
    if (!go_on) return;
    const auto* message = decoder.decode_or_tell(item);
    if (message == nullptr) return;
    go_on =
        take(transforms_in(*message), source_text(item.channel->topic, sender_of(*item.channel)));
  });
}

void read_graph(const Options& o, Clock::duration wait, const Take& take) {
  const std::string graph = chosen_graph(o.graph);
  const auto topics = [&] {
    std::set<std::string> found;
    for (const v1::NodeInfo& node : runtime::GraphView(graph).nodes()) {
      for (const v1::TopicInfo& out : node.outputs()) {
        if (has_transforms(out.type())) found.insert(out.topic());
      }
    }
    return found;
  }();
  if (topics.empty()) {
    throw VerbFailure{"no node of graph '" + graph + "' publishes transforms", kNotFound};
  }
  runtime::Tap tap(
      graph, [&](const std::string& topic) { return topics.contains(topic); },
      runtime::Policy::latest);
  runtime::TypePool types;
  const auto end = Clock::now() + wait;
  while (Clock::now() < end) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    const auto tapped = tap.next(std::min(left, std::chrono::milliseconds(200)));
    if (!tapped) continue;
    const auto message = types.make(tapped->type, tap.descriptors(tapped->type_hash));
    if (message == nullptr || !message->ParseFromString(tapped->message.payload)) continue;
    const std::string node = tapped->publisher == nullptr ? "" : tapped->publisher->name();
    if (!take(transforms_in(*message), source_text(tapped->topic, node))) return;
  }
}

Clock::duration seconds(double value) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(value));
}

FrameTree collect(const Options& o) {
  FrameTree tree;
  const auto take = [&](const std::vector<FrameTransform>& all, const std::string& from) {
    for (const FrameTransform& t : all) tree.add(t, from);
    return true;
  };
  if (o.logs.empty()) {
    read_graph(o, seconds(o.seconds), take);
  } else {
    read_logs(o, take);
  }
  if (tree.frames().empty()) {
    throw VerbFailure{o.logs.empty() ? fmt::format("no transform within {:g} s", o.seconds)
                                     : o.logs[0] + ": no transforms",
                      kNotFound};
  }
  return tree;
}

ordered_json pose_json(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  const Eigen::Vector3d p = X.translation(), rpy = math::rpy_of(X.linear());
  return {{"position_m", {p.x(), p.y(), p.z()}},
          {"orientation_wxyz", {q.w(), q.x(), q.y(), q.z()}},
          {"rpy_rad", {rpy.x(), rpy.y(), rpy.z()}}};
}

std::string pose_text(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  const Eigen::Vector3d p = X.translation(), rpy = math::rpy_of(X.linear()) * 180.0 / EIGEN_PI;
  return fmt::format(
      "position [m] {:.4f} {:.4f} {:.4f}   roll, pitch, yaw [deg] {:.2f} {:.2f} {:.2f}   "
      "quaternion wxyz {:.5f} {:.5f} {:.5f} {:.5f}",
      p.x(), p.y(), p.z(), rpy.x(), rpy.y(), rpy.z(), q.w(), q.x(), q.y(), q.z());
}

/// Frames that are told by several topics, or have had several parents.
std::vector<std::string> doubts(const FrameTree& tree) {
  std::vector<std::string> lines;
  for (const auto& [child, source] : tree.frames()) {
    if (source.from.size() > 1) {
      lines.push_back(fmt::format("'{}' comes from {}", child, fmt::join(source.from, " and ")));
    }
    if (source.parents.size() > 1) {
      lines.push_back(
          fmt::format("'{}' has had the parents {}", child, fmt::join(source.parents, ", ")));
    }
    if (!tree.pose(source.last.parent, child)) {
      lines.push_back(tree.pose(source.last.parent, child).error().reason);
    } else if (!source.last.X_PC.matrix().allFinite()) {
      lines.push_back(fmt::format("'{}' has a pose that is none", child));
    }
  }
  return lines;
}

void print_below(const FrameTree& tree, const std::string& frame, const std::string& indent,
                 int depth) {
  constexpr int kDeepest = 200;
  const std::vector<std::string> children = tree.children(frame);
  for (std::size_t i = 0; i < children.size(); ++i) {
    const bool last = i + 1 == children.size();
    const FrameSource& source = tree.frames().at(children[i]);
    std::cout << fmt::format("{}{} {}   {}\n", indent, last ? "└" : "├", printable(children[i]),
                             printable(fmt::format("{}", fmt::join(source.from, ", "))));
    if (depth < kDeepest) print_below(tree, children[i], indent + (last ? "  " : "│ "), depth + 1);
  }
}

int show_tree(const Options& o) {
  const FrameTree tree = collect(o);
  const std::vector<std::string> odd = doubts(tree);
  if (o.graph.json) {
    ordered_json frames = ordered_json::array();
    for (const auto& [child, source] : tree.frames()) {
      ordered_json frame{{"frame", child}, {"parent", source.last.parent}, {"from", source.from}};
      frame.update(pose_json(source.last.X_PC));
      frames.push_back(frame);
    }
    const ordered_json all{{"roots", tree.roots()}, {"frames", frames}, {"doubts", odd}};
    std::cout << json_text(all) << '\n';
  } else {
    for (const std::string& root : tree.roots()) {
      std::cout << printable(root) << '\n';
      print_below(tree, root, "", 0);
    }
    for (const std::string& line : odd) std::cerr << printable(line) << '\n';
  }
  return odd.empty() ? 0 : 1;
}

int echo(const Options& o) {
  FrameTree tree;
  std::int64_t next_ns = 0;
  int printed = 0;
  std::string why = "no transforms";
  constexpr auto kPatience = std::chrono::seconds(2);
  const auto begin = Clock::now();
  bool told = false;
  const auto take = [&](const std::vector<FrameTransform>& all, const std::string& source) {
    std::int64_t stamp_ns = 0;
    for (const FrameTransform& t : all) {
      tree.add(t, source);
      stamp_ns = std::max(stamp_ns, t.stamp_ns);
    }
    const auto pose = tree.pose(o.from, o.to);
    if (!pose) {
      why = pose.error().reason;
      // once, whoever waits without an end wants to know for what
      if (o.logs.empty() && !told && printed == 0 && Clock::now() - begin > kPatience) {
        std::cerr << "waiting: " << printable(why) << std::endl;
        told = true;
      }
    }
    if (!pose || (printed > 0 && stamp_ns < next_ns)) return true;
    next_ns = stamp_ns + std::int64_t(1e9 / o.rate_hz);
    if (o.graph.json) {
      ordered_json line{{"from", o.from}, {"to", o.to}, {"stamp_ns", stamp_ns}};
      line.update(pose_json(*pose));
      std::cout << json_text(line) << std::endl;
    } else {
      std::cout << fmt::format("{:.3f} s   {}", 1e-9 * double(stamp_ns), pose_text(*pose))
                << std::endl;
    }
    ++printed;
    return o.count == 0 || printed < o.count;
  };
  if (!o.logs.empty()) {
    read_logs(o, take);
  } else {
    const bool endless = o.count == 0;
    read_graph(o, endless ? Clock::duration::max() / 4 : seconds(o.graph.timeout_s), take);
  }
  if (printed > 0) return 0;
  std::cerr << printable(why) << '\n';
  return kNotFound;
}

int rates(const Options& o) {
  const FrameTree tree = collect(o);
  ordered_json list = ordered_json::array();
  TextTable table({"FRAME", "PARENT", "HZ", "LONGEST GAP [s]", "FROM"});
  for (const auto& [child, source] : tree.frames()) {
    const double span_s = 1e-9 * double(source.last.stamp_ns - source.first_ns);
    const double hz = span_s > 0.0 ? double(source.count - 1) / span_s : 0.0;
    list.push_back({{"frame", child},
                    {"parent", source.last.parent},
                    {"rate_hz", hz},
                    {"longest_gap_s", 1e-9 * double(source.longest_ns)},
                    {"messages", source.count},
                    {"from", source.from}});
    table.row({printable(child), printable(source.last.parent),
               hz > 0.0 ? fmt::format("{:.2f}", hz) : "once",
               fmt::format("{:.3f}", 1e-9 * double(source.longest_ns)),
               printable(fmt::format("{}", fmt::join(source.from, ", ")))});
  }
  if (o.graph.json) {
    std::cout << json_text(list) << '\n';
  } else {
    table.print(std::cout, use_colour(STDOUT_FILENO));
  }
  return 0;
}

}  // namespace

void add_tf(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("tf", "Frames and where they are");
  verb->require_subcommand(1);
  auto o = std::make_shared<Options>();
  const auto add = [&](const char* name, const char* about, int (*run)(const Options&)) {
    CLI::App* sub = verb->add_subcommand(name, about);
    sub->callback([o, run, &exit_code] { exit_code = run(*o); });
    return sub;
  };
  const auto add_common = [&](CLI::App* sub) {
    sub->add_option("LOG...", o->logs, "Logs; otherwise the running graph");
    sub->add_option("--at", o->at, "Of logs: the state at this time, as in log cat");
    add_graph_options(*sub, o->graph);
  };
  CLI::App* tree = add("tree", "Which frame hangs from which, and who says so", show_tree);
  tree->add_option("--seconds", o->seconds, "How long to listen to a graph")
      ->check(CLI::Range(0.05, 3600.0))
      ->capture_default_str();
  add_common(tree);
  tree->footer(
      "Exit codes: 0 done, 1 frames with two parents, two sources or none, 3 no "
      "transforms.\nExamples:\n"
      "  mimesis tf tree\n  mimesis tf tree run.mcap --at 4.5");
  CLI::App* echo_verb = add("echo", "Pose of one frame in another, once a second", echo);
  echo_verb->add_option("FROM", o->from, "Frame in which the pose is told")->required();
  echo_verb->add_option("TO", o->to, "Frame whose pose it is")->required();
  echo_verb->add_option("--rate-hz", o->rate_hz, "Lines a second of the messages' time")
      ->check(CLI::Range(0.01, 1000.0))
      ->capture_default_str();
  echo_verb->add_option("-n", o->count, "Number of lines, then end")->check(number_above_zero);
  add_common(echo_verb);
  echo_verb
      ->add_option("--timeout", o->graph.timeout_s, "With -n: longest wait [s]; then exit code 3")
      ->check(number_above_zero);
  echo_verb->footer(
      "Exit codes: 0 done, 3 no way between the frames.\nExamples:\n"
      "  mimesis tf echo world left_foot -n 1\n  mimesis tf echo base_link camera bag.mcap --json");
  CLI::App* hz = add("hz", "How often each frame is told", rates);
  hz->add_option("--seconds", o->seconds, "How long to listen to a graph")
      ->check(CLI::Range(0.05, 3600.0))
      ->capture_default_str();
  add_common(hz);
  hz->footer("Examples:\n  mimesis tf hz --seconds 5\n  mimesis tf hz bag.mcap");
}

}  // namespace mimesis::tool
