#include "hw/arm/group_driver.h"

#include <algorithm>
#include <array>
#include <utility>

#include "common/error.h"

namespace mimesis::hw::arm {

GroupDriver::GroupDriver(std::vector<std::unique_ptr<ArmDriver>> parts) : parts_(std::move(parts)) {
  MIMESIS_ASSERT(!parts_.empty());
  for (const auto& part : parts_) readings_.push_back(&part->reading());
  modes_.resize(parts_.size());
  combine();
}

bool GroupDriver::any(Phase phase) const {
  return std::ranges::any_of(readings_, [&](const Reading* r) { return r->phase == phase; });
}

void GroupDriver::combine() {
  // The first of these that a bus is in is what the robot is in. Followed is only what all follow.
  constexpr std::array kWorstFirst = {Phase::fault,    Phase::starting, Phase::stopping,
                                      Phase::enabling, Phase::holding,  Phase::idle};
  const auto* worst = std::ranges::find_if(kWorstFirst, [&](Phase p) { return any(p); });
  reading_.phase = worst != kWorstFirst.end() ? *worst : Phase::following;
  if (readings_[speaker_]->phase != reading_.phase) {  // else: the first cause goes on to count
    const auto is_it = [&](const Reading* r) { return r->phase == reading_.phase; };
    speaker_ = static_cast<std::size_t>(std::ranges::find_if(readings_, is_it) - readings_.begin());
  }
  reading_.reason = readings_[speaker_]->reason;
  reading_.posture_known = std::ranges::all_of(readings_, &Reading::posture_known);
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
  if (part.phase != Phase::fault && any(Phase::fault)) return Mode::idle;
  if (asked != Mode::follow || ready) return asked;
  // Who is there already waits for the others; nobody sets out while one of them cannot.
  if (part.phase == Phase::following) return Mode::hold;
  const bool incomplete = any(Phase::starting) || any(Phase::stopping);
  return part.phase != Phase::enabling && incomplete ? Mode::idle : Mode::follow;
}

void GroupDriver::write(Time now, const Setpoint& setpoint) {
  const bool ready =
      std::ranges::all_of(readings_, [](const Reading* r) { return r->phase == Phase::following; });
  // Decided for all before any of them changes.
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
    parts_[i]->write(now, {.mode = modes_[i], .position_rad = position_rad});
    first += joints;
  }
  combine();
}

void GroupDriver::stop() noexcept {
  for (const auto& part : parts_) part->stop();
  // What changed shows with the next read: to copy a reason could throw.
}

can::Counters GroupDriver::counters() const {
  can::Counters sum;
  for (const auto& part : parts_) {
    sum.sent += part->counters().sent;
    sum.received += part->counters().received;
    sum.errors += part->counters().errors;
  }
  return sum;
}

}  // namespace mimesis::hw::arm
