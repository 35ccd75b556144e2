#pragma once
#include <memory>
#include <string>
#include <vector>

#include "hw/actuators.h"
#include "hw/setpoint_limiter.h"
#include "hw/udp/link.h"
#include "hw/udp/packet.h"

namespace mimesis::hw::udp {

struct DriverOptions {
  std::string address{};              ///< of the controller, for reasons
  std::vector<std::string> names{};   ///< names of the joints, for reasons
  JointLimits limits{};               ///< enforced on every set-point
  double rate_hz = 250.0;             ///< rate of read and write
  double boot_timeout_s = 2.0;        ///< until a missing controller is reported
  double transition_timeout_s = 1.0;  ///< until it has to follow
  double feedback_timeout_s = 0.1;    ///< without a state: it is lost
  double watchdog_s = 0.1;            ///< without a command: it stops
  double tracking_window_rad =
      0.1;                    ///< largest distance of a joint, beyond what its speed explains
  std::uint32_t session = 1;  ///< another one for each start
  bool readonly = false;      ///< never sends; nothing is known then
};

/// Joints behind a controller that takes set-points and gives states in datagrams, as research arms
/// have it. Per cycle one command out; all that came in. Of datagrams that were lost, doubled or
/// overtaken the newest counts. A controller that was started again, obeys somebody else, has
/// another number of joints or is silent is a fault; after it a set-point is obeyed again only
/// after Mode::idle, and starts at the actual posture.
class Driver final : public PhasedActuators {
 public:
  Driver(DriverOptions options, std::unique_ptr<Link> link);

  const Reading& read(Time now) override;
  void write(Time now, const Setpoint& setpoint) override;
  void stop() noexcept override;
  std::string reset_faults() override;
  Traffic traffic() const override { return traffic_; }

 private:
  void take(const State& state);
  void lose(const std::string& why);
  void supervise();
  void supervise_tracking();
  void send(Order order);
  std::string controller() const { return "controller " + options_.address; }

  DriverOptions options_;
  std::unique_ptr<Link> link_;
  Traffic traffic_;
  State state_;      ///< the newest
  Command command_;  ///< the last one
  Time heard_{};     ///< when the newest state came
  Header first_;     ///< of the first command to this session of the controller: a stop
  std::vector<double> posture_;
  int astray_ = 0;  ///< states in a row
  Time reset_until_{};
  bool begun_ = false, fresh_ = false;
  bool known_ = false;  ///< it answers us
  bool lost_ = false;   ///< the fault ends with the stream once it answers again
};

}  // namespace mimesis::hw::udp
