// `mimesis robot check`: whether the humanoid of a URDF can walk, and the files to let it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/json_text.h"
#include "common/model/files.h"
#include "nodes/walker/check/feasible_gait.h"
#include "nodes/walker/check/find_biped.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using walker::Finding;

struct CheckOptions {
  std::string urdf, name, folder;
  std::vector<std::string> mesh_paths;  // FROM=TO
  bool force = false, json = false;
};

/// Points of a solid that may touch the ground, in the link's frame.
void add_points(const robot::Solid& solid, std::vector<Eigen::Vector3d>& out) {
  using Kind = robot::Solid::Kind;
  const Eigen::Vector3d& half = solid.half_m;
  const auto add = [&](double x, double y, double z) {
    out.push_back(solid.X_LS * Eigen::Vector3d(x, y, z));
  };
  if (solid.kind == Kind::mesh) {
    for (const auto& triangle : solid.mesh->triangles())
      for (const Eigen::Vector3d& p : triangle) out.push_back(solid.X_LS * p);
  } else if (solid.kind == Kind::box) {
    for (int i = 0; i < 8; ++i)
      add((i & 1 ? 1 : -1) * half.x(), (i & 2 ? 1 : -1) * half.y(), (i & 4 ? 1 : -1) * half.z());
  } else if (solid.kind == Kind::ball) {  // its lower end, in whatever direction of the link
    for (int i = 0; i < 6; ++i) {
      out.push_back(solid.X_LS.translation() +
                    (i % 2 == 0 ? 1.0 : -1.0) * half.x() * Eigen::Vector3d::Unit(i / 2));
    }
  } else {
    constexpr int kCorners = 24;
    for (int i = 0; i < kCorners; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kCorners;
      for (const double end : {-1.0, 1.0})
        add(half.x() * std::cos(angle), half.x() * std::sin(angle), end * half.z());
    }
  }
}

/// Geometry of the feet for collisions, else as they are drawn.
walker::ContactPoints contacts_of(const CheckOptions& o, const robot::RobotTree& tree,
                                  std::vector<Finding>& findings) {
  robot::MeshPaths paths;
  for (const std::string& path : o.mesh_paths) {
    const std::size_t at = path.find('=');
    paths.emplace_back(path.substr(0, at), path.substr(at + 1));
  }
  walker::ContactPoints points;
  for (const bool drawn : {false, true}) {
    try {
      for (const auto& [link, solids] :
           robot::link_solids(o.urdf, walker::foot_links(tree), drawn, paths))
        for (const robot::Solid& solid : solids) add_points(solid, points[link]);
    } catch (const ConfigError& e) {
      if (findings.empty()) findings.push_back({Finding::Kind::assumed, "soles", e.what()});
      points.clear();
      continue;
    }
    if (points.empty()) continue;
    if (drawn)
      findings.push_back({Finding::Kind::assumed, "soles",
                          "no collision geometry of the feet could be used: as they are drawn"});
    break;
  }
  return points;
}

struct Checked {
  walker::FoundBiped found;
  walker::FeasibleGait gait;
};

/// With the knees bent as far as the joints allow a walk at full speed; straighter ones carry more.
Checked check(const robot::RobotTree& tree, const walker::ContactPoints& contacts) {
  Checked best;
  bool first = true;
  for (const double knee_rad : {0.87, 0.7, 0.55, 0.4}) {
    Checked now{.found = walker::find_biped(tree, contacts, knee_rad), .gait = {}};
    if (now.found.biped) now.gait = walker::feasible_gait(*now.found.biped);
    const auto price = [](const Checked& c) {  // by what is missing, then by what it can
      if (!c.found.biped) return 1e9;
      if (c.gait.possible) return -c.gait.gait.most_forward_m_s;
      return 1e3 * std::max(c.gait.load.speed_share, c.gait.load.torque_share);
    };
    const bool better = first || price(now) < price(best);
    if (better) best = std::move(now);
    first = false;
    const bool fast =
        best.gait.possible && best.gait.gait.most_forward_m_s >=
                                  0.8 * walker::gait_settings(*best.found.biped).most_forward_m_s;
    if (fast) break;
    const bool only_posture = std::ranges::all_of(best.found.findings, [](const Finding& f) {
      return f.kind != Finding::Kind::missing || f.part == "half-sitting";
    });
    if (!only_posture) break;
  }
  return best;
}

std::string worst_text(const walker::GaitLoad& load) {
  return fmt::format(
      "{} turns at {:.1f} rad/s, {:.0f} % of its limit, {} bears {:.0f} N m, {:.0f} %",
      load.speed_joint, load.speed_rad_s, 100.0 * load.speed_share, load.torque_joint,
      load.torque_n_m, 100.0 * load.torque_share);
}

