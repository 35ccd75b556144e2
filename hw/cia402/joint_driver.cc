#include "hw/cia402/joint_driver.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "common/error.h"
#include "common/runtime/log.h"
#include "common/time.h"

namespace mimesis::hw::cia402 {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kRetry(1000);  // between attempts to set up, and after bus-off
constexpr milliseconds kLongestStop(2000);
constexpr double kBehind = 4.0;  // cycles that a drive may be behind its set-point
constexpr milliseconds kListen(kMasterHeartbeatMs * 3 / 2);  // another master is heard in it

std::string seconds(double s) { return fmt::format("{:.3g} s", s); }

bool in_fault(DriveState state) {
  return state == DriveState::fault || state == DriveState::fault_reaction_active;
}

bool powered(DriveState state) {
  return state == DriveState::operation_enabled || state == DriveState::quick_stop_active ||
         state == DriveState::fault_reaction_active;
}

}  // namespace

JointDriver::JointDriver(JointDriverOptions options, std::unique_ptr<can::Bus> bus)
    : PhasedActuators(options.limits, options.rate_hz, "searching the drives"),
      options_(std::move(options)),
      bus_(std::move(bus)),
      inbox_(256),
      axis_of_node_(kLastNode + 1, -1),
      posture_(options_.axes.size(), 0.0),
      astray_(options_.axes.size(), 0),
      following_(options_.axes.size()) {
  const std::size_t n = options_.axes.size();
  MIMESIS_ASSERT(options_.limits.q_min.size() == static_cast<Eigen::Index>(n));
  MIMESIS_ASSERT(options_.names.empty() || options_.names.size() == n);
  const Period period = period_of(options_.rate_hz);
  const JointLimits& l = options_.limits;
  for (std::size_t i = 0; i < n; ++i) {
    const Axis& axis = options_.axes[i];
    const auto k = static_cast<Eigen::Index>(i);
    axis_of_node_[static_cast<std::size_t>(axis.node_id)] = static_cast<int>(i);
    const std::string name =
        options_.names.empty() ? "A" + std::to_string(i + 1) : options_.names[i];
    axes_.emplace_back(name + " (node " + std::to_string(axis.node_id) + ")", axis,
                       setup_steps(axis,
                                   {.q_min = l.q_min[k],
                                    .q_max = l.q_max[k],
                                    .v_max = l.v_max[k],
                                    .a_max = l.a_max[k],
                                    .following_window_rad = options_.following_window_rad,
                                    .following_time_s = options_.following_time_s,
                                    .mode = stream_mode(axis)},
                                   period, options_.quick_stop),
                       from_seconds(options_.sdo_timeout_s));
  }
  outbox_.reserve(4 * n + 8);
  std::vector<can::Wanted> wanted;  // all that a node sends or is sent
  for (const Axis& axis : options_.axes)
    wanted.push_back({static_cast<std::uint32_t>(axis.node_id), kLastNode});
  wanted.push_back({sync().id, 0x7FF});
  wanted.push_back({heartbeat(kMasterNode, NmtState::operational).id, 0x7FF});
  bus_->want(wanted);
}

void JointDriver::stop() noexcept {
  if (options_.readonly || !begun_) return;  // the drives are not ours
  try {
    outbox_.clear();
    for (AxisMaster& axis : axes_) axis.controlword = controlword::kQuickStop;
    send_setpoints();
  } catch (...) {  // the drives' own watchdogs are left
  }
  outbox_.clear();
  leave_motion();
}

/// Drives that others still reach must not go on while this one is searched: each has to hear of
/// the stop, on whatever wire this is, and all at the same time.
void JointDriver::lose(AxisMaster& axis, const std::string& why) {
  const bool moving = reading_.phase != Phase::fault && reading_.phase != Phase::idle &&
                      reading_.phase != Phase::starting;
  if (moving) halted_until_ = now_ + milliseconds(kRpdoDeadlineMs);
  fault(axis.name() + ": " + why);
  axis.restart();
  configured_ = false;
}

