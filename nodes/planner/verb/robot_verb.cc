// `mimesis robot new`: from an arm's URDF to its file, its machine file and a launch file.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <random>

#include "common/error.h"
#include "common/model/files.h"
#include "common/robot/arm_chain.h"
#include "nodes/planner/verb/cover_text.h"
#include "nodes/planner/verb/srdf.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

bool in_names(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-';
}

constexpr double kMostSpeed_rad_s = 100.0;  // beyond it a number says that nobody knew it

struct NewOptions {
  std::string urdf, name, folder = ".", base, tip, srdf, group;
  std::vector<std::string> states;
  std::vector<double> home_rad;
  std::vector<std::string> mesh_paths, without_geometry;  // FROM=TO; links
  double speed_rad_s = 0.0, speeds_up_s = 0.5, fitted_m = 0.0;
  bool force = false;
};

/// The robot, and what its URDF leaves open.
struct NewArm {
  robot::RobotTree tree;
  robot::ArmChain chain;
  bool use_visual = false;
  std::vector<std::string>
      shapeless{};  ///< links that move and have mass, but no geometry, or are left out
  std::vector<double> home{}, acceleration{};
  std::vector<double> speed{};  ///< of all joints, if the URDF lacks some
  bool slides = false;
  Srdf srdf{};
  std::string lacks{};  ///< what states of the SRDF place beside the robot, a line each
};

/// The chain of the SRDF's group that is asked for, or of the only one that is an arm.
Srdf::Chain chain_of(const NewOptions& o, const Srdf& srdf, const robot::RobotTree& tree) {
  constexpr int kFewJoints = 3;  // a finger has less
  std::vector<std::string> names, arms;
  std::string fault;
  for (const auto& [name, chain] : srdf.chains) {
    if (!chain.fault.empty()) {
      fault = chain.fault;
      continue;
    }
    names.push_back(name);
    int joints = 0;
    for (int l = tree.find_link(chain.tip); l >= 0 && tree.link(l).name != chain.base;
         l = tree.link(l).parent)
      joints += tree.link(l).type != robot::JointType::fixed;
    if (joints >= kFewJoints) arms.push_back(name);
  }
  const std::string all = fmt::format("{}", fmt::join(names, ", "));
  if (!o.group.empty()) {
    const auto found = srdf.chains.find(o.group);
    if (found != srdf.chains.end() && !found->second.fault.empty())
      throw ConfigError(found->second.fault);
    if (found == srdf.chains.end())
      throw ConfigError(fmt::format("{}: group '{}' is no chain of joints, expected one of: {}",
                                    o.srdf, o.group, all));
    return found->second;
  }
  if (!o.tip.empty() || srdf.chains.empty()) return {o.base, o.tip};
  if (arms.empty() && !fault.empty()) throw ConfigError(fault);
  if (arms.size() != 1)
    throw ConfigError(fmt::format("{}: expected --group, one of: {}", o.srdf, all));
  return srdf.chains.at(arms.front());
}

/// Of the named states, else of that which is called home or ready: joints that they place. Those
/// asked for must be there.
std::map<std::string, double> placed_joints(const NewOptions& o, const Srdf& srdf) {
  std::map<std::string, double> placed;
  const auto place = [&](const std::string& name) {
    bool found = false;
    for (const Srdf::State& state : srdf.states) {
      if (state.name != name) continue;
      found = true;
      for (const auto& [joint, at] : state.joints) placed[joint] = at;
    }
    return found;
  };
  for (const std::string& name : o.states)
    if (!place(name)) throw ConfigError(fmt::format("{}: no state '{}'", o.srdf, name));
  if (o.states.empty() && !place("home")) place("ready");
  return placed;
}

