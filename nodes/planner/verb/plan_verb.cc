// `mimesis plan`: plans for an arm without a graph.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/error.h"
#include "common/json_text.h"
#include "common/model/drawing.h"
#include "common/model/files.h"
#include "common/runtime/raw.h"
#include "common/time.h"
#include "nodes/planner/move_plan.h"
#include "nodes/planner/verb/plan_file.h"
#include "nodes/planner/verb/verify_geometry.h"
#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using Json = nlohmann::ordered_json;
using planner::PlannedMotion;

constexpr int kDone = 0, kFailed = 1;
constexpr double kBrakes = 0.95;  // share of the accelerations with which the planner brakes

struct PlanOptions {
  std::string scene, robot = "lwr4.yaml", start;
  std::vector<std::string> via, goals, task;
  std::vector<double> hand_m;
  std::vector<std::string> straight, arcs;
  std::vector<std::vector<double>> tool_m;  // of both, in order: X Y Z, of an arc two places
  double off_m = 0.001;
  std::string search;
  double margin_m = 0.002, speed = 0.6, deadline_s = 0.0;
  std::uint64_t seed = 1;
  std::string out, scene_log;
  bool json = false;
};

struct Plan {
  std::vector<PlannedMotion> motions;
  std::vector<Eigen::VectorXd> waypoints;  // empty for a task
  double length_rad = 0.0;
};

/// "0.1,-0.5,..."
std::vector<double> numbers_of(const std::string& what, const std::string& text) {
  std::vector<double> values;
  std::istringstream in(text);
  for (std::string word; std::getline(in, word, ',');) {
    const auto value = runtime::to_double(word);
    if (!value) throw ConfigError(what + ": expected numbers and commas, found '" + word + "'");
    values.push_back(*value);
  }
  return values;
}

/// A posture within the limits of the arm, or beyond by `tolerance`.
Eigen::VectorXd posture(const kin::ArmModel& arm, const std::string& what, const std::string& text,
                        double tolerance = 0.0) {
  const std::vector<double> values = numbers_of(what, text);
  if (std::ssize(values) != arm.dof()) {
    throw ConfigError(fmt::format("{}: {} numbers, expected {}, one for each joint of {}", what,
                                  values.size(), arm.dof(), arm.name));
  }
  Eigen::VectorXd q = Eigen::VectorXd::Map(values.data(), arm.dof());
  const std::string why = planner::beyond_limits(arm, q, tolerance);
  if (!why.empty()) throw ConfigError(what + ": " + why);
  return q;
}

planner::Task task_of(const std::vector<std::string>& words, const kin::Table& table) {
  if (table.object_radius <= 0.0 || table.bar_half_width <= 0.0)
    throw ConfigError("--task: the scene has no bar or no object, see models/bar_table.yaml");
  return {task::parse_symbol<task::Grip>(words[0], "--task"),
          task::parse_symbol<task::Transport>(words[1], "--task"), words[2]};
}

/// A posture, or "hand:X,Y,Z".
planner::Place place(const kin::ArmModel& arm, const std::string& what, const std::string& text) {
  constexpr std::string_view kHand = "hand:";
  if (!text.starts_with(kHand)) return {posture(arm, what, text)};
  const auto values = numbers_of(what, text.substr(kHand.size()));
  if (values.size() != 3) throw ConfigError(what + ": expected hand:X,Y,Z in m");
  return {{}, Eigen::Vector3d::Map(values.data())};
}

/// Pieces of the tool's way, in the order of the command line.
std::vector<std::vector<double>> tool_pieces(const PlanOptions& o, const CLI::App& verb,
                                             const CLI::Option* straight, const CLI::Option* arc) {
  std::vector<std::vector<double>> pieces;
  std::size_t lines = 0, arcs = 0;
  for (const CLI::Option* given : verb.parse_order()) {
    if (given != straight && given != arc) continue;
    const bool is_arc = given == arc;
    const std::string what = is_arc ? "--arc" : "--straight";
    pieces.push_back(numbers_of(what, is_arc ? o.arcs[arcs++] : o.straight[lines++]));
    if (pieces.back().size() != (is_arc ? 6u : 3u))
      throw ConfigError(what + ": expected " + (is_arc ? "X,Y,Z,X,Y,Z" : "X,Y,Z") + " in m");
  }
  return pieces;
}

