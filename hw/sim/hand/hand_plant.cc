#include "hw/sim/hand/hand_plant.h"

#include <algorithm>
#include <cmath>

namespace mimesis::hw::sim {
namespace {

using modbus::Contact;
using modbus::HandOutput;
using modbus::Initialisation;
using modbus::Motion;

constexpr double kSlowest = 0.2;             // share of full speed at register 0
constexpr std::uint8_t kNotActivated = 0x7;  // fault codes of the hand
constexpr double kGripCurrent = 100.0;       // at full force, in tenths of mA

}  // namespace

void HandPlant::initialise(double dt, const HandOutput& output) {
  Initialisation& phase = input_.initialisation;
  if (!output.activate) {
    phase = Initialisation::reset;
    return;
  }
  if (phase == Initialisation::reset) {
    phase = Initialisation::activating;
    left_s_ = params_.activation_time_s;
  } else if (phase == Initialisation::done && output.mode != input_.mode) {
    phase = Initialisation::changing_mode;
    left_s_ = params_.mode_time_s;
  } else if (phase != Initialisation::done && (left_s_ -= dt) <= 0.0) {
    phase = Initialisation::done;
    input_.mode = output.mode;
  }
}

void HandPlant::move(double dt, const HandOutput& output, std::optional<double> contact) {
  const double request = output.position / 255.0;
  const double speed =
      (kSlowest + (1.0 - kSlowest) * output.speed / 255.0) / params_.closing_time_s;
  const bool closing = request > closure_;
  double target = request;
  const bool meets = closing && contact && *contact < request;
  if (meets) target = std::max(closure_, *contact);
  closure_ += std::clamp(target - closure_, -speed * dt, speed * dt);

  const bool arrived = std::abs(closure_ - target) < 1e-9;
  input_.motion = !arrived ? Motion::moving : meets ? Motion::all_stopped : Motion::at_request;
  input_.contact = !arrived ? Contact::none : meets ? Contact::while_closing : Contact::at_request;
  const double current = meets && arrived ? kGripCurrent * output.force / 255.0 : 0.0;
  input_.current = static_cast<std::uint8_t>(current);
}

void HandPlant::step(double dt, const HandOutput& output, std::optional<double> contact) {
  initialise(dt, output);
  const bool ready = input_.initialisation == Initialisation::done;
  input_.activated = output.activate;
  input_.go = output.go;
  input_.requested = output.position;
  input_.fault = output.go && !output.activate ? kNotActivated : 0;
  if (ready && output.go) {
    move(dt, output, contact);
  } else {
    input_.current = 0;
  }
  input_.position = static_cast<std::uint8_t>(std::lround(255.0 * closure_));
}

}  // namespace mimesis::hw::sim