NewArm look_at(const NewOptions& o) {
  NewArm arm{.tree = robot::read_urdf(o.urdf),
             .chain = {},
             .shapeless = o.without_geometry,
             .home = o.home_rad};
  if (!o.srdf.empty()) arm.srdf = read_srdf(o.srdf, arm.tree);
  const Srdf::Chain chain = chain_of(o, arm.srdf, arm.tree);
  arm.chain = robot::find_arm_chain(arm.tree, chain.base, chain.tip);
  const std::map<std::string, double> placed = placed_joints(o, arm.srdf);
  for (const auto& [joint, at] : placed) {
    const auto is = [&joint = joint](const robot::Link& link) { return link.joint == joint; };
    if (std::ranges::none_of(arm.tree.links(), is))
      arm.lacks +=
          fmt::format("{}: a state places joint '{}', which the robot lacks\n", o.srdf, joint);
  }
  for (auto& [joint, at] : arm.chain.fixed)
    if (const auto given = placed.find(joint); given != placed.end()) at = given->second;
  const auto parts = robot::link_parts(o.urdf);
  for (const robot::Link& link : arm.tree.links()) {
    const int moved = arm.chain.joints.empty() ? -1 : arm.chain.joints.front();
    if (moved < 0 || !arm.tree.carries(moved, arm.tree.require_link(link.name))) continue;
    const robot::LinkParts& has = parts.at(link.name);
    if (has.collision) continue;
    arm.use_visual |= has.visual;
    if (!has.visual && link.inertia.mass_kg > 0.0 &&
        std::ranges::count(arm.shapeless, link.name) == 0)
      arm.shapeless.push_back(link.name);
  }
  bool lacks = false;
  for (const int l : arm.chain.joints) {
    const robot::Link& link = arm.tree.link(l);
    arm.slides |= link.type == robot::JointType::prismatic;
    const bool limited = link.max_speed > 0.0 && link.max_speed <= kMostSpeed_rad_s;
    if (!limited && o.speed_rad_s == 0.0)
      throw ConfigError(
          fmt::format("{}: joint '{}' has no limit of velocity ({:g}), expected one "
                      "above 0 and up to {:g}, or --speed-rad-s",
                      o.urdf, link.joint, link.max_speed, kMostSpeed_rad_s));
    lacks |= !limited;
    arm.speed.push_back(limited ? link.max_speed : o.speed_rad_s);
    arm.acceleration.push_back(arm.speed.back() / o.speeds_up_s);
    if (!o.home_rad.empty()) continue;
    const auto given = placed.find(link.joint);
    arm.home.push_back(given != placed.end() ? given->second
                                             : std::min(std::max(0.0, link.lower), link.upper));
  }
  if (!lacks) arm.speed.clear();
  return arm;
}

std::string arm_text(const NewOptions& o, const NewArm& arm) {
  const fs::path urdf = fs::absolute(o.urdf).lexically_normal();
  const bool beside = urdf.parent_path() == fs::absolute(o.folder).lexically_normal();
  std::string text = fmt::format(
      "# {} from {}, by `mimesis robot new`. Look at each value that a URDF does not have:\n"
      "# home_rad, a_max_rad_s2 (a quick stop of the drives has to reach it), fixed, tool_m.\n"
      "name: {}\n"
      "base_m: [0, 0, 0]           # of link {} in the world\n"
      "tool_m: [0, 0, 0]           # where things are held, in link {}\n"
      "chain:\n"
      "  urdf: {}\n  base: {}\n  tip: {}\n"
      "  home_rad: [{}]\n  a_max_rad_s2: [{:.6g}]\n",
      arm.tree.name(), urdf.filename().string(), yaml_word(o.name), arm.chain.base, arm.chain.tip,
      yaml_word(beside ? urdf.filename().string() : urdf.string()), yaml_word(arm.chain.base),
      yaml_word(arm.chain.tip), fmt::join(arm.home, ", "), fmt::join(arm.acceleration, ", "));
  if (!arm.speed.empty())
    text +=
        fmt::format("  v_max_rad_s: [{:.6g}]      # of joints without a limit, by --speed-rad-s\n",
                    fmt::join(arm.speed, ", "));
  if (!arm.chain.fixed.empty()) text += "  fixed:                    # where these joints stay\n";
  for (const auto& [joint, at] : arm.chain.fixed)
    text += fmt::format("    - {{joint: {}, at: {:.6g}}}\n", yaml_word(joint), at);
  if (!o.mesh_paths.empty()) text += "  mesh_paths:               # of names of meshes\n";
  for (const std::string& path : o.mesh_paths) {
    const std::size_t at = path.find('=');
    text += fmt::format("    - {{from: {}, to: {}}}\n", yaml_word(path.substr(0, at)),
                        yaml_word(fs::absolute(path.substr(at + 1)).lexically_normal().string()));
  }
  if (o.fitted_m > 0.0) text += fmt::format("  fitted_m: {:.6g}\n  most_parts: 48\n", o.fitted_m);
  if (arm.use_visual)
    text +=
        "  use_visual: true          # links without collision geometry are as they are drawn\n";
  if (!arm.shapeless.empty()) {
    std::vector<std::string> names;
    for (const std::string& link : arm.shapeless) names.push_back(yaml_word(link));
    text += fmt::format("  without_geometry: [{}]   # checked against nothing: no plan is proven\n",
                        fmt::join(names, ", "));
  }
  return text;
}