planner::Move move_of(const PlanOptions& o, const kin::ArmModel& arm) {
  planner::Move move;
  for (const std::string& via : o.via) move.via.push_back(place(arm, "--via", via));
  for (const std::string& goal : o.goals) move.goals.push_back({posture(arm, "--goal", goal)});
  if (!o.hand_m.empty()) move.goals.push_back({{}, Eigen::Vector3d::Map(o.hand_m.data())});
  for (const std::vector<double>& piece : o.tool_m) {
    planner::ToolPiece next{{}, Eigen::Vector3d::Map(&piece[piece.size() - 3])};
    if (piece.size() > 3) next.via = Eigen::Vector3d::Map(piece.data());
    move.tool.push_back(next);
  }
  move.tolerance.position_m = o.off_m;
  return move;
}

/// The waypoints of the motions: corners between lines, rounded or not.
std::vector<Eigen::VectorXd> waypoints(const std::vector<PlannedMotion>& motions) {
  std::vector<Eigen::VectorXd> points{motions.front().curves.front().col(0)};
  for (const PlannedMotion& motion : motions) {
    for (std::size_t i = 0; i < motion.curves.size(); ++i) {
      const Eigen::MatrixXd& curve = motion.curves[i];
      const bool ends = i + 1 == motion.curves.size() || motion.curves[i + 1].cols() == 2;
      if (curve.cols() > 2) points.emplace_back(curve.col(2));
      if (curve.cols() == 2 && ends) points.emplace_back(curve.rightCols(1));
    }
  }
  return points;
}

tl::expected<Plan, Status> plan_asked(const PlanOptions& o, const kin::ArmModel& arm,
                                      const planner::PlanRequest& request,
                                      planner::TaskSettings settings) {
  const bool task = std::holds_alternative<planner::Task>(request.what);
  if (o.deadline_s > 0.0) {
    const auto end =
        std::chrono::steady_clock::now() + from_seconds(o.deadline_s - planner::kLongestPart_s);
    settings.interrupt = Interrupt(
        fmt::format("the deadline of {:g} ms passed", 1e3 * o.deadline_s),
        [end] { return std::chrono::steady_clock::now() >= end; }, planner::kQuestionsPerLook);
  }
  using planner::Search;
  settings.search.by = o.search == "waves"                                ? Search::waves
                       : o.search == "both" || (task && o.search.empty()) ? Search::both
                                                                          : Search::trees;
  const planner::Roadmap roadmap = settings.search.by == Search::trees
                                       ? planner::Roadmap{}
                                       : prepare_roadmap(arm, request.table, settings);
  auto plan = plan_request(arm, roadmap, request, settings);
  if (!plan) return tl::unexpected(plan.error());
  if (plan->motions.empty()) return tl::unexpected(Status{"the arm is at the goal already"});
  auto path = task ? std::vector<Eigen::VectorXd>{} : waypoints(plan->motions);
  return Plan{std::move(plan->motions), std::move(path), plan->path_length_rad};
}

const char* name_of(planner::Phase phase) {
  constexpr std::array kNames{"reach", "approach", "grasp", "transport", "release", "retreat"};
  return kNames.at(static_cast<std::size_t>(phase));
}

const char* name_of(planner::FoundBy by) {
  constexpr std::array kNames{"line", "waves", "trees"};
  return kNames.at(static_cast<std::size_t>(by));
}

std::vector<double> numbers(const Eigen::Ref<const Eigen::VectorXd>& v) {
  return {v.begin(), v.end()};
}

std::vector<double> rows(const std::vector<kin::Ball>& balls) {
  std::vector<double> out;
  for (const kin::Ball& b : balls)
    out.insert(out.end(), {b.center.x(), b.center.y(), b.center.z(), b.radius});
  return out;
}

std::vector<double> rows(const std::vector<kin::Box>& boxes) {
  std::vector<double> out;
  for (const kin::Box& b : boxes) {
    out.insert(out.end(), {b.center.x(), b.center.y(), b.center.z(), b.half_extent.x(),
                           b.half_extent.y(), b.half_extent.z()});
  }
  return out;
}