/// Two masters pull the drives to and fro: who has had them stops them, who comes later sends
/// nothing.
void JointDriver::meet_master(const char* sign) {
  fault(std::string("another master runs this bus: its ") + sign + " was heard");
  if (ours_) return;
  silent_until_ = now_ + kRetry;
  begun_ = false;
}

/// An NMT command to our nodes, one by one: others on the bus may be somebody else's.
void JointDriver::tell_all(Nmt command) {
  for (const AxisMaster& axis : axes_) outbox_.push_back(nmt(command, axis.axis().node_id));
}

void JointDriver::receive() {
  std::size_t count = 0;
  do {
    count = bus_->receive(inbox_);
    for (const can::Frame& frame : std::span(inbox_).first(count)) {
      if (const char* trouble = can::trouble(frame)) {
        for (AxisMaster& axis : axes_) lose(axis, std::string("the CAN controller is ") + trouble);
        silent_until_ = now_ + kRetry;
      }
      if ((frame.id & can::kErrorFlag) != 0) continue;
      const Identity id = identify(frame);
      if (!options_.readonly) {
        if (id.kind == Identity::Kind::sync) meet_master("SYNC");
        if (id.kind == Identity::Kind::heartbeat && id.node == kMasterNode)
          meet_master("heartbeat (node 127)");
      }
      const int axis = axis_of_node_[static_cast<std::size_t>(id.node)];
      if (axis >= 0) axes_[static_cast<std::size_t>(axis)].handle(id, frame, now_);
    }
  } while (count == inbox_.size());
}

/// A cycle counts for a drive only if another one has answered: then the bus has carried the SYNC,
/// and it is not the machine that is late.
void JointDriver::count_answers() {
  if (!std::exchange(synced_, false)) return;
  const auto answered = std::ranges::count_if(axes_, &AxisMaster::answered);
  for (AxisMaster& axis : axes_) axis.end_cycle(answered > (axis.answered() ? 1 : 0));
}

void JointDriver::set_up() {
  for (AxisMaster& axis : axes_) axis.advance(now_, outbox_);
  if (std::ranges::all_of(axes_, &AxisMaster::configured)) {
    tell_all(Nmt::start);
    for (AxisMaster& axis : axes_) {
      axis.watch_from(now_);
    }
    for (const std::string& line : notes()) runtime::warn("drive {}", line);
    configured_ = ours_ = true;
    reset_until_ = {};
    reading_.posture_known = false;
    enter(Phase::idle);  // a drive that was kept powered shows it with the first feedback
    return;
  }
  std::string missing;
  for (AxisMaster& axis : axes_) {
    if (!axis.failure().empty()) {
      if (now_ < retry_at_) continue;
      retry_at_ = now_ + kRetry;
      fault(axis.failure());
      axis.restart();
      outbox_.push_back(nmt(Nmt::pre_operational, axis.axis().node_id));
    } else if (!axis.found()) {
      missing += (missing.empty() ? "" : ", ") + axis.name();
    }
  }
  if (reading_.phase == Phase::fault && now_ >= retry_at_) {  // a halt may have stopped them
    retry_at_ = now_ + kRetry;
    for (const AxisMaster& axis : axes_)
      if (!axis.found()) outbox_.push_back(nmt(Nmt::pre_operational, axis.axis().node_id));
  }
  if (!missing.empty() && now_ - entered_ > from_seconds(options_.boot_timeout_s)) {
    fault("no answer within " + seconds(options_.boot_timeout_s) + " from " + missing);
  }
}

std::vector<std::string> JointDriver::notes() const {
  std::vector<std::string> all;
  for (const AxisMaster& axis : axes_)
    all.insert(all.end(), axis.notes().begin(), axis.notes().end());
  return all;
}