std::string machine_text(const NewOptions& o, const NewArm& arm) {
  std::string text = fmt::format(
      "# Drives of {}: put in those of your robot (docs/hardware); `mimesis hw check` looks at "
      "it.\n"
      "robot: ./{}.yaml\nbuses: [{{can: \"embedded:{}\"}}]\njoints:\n",
      o.name, o.name, o.name);
  int node_id = 0;
  for (const int l : arm.chain.joints)
    text += fmt::format(
        "  - {{name: A{0}, bus: 0, node_id: {0}, increments_per_turn: 4096, gear_ratio: 100}}  # "
        "{1}\n",
        ++node_id, arm.tree.link(l).joint);
  return text;
}

std::string launch_text(const NewOptions& o) {
  return fmt::format(R"(# {0}: simulated drives, bridge, planner and the page.
#   mimesis launch {0}.launch.yaml
#   mimesis service call planner/do '{{"home": true}}'
version: 1
clock: ${{arg:clock}}
args:
  clock: {{type: string, default: wall, help: "wall; with simulated drives also lockstep, which no load of the machine disturbs"}}
  sim:
    type: bool
    default: true
    help: "simulated drives, on the buses of the machine file"
    implies: {{enable: auto}}
  enable: {{type: string, default: service, help: "what lets the arm move: service (mimesis service call bridge/enable), or auto"}}
  view: {{type: bool, default: true, help: "the page at http://localhost:8765"}}
nodes:
  drives:
    exec: mimesis_sim_drives
    if: ${{arg:sim}}
    params: {{machine: ./{0}_machine.yaml}}
    stop: {{order: last}}
  bridge:
    exec: mimesis_bridge
    params: {{machine: ./{0}_machine.yaml, hand: "", enable: "${{arg:enable}}"}}
    in: {{command: planner/command, hand_command: }}
    required: true
    stop: {{order: last}}
  planner:
    exec: mimesis_planner
    params: {{robot: ./{0}.yaml, table: ./{0}_table.yaml, has_hand: false}}
    in: {{scene: , decision: , joint_states: bridge/joint_states, hand: }}
    required: true
  page:
    exec: mimesis
    if: ${{arg:view}}
    args: [view]
    ready: started
)",
                     o.name);
}

std::string table_text(const NewOptions& o) {
  return fmt::format(
      R"(# What stands around {0}: nothing yet. In the world, in metres; more: models/README.md.
balls: []     # {{center_m: [0.5, 0, 0.3], radius_m: 0.05}}
boxes: []     # {{name: table, center_m: [0.5, 0, -0.02], half_extent_m: [0.4, 0.4, 0.02]}}
)",
      o.name);
}

void write(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.flush();
  if (!out) throw ConfigError(file.string() + ": cannot be written");
}

/// A line for each pair of groups that touch so often that few postures are left.
std::string crowded_text(const kin::ArmModel& arm) {
  const Eigen::MatrixXd postures = model::sampled_postures(arm);
  const auto all = static_cast<int>(postures.cols());
  std::map<std::pair<int, int>, int> touching;
  for (int i = 0; i < all; ++i) {
    for (const auto& pair : model::touching_groups(arm, postures.col(i))) ++touching[pair];
  }
  std::string text;
  for (const auto& [pair, times] : touching) {
    if (times < all / 4 || std::ranges::count(arm.self_pairs, pair) == 0) continue;
    text += fmt::format(
        "{} and {} touch in {} % of all postures, which no plan can pass: a smaller --fitted-m "
        "fits "
        "finer parts; where the URDF's own shapes overlap, an SRDF leaves the pair out (--srdf)\n",
        arm.groups[static_cast<std::size_t>(pair.first)],
        arm.groups[static_cast<std::size_t>(pair.second)], 100 * times / all);
  }
  return text;
}