std::vector<PlanHull> hulls(const std::vector<kin::Hull>& given) {
  std::vector<PlanHull> out;
  for (const kin::Hull& hull : given) {
    PlanHull& next = out.emplace_back(PlanHull{hull.name, {}, hull.shape.radius});
    for (const auto& p : hull.shape.points.rowwise())
      next.points_m.insert(next.points_m.end(), p.begin(), p.end());
  }
  return out;
}

/// Every instant as the planner streams it, and how it would brake there.
PlanMotion exported(const PlannedMotion& motion, const kin::ArmModel& arm) {
  PlanMotion out{name_of(motion.phase),
                 rows(motion.obstacles.balls),
                 rows(motion.obstacles.boxes),
                 rows(motion.obstacles.held),
                 rows(motion.obstacles.supports),
                 hulls(motion.obstacles.hulls),
                 {},
                 0.0,
                 0.0,
                 {}};
  planner::Playback playback(kBrakes * arm.a_max);
  playback.start(motion.trajectory);
  for (Eigen::Index k = 0; k < motion.trajectory.samples(); ++k, playback.advance()) {
    PlanInstant instant{
        numbers(motion.trajectory.position.col(k)), numbers(motion.trajectory.velocity.col(k)), {}};
    planner::Playback stop = playback;
    stop.aim_at(0.0);
    while (k > 0 && !stop.at_rest()) {
      stop.advance();
      instant.stop_s.push_back(stop.place_s());
    }
    out.instants.push_back(std::move(instant));
  }
  return out;
}

void save(const PlanOptions& o, const model::CoveredArm& covered,
          const planner::TaskSettings& settings, const Plan& plan) {
  const kin::ArmModel& arm = covered.arm;
  PlanFile file;
  file.robot = o.robot;
  file.inputs = inputs_of(o.robot, covered);
  file.period_s = settings.period_s;
  file.margin_m = settings.margin_m;
  file.stop_margin_m = planner::kStopMargin * settings.margin_m;
  file.stop_delay_s = planner::stop_delay_s(arm, settings.period_s);
  file.stop_alone_s = planner::stop_alone_s(settings.period_s);
  for (const PlannedMotion& motion : plan.motions) file.motions.push_back(exported(motion, arm));
  if (!o.tool_m.empty()) {
    PlanMotion& motion = file.motions.front();
    for (const std::vector<double>& piece : o.tool_m)
      motion.tool.push_back({{piece.begin(), piece.end() - 3}, {piece.end() - 3, piece.end()}});
    motion.tool_off_m = o.off_m;
    motion.tool_off_rad = planner::ToolTolerance{}.angle_rad;
  }
  save_plan(file, o.out);
}

/// A log for viewers: the scene once, the arm's safety balls as they move.
void write_scene(const std::string& file, const kin::ArmModel& arm, const kin::Table& table,
                 const Plan& plan) {
  NewLog log({.path = file, .force = true}, std::vector<std::string>{});
  const auto put = [&](const google::protobuf::Message& message, const std::string& topic,
                       std::chrono::nanoseconds stamp) {
    const auto& type = *message.GetDescriptor();
    const log::Schema schema{0, type.full_name(), "protobuf", runtime::descriptor_set(type)};
    log::Channel channel{0, 0, topic, "protobuf", {}};
    const std::string data = message.SerializeAsString();
    const auto at = static_cast<std::uint64_t>(stamp.count());
    log.write({log.channel(channel, &schema), 0, at, at, data});
  };
  put(model::to_entities(table, arm, {}), "scene", {});
  std::vector<Eigen::Isometry3d> X;
  Eigen::Isometry3d X_WO(Eigen::Translation3d(table.object));
  std::chrono::nanoseconds stamp{};
  for (const PlannedMotion& motion : plan.motions) {
    const auto& samples = motion.trajectory;
    std::optional<Eigen::Isometry3d> X_EO;
    for (Eigen::Index k = 0; k < samples.samples(); ++k) {
      const Eigen::Isometry3d X_WE = kin::end_effector(arm, samples.position.col(k));
      if (!motion.obstacles.held.empty()) {
        if (!X_EO) X_EO = X_WE.inverse() * X_WO;
        X_WO = X_WE * *X_EO;
      }
      kin::forward(arm, samples.position.col(k), X);
      put(model::to_transforms(arm, X, X_WO, table.goals, stamp), "frames", stamp);
      stamp += from_seconds(samples.period_s);
    }
  }
  log.finish();
}