void JointDriver::supervise_axis(AxisMaster& axis) {
  if (axis.take_rebooted()) return lose(axis, "the drive has restarted");
  if (!axis.changed().empty() && reading_.phase != Phase::fault) {
    return fault(axis.name() + ": " + axis.changed() +
                 ": another program on the bus has changed what protects it");
  }
  if (axis.heartbeat_age(now_) > milliseconds(kDriveHeartbeatTimeoutMs)) {
    return lose(axis,
                (axis.axis().guarding ? "no answer to node guarding with a new toggle bit for "
                                      : "no heartbeat for ") +
                    seconds(1e-3 * kDriveHeartbeatTimeoutMs));
  }
  if (axis.heard() && axis.missed() >= options_.missed_syncs) {
    return lose(axis, fmt::format("no feedback on {} SYNCs that others have answered",
                                  options_.missed_syncs));
  }
  if (axis.heard() && axis.missed_lately() > options_.missed_syncs) {
    return lose(axis,
                fmt::format("no feedback on {} of the last {} SYNCs that others have answered",
                            axis.missed_lately(), AxisMaster::kLately));
  }
  // A drive that has just been started may take its time.
  const double timeout_s =
      axis.heard() ? options_.feedback_timeout_s : std::max(options_.feedback_timeout_s, 0.1);
  if (axis.feedback_age(now_) > from_seconds(timeout_s)) {
    return lose(axis, "no feedback for " + seconds(timeout_s));
  }
  if (!axis.heard()) return;
  const DriveState state = axis.reading().drive;
  const bool failed = in_fault(state);
  switch (reading_.phase) {
    case Phase::enabling: {  // a fault found here is about to be reset
      const bool enabled = state == DriveState::operation_enabled;
      if (enabled && axis.mode_shown()) return;
      const Time limit = from_seconds(options_.transition_timeout_s);
      const bool stuck = std::min(now_ - entered_, axis.state_age(now_)) > limit;
      const bool wandering = now_ - entered_ > 4 * limit;
      if (enabled && stuck) return fault(axis.wrong_mode());
      if (stuck || wandering)
        fault(axis.complaint(next_towards_enabled(state, options_.quick_stop)));
      return;
    }
    case Phase::following:
      if (state != DriveState::operation_enabled)
        fault(axis.complaint(DriveState::operation_enabled));
      return;
    default:
      if (failed) fault(axis.complaint(DriveState::switch_on_disabled));
      return;
  }
}

/// What is measured is two cycles behind the set-point, and the drive needs as much to follow. Two
/// new measurements in a row have to say it: the first after a pause of the drive is old.
void JointDriver::supervise_tracking() {
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const AxisMaster& axis = axes_[i];
    const auto k = static_cast<Eigen::Index>(i);
    const double distance = std::abs(axis.reading().position_rad - limiter_.position()[k]);
    const double allowed = options_.tracking_window_rad +
                           kBehind / options_.rate_hz * std::abs(limiter_.velocity()[k]);
    if (axis.feedback_age(now_) > Time(0)) continue;
    supervise_following(i);
    if (options_.tracking_window_rad <= 0.0) continue;
    astray_[i] = distance > allowed ? astray_[i] + 1 : 0;
    if (astray_[i] < 2) continue;
    return fault(fmt::format("{}: is {:.3f} rad from its set-point, allowed are {:.3f}; it is {}",
                             axis.name(), distance, allowed, text(axis.reading())));
  }
}

