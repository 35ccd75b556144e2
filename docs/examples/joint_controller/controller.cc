// Moves one joint of an arm by an angle, and tells when the drive has it there.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "common/runtime/run_node.h"
#include "proto/bridge.pb.h"

using namespace mimesis;
using namespace std::chrono_literals;

struct ControllerParams {
  double rate_hz = 200.0;   ///< of set-points: the robot's [Hz]
  int joint = 1;            ///< which, from 1 [1]
  double angle_rad = 0.4;   ///< by how much it turns [rad]
  double duration_s = 2.0;  ///< of the motion [s]
  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 1.0, 1000.0);
    v("joint", joint, 1, 64);
    v("angle_rad", angle_rad, -1.0, 1.0);
    v("duration_s", duration_s, 0.5, 60.0);
  }
};

class Controller {
 public:
  using Params = ControllerParams;
  Controller(const Params& params, runtime::Bus& bus)
      : params_(params),
        states_(bus, "states"),
        command_(bus, "command"),
        arrived_(bus, "arrived") {}

  void step(runtime::Time now) {
    const v1::JointState* state = states_.fresh(now, 100ms);
    if (state == nullptr || state->position_rad_size() < params_.joint)
      return;  // the bridge stops the arm
    const int joint = params_.joint - 1;
    if (set_point_.position_rad().empty()) {  // begins where the arm is
      *set_point_.mutable_position_rad() = state->position_rad();
      from_ = state->position_rad(joint);
      begin_ = now;
    }
    const double s =
        std::min(std::chrono::duration<double>(now - begin_).count() / params_.duration_s, 1.0);
    const double target = from_ + params_.angle_rad * (1.0 - std::cos(std::numbers::pi * s)) / 2.0;
    set_point_.set_position_rad(joint, target);
    command_.send(set_point_, now);
    if (s < 1.0 || std::abs(state->position_rad(joint) - target) > 0.001) return;
    v1::JointState arrived = *state;
    arrived_.send(arrived, now);
  }

 private:
  Params params_;
  runtime::Latest<v1::JointState> states_;
  runtime::Out<v1::JointCommand> command_;
  runtime::Out<v1::JointState> arrived_;
  v1::JointCommand set_point_;
  double from_ = 0.0;
  runtime::Time begin_{};
};

int main(int argc, char** argv) {
  return runtime::run_node<Controller>(
      argc, argv, {.name = "controller", .about = "Moves one joint by an angle"});
}