/// The arm's home if nothing touches there, else the middle of its limits, or a posture near it
/// where nothing does.
std::vector<double> choose_home(kin::ArmModel& arm) {
  const auto touches = [&arm](const Eigen::VectorXd& q) {
    return std::ranges::any_of(model::touching_groups(arm, q), [&](const auto& pair) {
      return std::ranges::count(arm.self_pairs, pair) > 0;
    });
  };
  const Eigen::VectorXd middle = 0.5 * (arm.q_min + arm.q_max);
  Eigen::VectorXd q = arm.home;
  std::mt19937 draw(1);
  constexpr int kTries = 256;
  for (int i = 0; i < kTries && touches(q); ++i) {
    q = middle;
    const double share = 0.5 * i / kTries;  // of the limits' range, to either side
    for (Eigen::Index j = 0; j < q.size(); ++j)
      q[j] += share * (arm.q_max[j] - arm.q_min[j]) *
              (2.0 * static_cast<double>(draw()) / 4294967296.0 - 1.0);
  }
  if (!touches(q)) arm.home = q;
  return {arm.home.begin(), arm.home.end()};
}

/// Pairs of links that the SRDF lets touch are not checked, and said. Those that never touch are
/// checked nevertheless: that is cheap, and true if the SRDF is not.
std::string let_touch(const Srdf& srdf, kin::ArmModel& arm) {
  std::string text;
  for (const Srdf::Pair& pair : srdf.disabled) {
    if (pair.reason == "Never") continue;
    const auto is = [&](const std::pair<int, int>& groups) {
      const std::string &a = arm.groups[static_cast<std::size_t>(groups.first)],
                        &b = arm.groups[static_cast<std::size_t>(groups.second)];
      return (a == pair.links[0] && b == pair.links[1]) ||
             (a == pair.links[1] && b == pair.links[0]);
    };
    if (std::erase_if(arm.self_pairs, is) == 0) continue;
    text += fmt::format("{} and {} are not checked against each other, as the SRDF says{}\n",
                        pair.links[0], pair.links[1],
                        pair.reason.empty() ? "" : " (" + pair.reason + ")");
  }
  return text;
}

int make(NewOptions o) {
  if (o.name.empty()) {
    o.name = fs::path(o.urdf).stem().string();
    std::ranges::replace_if(o.name, std::not_fn(in_names), '_');
  }
  if (!std::ranges::all_of(o.name, in_names))
    throw ConfigError("--name " + o.name + ": expected letters, digits, _ and -");
  const std::string stem = (fs::path(o.folder) / o.name).string();
  const std::string file = stem + ".yaml", machine = stem + "_machine.yaml",
                    table = stem + "_table.yaml", launch = stem + ".launch.yaml";
  NewArm arm = look_at(o);
  for (const std::string& old : {file, machine, table, launch}) {
    if (fs::exists(old) && !o.force)
      throw ConfigError(old + ": is there already, expected a new --name, or --force");
  }
  std::error_code ignored;  // write() says what is wrong
  fs::create_directories(o.folder, ignored);
  const fs::path draft = stem + ".draft.yaml";
  write(draft, arm_text(o, arm));
  model::CoveredArm covered;
  const auto began = std::chrono::steady_clock::now();
  try {
    covered = model::load_covered_arm(draft.string());
  } catch (const ConfigError& e) {
    fs::remove(draft);
    std::string what = e.what();  // a line for each mistake
    for (std::size_t at = 0; (at = what.find(draft.string(), at)) != what.npos; at += o.urdf.size())
      what.replace(at, draft.string().size(), o.urdf);
    throw ConfigError(what);
  }
  fs::remove(draft);
  const std::chrono::duration<double> fitted = std::chrono::steady_clock::now() - began;
  if (o.home_rad.empty()) arm.home = choose_home(covered.arm);
  const std::string let = let_touch(arm.srdf, covered.arm);
  write(file, arm_text(o, arm) + cover_text(covered));
  std::size_t parts = 0;
  for (const model::CoveredLink& link : covered.links) parts += link.parts.size();
  fmt::print("{}: {} joints from {} to {}, {} convex parts on {} links, fitted in {:.1f} s\n", file,
             arm.chain.joints.size(), arm.chain.base, arm.chain.tip, parts, covered.links.size(),
             fitted.count());
  for (const auto& [joint, at] : arm.chain.fixed)
    fmt::print("joint {} stays at {:.6g}\n", joint, at);
  fmt::print("{}{}{}{}", arm.lacks, touching_text(covered), let, crowded_text(covered.arm));
  for (const std::string& link : covered.arm.unchecked)
    fmt::print("of no known shape, checked against nothing: {}\n", link);
  if (arm.slides) {
    fmt::print("no machine and launch file: a joint slides, the bridge counts in radians\n");
    return 0;
  }
  write(machine, machine_text(o, arm));
  write(table, table_text(o));
  write(launch, launch_text(o));
  fmt::print(
      "{}: drives, simulated ones until you put in yours\n{}: obstacles, none yet\n{}: mimesis "
      "launch {}\n",
      machine, table, launch, launch);
  return 0;
}

}  // namespace