/// However small the motion: what the statusword says of it (CiA 402-2, cyclic synchronous
/// position: bit 12, the drive follows; bit 13, following error), a deviation beyond the window
/// that was set for the drives, and a joint that stands although the set-point has moved.
void JointDriver::supervise_following(std::size_t i) {
  constexpr double kLeast = 3.0;  // increments
  constexpr double kPatience_s = 0.3;
  const AxisMaster& axis = axes_[i];
  Following& f = following_[i];
  const double patience_s =
      options_.following_time_s > 0.0 ? options_.following_time_s : kPatience_s;
  const auto lasts = [&](bool so, std::optional<Time>& since) {
    if (!so) since.reset();
    if (so && !since) since = now_;
    return since && now_ - *since > from_seconds(patience_s);
  };
  const auto k = static_cast<Eigen::Index>(i);
  const double position = axis.reading().position_rad, asked = limiter_.position()[k];
  const unsigned word = axis.reading().statusword;
  const bool denies = axis.tells_following() && (word & statusword::kAcknowledged) == 0 &&
                      !axis.axis().accepts("no_bit12");
  const bool error = (word & statusword::kHomingError) != 0;  // here: following error
  if (lasts(denies || error, f.denies)) {
    return fault(fmt::format(
        "{}: does not follow: {} for {}; it is {}{}", axis.name(),
        denies ? "bit 12 of its statusword is 0" : "its statusword says following error (bit 13)",
        seconds(patience_s), text(axis.reading()),
        denies ? "; `accept: [no_bit12]` of an axis that never sets it" : ""));
  }
  const double window = options_.following_window_rad, distance = std::abs(position - asked);
  const double allowed = window + kBehind / options_.rate_hz * std::abs(limiter_.velocity()[k]);
  if (lasts(window > 0.0 && distance > allowed, f.deviates)) {
    return fault(
        fmt::format("{}: is {:.4f} rad from its set-point for {}, following_window_rad is "
                    "{:.4f}; it is {}",
                    axis.name(), distance, seconds(patience_s), window, text(axis.reading())));
  }
  const double step = 1.0 / axis.axis().increments_per_rad;
  if (std::abs(position - f.stood_at) > 0.5 * step) {
    f.stood_at = position;
    f.asked_from = asked;
  }
  const double wish = std::abs(asked - f.asked_from);
  if (lasts(wish >= kLeast * step && distance >= kLeast * step, f.stands)) {
    fault(
        fmt::format("{}: does not move: asked for {:.3g} rad ({:.0f} increments), moved by none "
                    "for {}; it is {}",
                    axis.name(), wish, wish / step, seconds(patience_s), text(axis.reading())));
  }
}

/// One object of one drive a second: an answer is 8 bytes that the set-points wait for.
void JointDriver::audit() {
  constexpr milliseconds kPeriod(1000);
  if (!configured_ || now_ < audit_due_) return;
  audit_due_ = now_ + kPeriod;
  audit_ = (audit_ + 1) % axes_.size();
  axes_[audit_].audit(outbox_);
}

void JointDriver::supervise() {
  for (AxisMaster& axis : axes_) supervise_axis(axis);
  if (!configured_) return;
  if (reading_.phase == Phase::following) supervise_tracking();
  const auto enabled = [](const AxisMaster& a) {
    return a.reading().drive == DriveState::operation_enabled && a.mode_shown();
  };
  if (reading_.phase == Phase::enabling && std::ranges::all_of(axes_, enabled)) {
    for (std::size_t i = 0; i < axes_.size(); ++i) posture_[i] = axes_[i].target_rad;
    limiter_.reset(posture_);
    std::ranges::fill(astray_, 0);
    for (std::size_t i = 0; i < axes_.size(); ++i)
      following_[i] = {.stood_at = axes_[i].reading().position_rad, .asked_from = posture_[i]};
    enter(Phase::following);
  }
  if (reading_.phase != Phase::fault) reset_until_ = {};  // it was for that fault
  switch (reading_.phase) {
    case Phase::stopping: {
      const auto done = [this](const AxisMaster& a) { return stopped(a); };
      const bool patient = now_ - entered_ <= kLongestStop || !stays_powered();
      if (std::ranges::all_of(axes_, done) || !patient) enter(rest());
      return;
    }
    case Phase::idle:
    case Phase::holding:
      if (rest() != reading_.phase) enter(rest());
      return;
    case Phase::fault: {
      const auto failed = [](const AxisMaster& a) { return in_fault(a.reading().drive); };
      if (reset_until_ == Time{}) return;
      const auto still = std::ranges::find_if(axes_, failed);
      if (still == axes_.end()) {
        enter(rest());
      } else if (now_ >= reset_until_) {
        reading_.reason =
            still->complaint(DriveState::switch_on_disabled) + "; it stays so after a reset";
      } else {
        return;
      }
      reset_until_ = {};
      return;
    }
    default:
      return;
  }
}