int plan_and_print(const PlanOptions& o) {
  const model::CoveredArm covered = model::load_checked_arm(o.robot);
  const kin::ArmModel& arm = covered.arm;
  const kin::Table table = model::load_scene(o.scene);
  const Eigen::VectorXd start =
      o.start.empty() ? arm.home : posture(arm, "--start", o.start, planner::kAtLimit);
  if (o.goals.empty() + o.hand_m.empty() + o.task.empty() + o.tool_m.empty() != 3)
    throw ConfigError("expected one of --goal, --hand, --task, and --straight with --arc");
  planner::TaskSettings settings;
  settings.margin_m = o.margin_m;
  settings.speed = o.speed;
  settings.contact_speed = std::min(settings.contact_speed, o.speed);
  settings.period_s = 1.0 / arm.rate_hz;
  settings.search.seed = settings.roadmap.seed = o.seed;

  if (!o.via.empty() && (!o.task.empty() || !o.tool_m.empty()))
    throw ConfigError("--via: a task and a tool's way have a way of their own");
  planner::PlanRequest request{table, start, move_of(o, arm)};
  if (!o.task.empty()) request.what = task_of(o.task, table);

  if (const std::string why = planner::beyond_limits(arm, start, 0.0); !why.empty())
    std::cerr << "plan: --start: " << why << "; planned from the limit\n";
  const auto begin = std::chrono::steady_clock::now();
  const auto plan = plan_asked(o, arm, request, settings);
  const double planning_s = to_seconds(std::chrono::steady_clock::now() - begin);
  Json report{{"planned", plan.has_value()}, {"planning_s", planning_s}};
  if (!plan) {
    report["reason"] = plan.error().reason;
    if (o.json) std::cout << json_text(report) << '\n';
    std::cerr << "plan: " << plan.error().reason << '\n';
    return kFailed;
  }
  double duration_s = 0.0;
  TextTable lines({"motion", "length [rad]", "time [s]", "found by"});
  report["motions"] = Json::array();
  for (const PlannedMotion& motion : plan->motions) {
    const double time_s = motion.trajectory.duration_s();
    duration_s += time_s;
    lines.row({name_of(motion.phase), fmt::format("{:.3f}", motion.length_rad),
               fmt::format("{:.3f}", time_s), name_of(motion.found_by)});
    report["motions"].push_back({{"phase", name_of(motion.phase)},
                                 {"length_rad", motion.length_rad},
                                 {"duration_s", time_s},
                                 {"found_by", name_of(motion.found_by)},
                                 {"end_rad", numbers(motion.trajectory.position.rightCols(1))}});
  }
  report["length_rad"] = plan->length_rad;
  report["duration_s"] = duration_s;
  for (const auto& q : plan->waypoints) report["path_rad"].push_back(numbers(q));
  if (!o.out.empty()) save(o, covered, settings, *plan);
  if (!o.scene_log.empty()) write_scene(o.scene_log, arm, table, *plan);
  if (o.json) {
    std::cout << json_text(report) << '\n';
    return kDone;
  }
  if (plan->motions.size() > 1) lines.print(std::cout, use_colour(STDOUT_FILENO));
  for (const auto& q : plan->waypoints) {
    for (Eigen::Index j = 0; j < q.size(); ++j) fmt::print("{}{:.4f}", j == 0 ? "" : ",", q[j]);
    fmt::print("\n");
  }
  const bool one = plan->motions.size() == 1;
  fmt::print("{:.3f} rad in {:.3f} s, planned in {:.1f} ms{}{}\n", plan->length_rad, duration_s,
             1e3 * planning_s, one ? ", found by " : "",
             one ? name_of(plan->motions.front().found_by) : "");
  return kDone;
}

}  // namespace