void add_robot(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("robot", "Makes the files of a robot of your own");
  verb->require_subcommand(1);
  auto o = std::make_shared<NewOptions>();
  CLI::App* sub =
      verb->add_subcommand("new", "From an arm's URDF: its file, a machine file, a launch file");
  sub->add_option("URDF", o->urdf, "The robot, with its gripper")->required();
  sub->add_option("--name", o->name, "Of the robot and its files [name of the URDF]");
  sub->add_option("-o,--out", o->folder, "Folder of the files")->capture_default_str();
  sub->add_option("--srdf", o->srdf,
                  "MoveIt's file of the robot: base and tip, states, links that may touch");
  sub->add_option("--group", o->group, "Its group of joints that is the arm [the only one]");
  sub->add_option("--state", o->states,
                  "Its state that is home, and where fingers stay [home, or ready] (repeatable)")
      ->allow_extra_args(false);
  sub->add_option("--base", o->base, "Link at the arm's begin [the root]");
  sub->add_option("--tip", o->tip, "Link at its end [of the longest chain, without fingers]");
  sub->add_option("--home", o->home_rad, "Posture at home in rad, Q,Q,.. [0, or the nearest limit]")
      ->delimiter(',');
  sub->add_option("--mesh-path", o->mesh_paths,
                  "Names of meshes that begin with FROM are in the folder TO (repeatable)")
      ->type_name("FROM=TO")
      ->check([](const std::string& path) {
        const std::size_t at = path.find('=');
        return at == 0 || at == std::string::npos ? "expected FROM=TO" : std::string();
      });
  sub->add_option("--without-geometry", o->without_geometry,
                  "Checks LINK against nothing, and proves no plan (repeatable)")
      ->type_name("LINK")
      ->allow_extra_args(false);
  sub->add_option("--speed-rad-s", o->speed_rad_s,
                  "Speed of joints whose limit of velocity the URDF lacks (0 or none)")
      ->check(CLI::Range(0.001, kMostSpeed_rad_s));
  sub->add_option("--speeds-up-s", o->speeds_up_s,
                  "Time to full speed: a URDF has no accelerations")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str();
  sub->add_option("--fitted-m", o->fitted_m,
                  "Parts may reach out of the links by this [0.006]; finer ones take longer")
      ->check(CLI::Range(0.001, 1.0));
  sub->add_flag("--force", o->force, "Replaces files that are there");
  sub->footer(
      "Convex parts of the links are fitted once, and kept in the arm's file.\n"
      "Exit codes: 0 done, 2 usage, or a URDF that lacks something: it says what.\n"
      "Examples:\n"
      "  mimesis robot new panda.urdf --home 0,-0.7,0,-2,0,1.5,0.7\n"
      "  mimesis launch panda.launch.yaml\n"
      "  mimesis service call planner/do '{\"home\": true}'");
  sub->callback([o, &exit_code] { exit_code = make(*o); });
}

}  // namespace mimesis::tool