std::string JointDriver::reset_faults() {
  if (reading_.phase != Phase::fault) return "there is no fault";
  if (!configured_) return "drives are missing: " + reading_.reason;
  for (AxisMaster& axis : axes_) {
    if (axis.changed().empty()) continue;
    axis.restart();  // it is set up again, and idle then
    configured_ = false;
  }
  reset_until_ = now_ + from_seconds(options_.transition_timeout_s);
  return {};
}

bool JointDriver::stopped(const AxisMaster& axis) const {
  const DriveState state = axis.reading().drive;
  if (stays_powered() && state == DriveState::quick_stop_active) return !axis.demand_moves();
  return !powered(state);
}

Phase JointDriver::rest() const {
  const auto kept = [](const AxisMaster& a) {
    return a.reading().drive == DriveState::quick_stop_active;
  };
  return stays_powered() && std::ranges::any_of(axes_, kept) ? Phase::holding : Phase::idle;
}

/// All drives at once leave their enabled state [CiA 402, 6007h], and those that do not hear of it
/// by the deadline of their set-points, of which they get no more. Some copies, for bad wires.
void JointDriver::halt() {
  constexpr int kCopies = 3;
  for (int copy = 0; copy < kCopies; ++copy)
    options_.exclusive ? outbox_.push_back(nmt(Nmt::stop, 0)) : tell_all(Nmt::stop);
  bus_->send(outbox_);
  outbox_.clear();
}

void JointDriver::end_halt() {
  for (AxisMaster& axis : axes_) {
    const Nmt next = axis.configured() ? Nmt::start : Nmt::pre_operational;
    outbox_.push_back(nmt(next, axis.axis().node_id));
    axis.watch_from(now_);
  }
}

void JointDriver::publish() {
  for (std::size_t i = 0; i < axes_.size(); ++i) reading_.joints[i] = axes_[i].reading();
  const auto open = std::ranges::find_if(axes_, &AxisMaster::stop_open);
  if (open == axes_.end()) {
    reading_.emergency.clear();
  } else if (reading_.emergency.empty()) {
    reading_.emergency = fmt::format("{}: bit {} of its inputs (60FD:00) is open", open->name(),
                                     open->axis().stop_bit);
  }
  reading_.posture_known = reading_.posture_known || std::ranges::all_of(axes_, &AxisMaster::heard);
}

const Reading& JointDriver::read(Time now) {
  const Time pause = begun_ ? now - now_ : Time(0);
  now_ = now;
  outbox_.clear();
  if (silent_until_ == Time{}) silent_until_ = now + kListen;
  receive();
  if (!begun_ && now >= silent_until_) {
    begun_ = true;
    entered_ = heartbeat_due_ = now;
    stop();
    if (!options_.readonly) tell_all(Nmt::reset_communication);
  }
  count_answers();
  if (options_.readonly) {
    const auto fresh = [&](const AxisMaster& a) {
      return a.heard() && a.feedback_age(now_) < from_seconds(options_.feedback_timeout_s);
    };
    reading_.phase = std::ranges::all_of(axes_, fresh) ? Phase::idle : Phase::starting;
    reading_.reason = "read-only";
  } else if (now >= silent_until_ && now >= halted_until_) {
    if (std::exchange(halted_until_, {}) != Time{}) end_halt();
    // The drives have stopped by themselves, or may before a frame reaches them; what has come of
    // them is older. The next set-point would enable again those that stay powered.
    if (pause > milliseconds(kRpdoDeadlineMs * 4 / 5) &&
        (reading_.phase == Phase::following || reading_.phase == Phase::enabling)) {
      fault("no cycle for " + seconds(to_seconds(pause)));
    }
    configured_ ? supervise() : set_up();
    audit();
  }
  publish();
  return reading_;
}

