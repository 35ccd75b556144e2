#pragma once
#include <memory>
#include <string>
#include <vector>

#include "hw/actuators.h"
#include "hw/can/bus.h"
#include "hw/cia402/axis.h"
#include "hw/powercube/protocol.h"
#include "hw/setpoint_limiter.h"

namespace mimesis::hw::powercube {

struct DriverOptions {
  std::vector<cia402::Axis>
      axes{};  ///< node_id: the module; sign and offset_rad count, increments do not
  std::vector<std::string> names{};  ///< names of the joints, for reasons; empty: A1, A2 ...
  JointLimits limits{};              ///< written to the modules, and enforced on every set-point
  double rate_hz = 50.0;             ///< rate of read and write
  double boot_timeout_s = 2.0;       ///< until missing modules are reported
  double feedback_timeout_s = 0.1;   ///< without an answer: the module is lost
  bool readonly = false;  ///< never sends; nothing is known then, for modules speak only when asked
};

/// PowerCube modules on one bus as the joints of an arm. Per cycle one batch out: the watchdog's
/// refresh and a step (while following) or a question to each module; each answers with position
/// and state. A module that hears no refresh halts by itself. After any fault all are halted; a
/// set-point is obeyed again only after Mode::idle, and starts at the actual posture.
class Driver final : public PhasedActuators {
 public:
  /// Halts all modules first.
  Driver(DriverOptions options, std::unique_ptr<can::Bus> bus);

  const Reading& read(Time now) override;
  void write(Time now, const Setpoint& setpoint) override;
  void stop() noexcept override;
  std::string reset_faults() override;
  Traffic traffic() const override { return bus_->counters(); }

 private:
  struct Module {
    std::string name;
    cia402::Axis axis;
    int step = 0;  ///< of the set-up
    int attempts = 0;
    bool waits = false;
    Time asked{};
    std::uint32_t config = 0;
    std::uint32_t state = 0;
    bool not_ok = false;  ///< short state of the last motion
    bool known = false;   ///< position and state have come
    Time heard{};
  };

  void receive();
  void take(Module& module, JointReading& joint, const Answer& answer);
  void set_up(std::vector<can::Frame>& out);
  can::Frame request(const Module& module, std::size_t joint) const;
  void supervise();
  void ask_all(bool state);
  std::string trouble_of(const Module& module) const;

  DriverOptions options_;
  std::unique_ptr<can::Bus> bus_;
  std::vector<Module> modules_;
  std::vector<can::Frame> inbox_, outbox_;
  std::vector<double> posture_;
  Time forgiven_until_{};  ///< after a reset: answers that are older tell of the old fault
  std::uint64_t cycles_ = 0;
  bool begun_ = false, configured_ = false;
};

}  // namespace mimesis::hw::powercube
