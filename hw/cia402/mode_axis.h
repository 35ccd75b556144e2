#pragma once
#include <memory>
#include <string>
#include <vector>

#include "hw/can/bus.h"
#include "hw/cia402/axis_master.h"

namespace mimesis::hw::cia402 {

/// One drive in profile position, homing, cyclic velocity or torque, alone with its master: to home
/// it, to try it on the bench. Robots are driven by JointDriver. Per cycle one batch of frames out
/// and one in.
class ModeAxis {
 public:
  /// @param joint its mode, and what the drive is told
  ModeAxis(const std::string& name, const Axis& axis, const JointSetup& joint, double rate_hz,
           std::unique_ptr<can::Bus> bus);

  /// One cycle. The drive is configured, then enabled while `power`, else stopped and disabled.
  void cycle(Time now, bool power);

  /// Set-points of the cyclic modes. The caller minds the joint's limits.
  void turn(double rad_s) { master_.target_rad_s = rad_s; }
  void push(double n_m) { master_.target_n_m = n_m; }
  /// A new set-point of profile position, instead of the present one, once the drive is enabled.
  void move_to(double rad);

  bool enabled() const {
    return known() && master_.reading().drive == DriveState::operation_enabled;
  }
  bool known() const { return started_ && master_.heard(); }  ///< reading() is the drive's
  /// Homing has found the zero, or the profile's goal is reached.
  bool done() const { return step_ == Step::done; }
  /// One line: what the drive refuses, why it fails or is gone; empty: well.
  const std::string& failure() const { return failure_; }
  const JointReading& reading() const { return master_.reading(); }

 private:
  /// Handshake of a set-point and of homing: the bit is raised, acknowledged, lowered.
  enum class Step : std::uint8_t { none, asked, raised, taken, done };
  void receive();
  void supervise();
  std::uint16_t operate();

  AxisMaster master_;
  OperationMode mode_;
  std::unique_ptr<can::Bus> bus_;
  std::vector<can::Frame> inbox_, outbox_;
  Step step_ = Step::none;
  int raised_ = 0;  // cycles
  std::string failure_;
  bool begun_ = false, started_ = false;  // first cycle seen; drive configured and operational
  Time now_{}, heartbeat_due_{};
};

}  // namespace mimesis::hw::cia402