void note_gait(Checked& checked) {
  if (!checked.found.biped) return;
  const walker::FeasibleGait& g = checked.gait;
  std::vector<Finding>& findings = checked.found.findings;
  if (!g.possible) {
    findings.push_back(
        {Finding::Kind::missing, "gait",
         fmt::format("not even steps in place of 1.2 s are within 90 % of the limits: "
                     "at {} s {}{}",
                     g.gait.step_s, worst_text(g.load),
                     g.load.short_ticks > 0 ? ", and a leg is too short" : "")});
    return;
  }
  const walker::GaitSettings own = walker::gait_settings(*checked.found.biped);
  findings.push_back(
      {g.slowed ? Finding::Kind::assumed : Finding::Kind::found, "gait",
       fmt::format(
           "{:.2f} m/s forward, {:.2f} sideways, {:.2f} rad/s, steps of {} s and {:.0f} mm{}; "
           "{}",
           g.gait.most_forward_m_s, g.gait.most_sideways_m_s, g.gait.most_turn_rad_s, g.gait.step_s,
           1e3 * g.gait.step_height_m,
           g.gait.most_forward_m_s < own.most_forward_m_s
               ? fmt::format(" (at {:.2f} m/s {}{})", own.most_forward_m_s, worst_text(g.beyond),
                             g.beyond.short_ticks > 0 ? ", and a leg is too short" : "")
               : std::string(),
           worst_text(g.load))});
  findings.push_back(
      {Finding::Kind::found, "steps",
       fmt::format("up to {:.2f} m long, {:.2f} to {:.2f} m wide", g.gait.longest_step_m,
                   g.gait.narrowest_step_m, g.gait.widest_step_m)});
}

std::string robot_text(const CheckOptions& o, const Checked& checked, const std::string& robot) {
  const walker::FoundBiped& found = checked.found;
  const robot::BipedNames& n = found.names;
  const fs::path urdf = fs::absolute(o.urdf).lexically_normal();
  const bool beside = urdf.parent_path() == fs::absolute(o.folder).lexically_normal();
  std::string text =
      fmt::format("# {} from {}, by `mimesis robot check`. Look at what it assumed:\n", robot,
                  urdf.filename().string());
  for (const Finding& f : found.findings) {
    if (f.kind == Finding::Kind::assumed) text += fmt::format("#   {}: {}\n", f.part, f.text);
  }
  text += fmt::format("urdf: {}\n", yaml_word(beside ? urdf.filename().string() : urdf.string()));
  if (found.balance_inertias) text += "balance_inertias: true\n";
  if (!found.fixed.empty()) text += "fixed:          # joints that stay\n";
  for (const auto& [joint, at] : found.fixed)
    text += fmt::format("  - {{joint: {}, at: {}}}\n", yaml_word(joint), at);
  text += "frames:\n";
  for (const walker::FoundFrame& f : found.frames) {
    text +=
        fmt::format("  - {{name: {}, link: {}, position_m: [{}, {}, {}], rpy_rad: [{}, {}, {}]}}\n",
                    yaml_word(f.name), yaml_word(f.link), f.position_m.x(), f.position_m.y(),
                    f.position_m.z(), f.rpy_rad.x(), f.rpy_rad.y(), f.rpy_rad.z());
  }
  text += fmt::format("soles: [{}, {}]\n", yaml_word(n.sole[0]), yaml_word(n.sole[1]));
  if (!n.hand[0].empty())
    text += fmt::format("hands: [{}, {}]\n", yaml_word(n.hand[0]), yaml_word(n.hand[1]));
  text += fmt::format("trunk: {}\n", yaml_word(n.trunk));
  if (!n.head.empty()) text += fmt::format("head: {}\n", yaml_word(n.head));
  const walker::GaitSettings& g = checked.gait.gait;
  text += fmt::format(
      "imu: {}\n"
      "sole: {{back_m: {:.5g}, front_m: {:.5g}, inner_m: {:.5g}, outer_m: {:.5g}}}   # from the "
      "point "
      "below the ankle\n"
      "drives: cia402\nrate_hz: 200\n"
      "a_max_rad_s2: 300       # a URDF does not say it\n"
      "step_s: {}\n"
      "gait: {{step_height_m: {:.4g}, most_forward_m_s: {:.4g}, most_sideways_m_s: {:.4g}, "
      "most_turn_rad_s: {:.4g}}}\n"
      "half_sitting:\n",
      yaml_word(n.imu), n.sole_back_m, n.sole_front_m, n.sole_inner_m, n.sole_outer_m, g.step_s,
      g.step_height_m, g.most_forward_m_s, g.most_sideways_m_s, g.most_turn_rad_s);
  for (const auto& [joint, angle] : n.half_sitting)
    text += fmt::format("  - {{joint: {}, angle_rad: {}}}\n", yaml_word(joint), angle);
  return text;
}

