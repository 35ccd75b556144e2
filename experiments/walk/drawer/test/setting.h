#pragma once
#include "experiments/walk/drawer/drawer_trial.h"

namespace mimesis::walk {

/// models/biped.yaml and its learned actions, loaded once a program.
struct Setting {
  Robot robot = load_robot("biped");
  synthesizer::BipedDrawer actions = synthesizer::make_biped_drawer(robot.biped);

  DrawerTrialSpec spec() const {
    DrawerTrialSpec s;
    s.robot = &robot;
    s.actions = &actions;
    return s;
  }
};

inline const Setting& setting() {
  static const Setting one;
  return one;
}

}  // namespace mimesis::walk