void JointDriver::enable(AxisMaster& axis) {
  const DriveState state = axis.reading().drive;
  // a drive may also disable itself at rest
  const bool braking =
      state == DriveState::quick_stop_active && !(stays_powered() && stopped(axis));
  const bool held = axis.controlword == controlword::kEnableOperation;
  if (state == DriveState::fault) return axis.reset_fault(now_);
  if (state == DriveState::operation_enabled && !axis.mode_shown()) axis.ask_mode(outbox_);
  axis.controlword = braking ? controlword::kQuickStop
                             : towards_enabled(state, axis.controlword, options_.quick_stop);
  if (!held) axis.target_rad = axis.demand_rad();  // powered where it is
}

/// The position's loop of a drive that follows velocities: v = v_s + k (q_s − 2T v_s − q), since
/// what is measured is two cycles old.
double JointDriver::velocity_of(std::size_t i) const {
  constexpr double kGain = 0.1, kOld = 2.0;  // 1/cycle, cycles
  const auto k = static_cast<Eigen::Index>(i);
  const double v = limiter_.velocity()[k], most = options_.limits.v_max[k];
  const double expected = limiter_.position()[k] - kOld / options_.rate_hz * v;
  const double error = expected - axes_[i].reading().position_rad;
  return std::clamp(v + kGain * options_.rate_hz * error, -most, most);
}

void JointDriver::command_axes() {
  const bool overdue = reading_.phase == Phase::stopping && now_ - entered_ > kLongestStop;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    AxisMaster& axis = axes_[i];
    axis.target_rad_s = 0.0;
    switch (reading_.phase) {
      case Phase::enabling:
        enable(axis);
        break;
      case Phase::following:
        axis.target_rad = limiter_.position()[static_cast<Eigen::Index>(i)];
        if (axis.by_velocity()) axis.target_rad_s = velocity_of(i);
        break;
      case Phase::fault:
        if (now_ < reset_until_ && axis.reading().drive == DriveState::fault) {
          axis.reset_fault(now_);
          break;
        }
        [[fallthrough]];
      default:
        axis.controlword = overdue ? controlword::kDisableVoltage : controlword::kQuickStop;
        axis.target_rad = axis.reading().position_rad;
        break;
    }
  }
}

void JointDriver::send_setpoints() {
  for (const AxisMaster& axis : axes_) outbox_.push_back(axis.command());
  outbox_.push_back(sync());
  const std::uint64_t errors = bus_->counters().errors;
  bus_->send(outbox_);
  synced_ = bus_->counters().errors == errors;
  outbox_.clear();
}

void JointDriver::write(Time now, const Setpoint& setpoint) {
  now_ = now;
  if (options_.readonly || now < silent_until_) return;
  obey(setpoint, configured_);
  command_axes();
  if (now_ >= heartbeat_due_) {
    outbox_.push_back(heartbeat(kMasterNode, NmtState::operational));
    for (const AxisMaster& axis : axes_) axis.guard(outbox_);
    heartbeat_due_ = now_ + milliseconds(kMasterHeartbeatMs);
  }
  now < halted_until_ ? halt() : send_setpoints();
}

GroupDriver::GroupDriver(std::vector<std::unique_ptr<JointDriver>> parts)
    : parts_(std::move(parts)) {
  MIMESIS_ASSERT(!parts_.empty());
  for (const auto& part : parts_) readings_.push_back(&part->reading());
  modes_.resize(parts_.size());
  combine();
}

bool GroupDriver::any(Phase phase) const {
  return std::ranges::any_of(readings_, [&](const Reading* r) { return r->phase == phase; });
}