void add_plan(CLI::App& program, int& exit_code) {
  auto o = std::make_shared<PlanOptions>();
  CLI::App* verb = program.add_subcommand("plan", "Plans a motion or a task of an arm");
  verb->add_option("SCENE", o->scene,
                   "Obstacles: a file as models/bar_table.yaml, bar and "
                   "object may be absent")
      ->required();
  verb->add_option("--robot", o->robot, "Arm, a file as models/lwr4.yaml [lwr4.yaml]");
  verb->add_option("--start", o->start, "Posture in rad, Q,Q,.. [home of the arm's file]")
      ->type_name("Q,Q,..");
  verb->add_option("--goal", o->goals, "Posture to end in; the best of several (repeatable)")
      ->type_name("Q,Q,..");
  verb->add_option("--hand", o->hand_m, "Or: place of the hand in m")
      ->expected(3)
      ->type_name("X Y Z");
  verb->add_option("--via", o->via,
                   "Place where the motion rests on its way: posture, or place of the hand "
                   "(repeatable, in this order)")
      ->type_name("Q,Q,..|hand:X,Y,Z");
  CLI::Option* straight =
      verb->add_option("--straight", o->straight,
                       "Or: the tool goes straight to a place in m, turned as it is (repeatable)")
          ->type_name("X,Y,Z");
  CLI::Option* arc = verb->add_option("--arc", o->arcs,
                                      "Or: on a circle through one place to another; with "
                                      "--straight in the order given (repeatable)")
                         ->type_name("X,Y,Z,X,Y,Z");
  verb->add_option("--off-m", o->off_m, "How far the tool may be off its way [0.001]")
      ->check(CLI::Range(2e-4, 0.1));
  verb->add_option("--search", o->search,
                   "What looks for a way: waves on a roadmap, trees, or both [trees; for a task "
                   "both]")
      ->check(CLI::IsMember({"waves", "trees", "both"}));
  verb->add_option("--task", o->task,
                   "Or: bring the object to a goal of the scene: precision|full above|below GOAL")
      ->expected(3)
      ->type_name("GRIP WAY GOAL");
  verb->add_option("--margin-m", o->margin_m, "Least distance of everything [0.002]")
      ->check(number_not_below_zero);
  verb->add_option("--speed", o->speed, "Share of the arm's speeds and accelerations [0.6]")
      ->check(CLI::Range(0.05, 0.95));
  verb->add_option_function<double>(
          "--deadline-ms", [o](double ms) { o->deadline_s = 1e-3 * ms; },
          "No plan is better than a late one")
      ->check(number_not_below_zero);
  verb->add_option("--seed", o->seed, "Another one finds another path [1]");
  verb->add_option("-o,--out", o->out, "Write the plan, every instant with its stops, to this file")
      ->type_name("FILE");
  verb->add_option("--scene", o->scene_log, "Write a log for `mimesis view` and Foxglove")
      ->type_name("FILE.mcap");
  verb->add_flag("--json", o->json,
                 "One object: planned, planning_s, reason or motions, length_rad, duration_s, "
                 "path_rad");
  verb->footer(
      "`mimesis plan verify FILE` proves a written plan again, by other means.\n"
      "Exit codes: 0 done, 1 no plan, 2 usage or a file that is wrong.\n"
      "Examples:\n"
      "  mimesis plan bar_table.yaml --hand 0.6 0.1 0.6\n"
      "  mimesis plan planar16.yaml --robot planar2.yaml --start=-0.3,-0.2 --goal 0.92,1.42\n"
      "  mimesis plan bar_table.yaml --via hand:0.4,0.4,0.6 --hand 0.6 -0.3 0.5\n"
      "  mimesis plan bar_table.yaml --straight 0.5,0.3,0.6 --arc 0.6,0.1,0.7,0.5,-0.1,0.6\n"
      "  mimesis plan bar_table.yaml --task precision above high -o plan.yaml --scene "
      "plan.mcap\n"
      "  mimesis plan verify plan.yaml");
  verb->callback([o, verb, straight, arc, &exit_code] {
    o->tool_m = tool_pieces(*o, *verb, straight, arc);
    exit_code = plan_and_print(*o);
  });
}

}  // namespace mimesis::tool
