#include "hw/cia402/mode_axis.h"

#include <utility>

namespace mimesis::hw::cia402 {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kLongestSilence(500);
constexpr int kStale = 3;  // cycles in which a statusword may still be of before a command

}  // namespace

ModeAxis::ModeAxis(const std::string& name, const Axis& axis, const JointSetup& joint,
                   double rate_hz, std::unique_ptr<can::Bus> bus)
    : master_(name + " (node " + std::to_string(axis.node_id) + ")", axis,
              setup_steps(axis, joint, period_of(rate_hz))),
      mode_(joint.mode),
      bus_(std::move(bus)),
      inbox_(256) {
  if (mode_ == OperationMode::homing) step_ = Step::asked;
}

void ModeAxis::move_to(double rad) {
  master_.target_rad = rad;
  step_ = Step::asked;
}

void ModeAxis::receive() {
  std::size_t count = 0;
  do {
    count = bus_->receive(inbox_);
    for (const can::Frame& frame : std::span(inbox_).first(count)) {
      if (const char* trouble = can::trouble(frame); trouble != nullptr && failure_.empty())
        failure_ = master_.name() + ": the CAN controller is " + trouble;
      const Identity id = identify(frame);
      if (id.node == master_.axis().node_id && (frame.id & can::kErrorFlag) == 0)
        master_.handle(id, frame, now_);
    }
  } while (count == inbox_.size());
}

void ModeAxis::supervise() {
  if (!failure_.empty()) return;
  const DriveState state = master_.reading().drive;
  if (!master_.failure().empty()) {
    failure_ = master_.failure();
  } else if (started_ && master_.feedback_age(now_) > kLongestSilence) {
    failure_ = master_.name() + ": no feedback for 0.5 s";
  } else if (state == DriveState::operation_enabled && !master_.mode_shown() &&
             master_.state_age(now_) > kLongestSilence) {
    failure_ = master_.wrong_mode();
  } else if (state == DriveState::fault) {
    failure_ = master_.complaint(DriveState::operation_enabled);
  } else if (step_ == Step::taken && mode_ == OperationMode::homing) {
    const unsigned word = master_.reading().statusword;
    const bool interrupted =
        (word & statusword::kReached) != 0 && (word & statusword::kAcknowledged) == 0;
    if ((word & statusword::kHomingError) != 0) {
      failure_ = master_.name() + ": homing error, " + text(master_.reading());
    } else if (interrupted) {
      failure_ = master_.name() + ": homing was interrupted, " + text(master_.reading());
    }
  }
}

/// Controlword of an enabled drive. [CiA 402-2: set-points of profile position, homing]
std::uint16_t ModeAxis::operate() {
  const std::uint16_t word = master_.reading().statusword;
  const bool acknowledged = (word & statusword::kAcknowledged) != 0;
  const bool reached = (word & statusword::kReached) != 0;
  const bool homes = mode_ == OperationMode::homing;
  constexpr std::uint16_t kEnable = controlword::kEnableOperation;
  switch (step_) {
    case Step::asked:
      if (!homes && acknowledged) return kEnable;  // the drive still handles the last one
      step_ = Step::raised;
      raised_ = 0;
      break;
    case Step::raised:
      if (homes ? ++raised_ >= kStale : acknowledged) step_ = Step::taken;
      break;
    case Step::taken:
      if (reached && homes == acknowledged) step_ = Step::done;
      break;
    default:
      return kEnable;
  }
  if (homes) return kEnable | controlword::kStartHoming;
  return step_ == Step::raised ? kEnable | controlword::kNewSetpoint | controlword::kAtOnce
                               : kEnable;
}

void ModeAxis::cycle(Time now, bool power) {
  now_ = now;
  outbox_.clear();
  if (!std::exchange(begun_, true))  // it may still be as its last master has left it
    outbox_.push_back(nmt(Nmt::reset_communication, master_.axis().node_id));
  receive();
  supervise();
  master_.advance(now, outbox_);
  if (master_.configured() && !std::exchange(started_, true)) {
    outbox_.push_back(nmt(Nmt::start, master_.axis().node_id));
    master_.watch_from(now);
  }
  const DriveState state = master_.reading().drive;
  if (!power || !failure_.empty() || !started_ || !master_.heard()) {
    master_.controlword = controlword::kQuickStop;
  } else {
    const bool enabled = state == DriveState::operation_enabled;
    if (enabled && !master_.mode_shown()) master_.ask_mode(outbox_);
    master_.controlword =
        enabled && master_.mode_shown() ? operate() : towards_enabled(state, master_.controlword);
  }
  if (now >= heartbeat_due_) {
    outbox_.push_back(heartbeat(kMasterNode, NmtState::operational));
    master_.guard(outbox_);
    heartbeat_due_ = now + milliseconds(kMasterHeartbeatMs);
  }
  outbox_.push_back(master_.command());
  outbox_.push_back(sync());
  bus_->send(outbox_);
}

}  // namespace mimesis::hw::cia402