void GroupDriver::combine() {
  // The robot's phase is the first of these that any bus is in; it follows only if all buses
  // follow.
  constexpr std::array kWorstFirst = {Phase::fault,    Phase::starting, Phase::stopping,
                                      Phase::enabling, Phase::holding,  Phase::idle};
  const auto* worst = std::ranges::find_if(kWorstFirst, [&](Phase p) { return any(p); });
  reading_.phase = worst != kWorstFirst.end() ? *worst : Phase::following;
  if (readings_[speaker_]->phase != reading_.phase) {  // otherwise the first cause stays
    const auto is_it = [&](const Reading* r) { return r->phase == reading_.phase; };
    speaker_ = static_cast<std::size_t>(std::ranges::find_if(readings_, is_it) - readings_.begin());
  }
  reading_.reason = readings_[speaker_]->reason;
  reading_.posture_known = std::ranges::all_of(readings_, &Reading::posture_known);
  const auto open =
      std::ranges::find_if_not(readings_, [](const Reading* r) { return r->emergency.empty(); });
  reading_.emergency = open == readings_.end() ? "" : (*open)->emergency;
  std::uint64_t limited = 0;
  reading_.joints.clear();
  for (const Reading* part : readings_) {
    reading_.joints.insert(reading_.joints.end(), part->joints.begin(), part->joints.end());
    limited += part->limited;
  }
  reading_.limited += limited > limited_ ? 1 : 0;
  limited_ = limited;
}

const Reading& GroupDriver::read(Time now) {
  for (const auto& part : parts_) part->read(now);
  combine();
  return reading_;
}

Mode GroupDriver::mode_of(const Reading& part, Mode asked, bool ready) const {
  if (part.phase == Phase::fault) return asked;  // the part knows whether it was told to rest since
  if (any(Phase::fault)) return Mode::idle;
  if (asked != Mode::follow || ready) return asked;
  // A drive that is ready waits for the others; no joint starts while one cannot.
  if (part.phase == Phase::following) return Mode::hold;
  const bool incomplete = any(Phase::starting) || any(Phase::stopping);
  return part.phase != Phase::enabling && incomplete ? Mode::idle : Mode::follow;
}

void GroupDriver::write(Time now, const Setpoint& setpoint) {
  const bool ready =
      std::ranges::all_of(readings_, [](const Reading* r) { return r->phase == Phase::following; });
  // All decisions of a cycle are made before the first state changes.
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    modes_[i] = mode_of(*readings_[i], setpoint.mode, ready);
  }
  MIMESIS_ASSERT(!ready || setpoint.mode != Mode::follow ||
                 setpoint.position_rad.size() == reading_.joints.size());
  std::size_t first = 0;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const std::size_t joints = readings_[i]->joints.size();
    const auto position_rad = ready && setpoint.mode == Mode::follow
                                  ? setpoint.position_rad.subspan(first, joints)
                                  : std::span<const double>{};
    parts_[i]->write(now, {.mode = modes_[i],
                           .position_rad = position_rad,
                           .missed = setpoint.missed,
                           .brakes = setpoint.brakes});
    first += joints;
  }
  combine();
}

void GroupDriver::stop() noexcept {
  for (const auto& part : parts_) part->stop();
  // The change shows with the next read: copying a reason could throw.
}

std::string GroupDriver::reset_faults() {
  std::string why = "there is no fault";
  for (const auto& part : parts_) {
    if (part->reading().phase != Phase::fault) continue;
    why = part->reset_faults();
    if (!why.empty()) return why;
  }
  return why;
}

Traffic GroupDriver::traffic() const {
  Traffic sum;
  for (const auto& part : parts_) {
    sum.sent += part->counters().sent;
    sum.received += part->counters().received;
    sum.errors += part->counters().errors;
  }
  return sum;
}

}  // namespace mimesis::hw::cia402
