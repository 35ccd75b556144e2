#include "common/interrupt.h"

#include <utility>
#include <vector>

namespace mimesis {

struct Interrupt::State {
  std::string why;
  std::function<bool()> yes;
  std::uint64_t every;
  std::uint64_t asked = 0, told_at = kNever;
  std::string part{};  // at work, until the first yes
  std::vector<std::shared_ptr<void>> kept{};
};

Interrupt::Interrupt(std::string why, std::function<bool()> yes, std::uint64_t every)
    : state_(std::make_shared<State>(State{std::move(why), std::move(yes), every})) {}

bool Interrupt::ask() const {
  State& s = *state_;
  ++s.asked;
  if (s.told_at == kNever && s.asked % s.every == 0 && s.yes()) s.told_at = s.asked;
  return s.told_at != kNever;
}

std::uint64_t Interrupt::told_at() const { return state_ ? state_->told_at : kNever; }

std::uint64_t Interrupt::asked() const { return state_ ? state_->asked : 0; }

void Interrupt::enter(std::string_view part) const {
  if (state_ && !told()) state_->part = part;
}

void Interrupt::keep_pointer(std::shared_ptr<void> garbage) const {
  state_->kept.push_back(std::move(garbage));
}

Status Interrupt::reason() const {
  if (!state_) return {};
  return {state_->part.empty() ? state_->why : state_->why + " while " + state_->part};
}

}  // namespace mimesis