void write(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.flush();
  if (!out) throw ConfigError(file.string() + ": cannot be written");
}

const char* word_of(Finding::Kind kind) {
  if (kind == Finding::Kind::missing) return "missing";
  return kind == Finding::Kind::assumed ? "assumed" : "found";
}

int check_robot(CheckOptions o) {
  if (o.name.empty()) o.name = fs::path(o.urdf).stem().string();
  const robot::RobotTree tree = robot::read_urdf(o.urdf);
  const std::string file =
      o.folder.empty() ? "" : (fs::path(o.folder) / (o.name + ".yaml")).string();
  if (!file.empty() && fs::exists(file) && !o.force)
    throw ConfigError(file + ": is there already, expected a new --name, or --force");
  std::vector<Finding> first;
  const walker::ContactPoints contacts = contacts_of(o, tree, first);
  Checked checked = check(tree, contacts);
  checked.found.findings.insert(checked.found.findings.begin(), first.begin(), first.end());
  note_gait(checked);
  const bool walks = checked.gait.possible;
  if (walks && !file.empty()) {
    write(file, robot_text(o, checked, tree.name()));
    model::load_biped(file);  // what others will read
  }
  if (o.json) {
    ordered_json findings = ordered_json::array();
    for (const Finding& f : checked.found.findings)
      findings.push_back({{"kind", word_of(f.kind)}, {"part", f.part}, {"text", f.text}});
    const walker::GaitSettings& g = checked.gait.gait;
    ordered_json gait = nullptr;
    if (walks)
      gait = {{"step_s", g.step_s},
              {"step_height_m", g.step_height_m},
              {"most_forward_m_s", g.most_forward_m_s},
              {"most_sideways_m_s", g.most_sideways_m_s},
              {"most_turn_rad_s", g.most_turn_rad_s},
              {"speed_share", checked.gait.load.speed_share},
              {"torque_share", checked.gait.load.torque_share},
              {"slowed", checked.gait.slowed}};
    std::cout << json_text(ordered_json{{"robot", tree.name()},
                                        {"walks", walks},
                                        {"findings", findings},
                                        {"gait", gait},
                                        {"file", walks ? file : ""}})
              << '\n';
    return walks ? 0 : 1;
  }
  for (const Finding& f : checked.found.findings)
    fmt::print("{:8} {}: {}\n", word_of(f.kind), f.part, printable(f.text));
  if (!walks) fmt::print("{} does not walk: see what is missing above\n", printable(tree.name()));
  if (walks && !file.empty()) fmt::print("{}: mimesis walk-trials --robot {}\n", file, file);
  return walks ? 0 : 1;
}

}  // namespace

void add_robot(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("robot", "Makes the files of a robot of your own");
  verb->require_subcommand(1);
  auto o = std::make_shared<CheckOptions>();
  CLI::App* sub = verb->add_subcommand(
      "check", "Whether the humanoid of a URDF can walk: what is missing, and its file");
  sub->add_option("URDF", o->urdf, "The robot; its root link is the pelvis, x forward, z up")
      ->required();
  sub->add_option("-o,--out", o->folder, "Folder for the robot's file [none is written]");
  sub->add_option("--name", o->name, "Of that file [name of the URDF]");
  sub->add_option("--mesh-path", o->mesh_paths,
                  "Names of meshes that begin with FROM are in the folder TO (repeatable)")
      ->type_name("FROM=TO")
      ->check([](const std::string& path) {
        const std::size_t at = path.find('=');
        return at == 0 || at == std::string::npos ? "expected FROM=TO" : std::string();
      });
  sub->add_flag("--force", o->force, "Replaces a file that is there");
  sub->add_flag("--json", o->json, "One object instead of lines");
  sub->footer(
      "Exit codes: 0 it can walk, 1 something is missing, 2 usage, or no URDF.\n"
      "Examples:\n"
      "  mimesis robot check talos_full_v2.urdf -o .\n"
      "  mimesis walk-trials --robot talos_full_v2.yaml --suite walks30");
  sub->callback([o, &exit_code] { exit_code = check_robot(*o); });
}

}  // namespace mimesis::tool
