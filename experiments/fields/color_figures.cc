#include <cmath>

#include "experiments/fields/figures.h"
#include "experiments/fields/network_plots.h"
#include "nodes/cognition/network_file.h"

namespace mimesis::cognition {
namespace {

using namespace reproduce;

/// Both sequences practised with their colour: light objects to the high goal, dark ones to the low
/// goal.
FieldNetwork<double> color_trained() {
  FieldNetwork<double> network(load_network());
  rehearse(network, task::parse_demonstration("precision,above,high,light"));
  rehearse(network, task::parse_demonstration("full,below,low,dark"));
  return network;
}

/// Both sequences practised, colour never seen.
FieldNetwork<double> color_blind() {
  FieldNetwork<double> network(load_network());
  rehearse(network, task::parse_demonstration("precision,above,high"));
  rehearse(network, task::parse_demonstration("full,below,low"));
  return network;
}

void plot_colours(Report& report, const PlotDir& dir, const std::string& name,
                  const std::string& title, const Recording& r) {
  if (!dir) return;
  plot_snapshot(report.picture(*dir / (name + ".png")), title, r);
}

/// Fig. 2.23: the colour of the object alone triggers goal and means.
Report color_to_goal(const PlotDir& dir) {
  Report report;
  FieldNetwork<double> network = color_trained(), blind = color_blind();
  for (const Color color : {Color::light, Color::dark}) {
    const int site = static_cast<int>(color) - 1;
    const std::string name(site_label(Layer::color, site));
    const Recording r = record(network, {.shown = {.color = color}});
    report.holds(name + " object: PFC holds " + std::string(site_label(Layer::pfc, site)),
                 r.result.site(Layer::pfc) == site, published("M18 fig. 2.23"));
    report.holds(name + " object: PF holds " + std::string(site_label(Layer::pf, site)),
                 r.result.site(Layer::pf) == (site == 0 ? kPgAt : kFgBt), published("M18 2.4.4"));
    report.holds(name + " object: F5 holds " + std::string(site_label(Layer::f5_grip, site)) +
                     " and " + std::string(site_label(Layer::f5_transport, site)),
                 r.result.site(Layer::f5_grip) == site &&
                     r.result.site(Layer::f5_transport) == site && r.result.decision.settled,
                 prototype("fields.md"));
    const TrialResult before = run_trial(blind, {.shown = {.color = color}});
    report.holds("control, before learning: " + name + " says nothing about the goal",
                 before.site(Layer::color) == site && std::isnan(before.onset(Layer::pfc)) &&
                     std::isnan(before.onset(Layer::pf)),
                 prototype("fields.md"));
    plot_colours(report, dir, site == 0 ? "fig-2.23-light" : "fig-2.23-dark",
                 "Fig. 2.23: a " + name + " object, nothing else seen", r);
  }
  return report;
}

/// Fig. 2.24: the goal alone triggers the colour of the object to grasp.
Report goal_to_color(const PlotDir& dir) {
  Report report;
  FieldNetwork<double> network = color_trained(), blind = color_blind();
  for (const Goal goal : {Goal::high, Goal::low}) {
    const int site = static_cast<int>(goal) - 1;
    const std::string name(site_label(Layer::pfc, site));
    const Recording r = record(network, {.shown = {.goal = goal}});
    report.holds(name + " goal: COL holds " + std::string(site_label(Layer::color, site)),
                 r.result.site(Layer::color) == site, published("M18 fig. 2.24"));
    report.holds(name + " goal: PF holds " + std::string(site_label(Layer::pf, site)),
                 r.result.site(Layer::pf) == (site == 0 ? kPgAt : kFgBt), reproduce::goal());
    const TrialResult before = run_trial(blind, {.shown = {.goal = goal}});
    report.holds("control, before learning: the " + name + " goal names no colour",
                 before.site(Layer::pfc) == site && std::isnan(before.onset(Layer::color)),
                 prototype("fields.md"));
    plot_colours(report, dir, site == 0 ? "fig-2.24-high" : "fig-2.24-low",
                 "Fig. 2.24: the " + name + " goal, nothing else seen", r);
  }
  return report;
}

}  // namespace

void add_color_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-2.23", "A colour cue triggers the goal and the means", "M18",
                  Declared{.published = 4, .prototype = 4}, color_to_goal);
  to.emplace_back("fig-2.24", "The goal triggers the colour of the object to grasp", "M18",
                  Declared{.published = 2, .prototype = 2, .goal = 2}, goal_to_color);
}

}  // namespace mimesis::cognition
