#include "hw/sim/cia402/rack.h"

#include <algorithm>

namespace mimesis::hw::sim {
namespace {

using can::Frame;

// A bus keeps no more frames for a process that waits; beyond, the drives' watchdogs decide.
constexpr std::chrono::milliseconds kLongestWait(50);

}  // namespace

Rack::Rack(const std::vector<DriveConfig>& configs, std::unique_ptr<can::Bus> bus)
    : bus_(std::move(bus)) {
  for (const DriveConfig& config : configs) drives_.emplace_back(config);
}

void Rack::move(Time now) {
  for (Drive& drive : drives_) drive.move(now, outbox_);
}

/// Frames that have arrived, at most so many: the rest of a flood waits for the next step.
void Rack::receive() {
  constexpr std::size_t kAtOnce = 256, kMost = 16 * kAtOnce;
  std::size_t count = kAtOnce, filled = 0;
  for (; count == kAtOnce && filled < kMost; filled += count) {
    inbox_.resize(filled + kAtOnce);
    count = bus_->receive(std::span(inbox_).subspan(filled));
  }
  inbox_.resize(filled);
}

void Rack::answer(std::span<const Frame> frames) {
  for (Drive& drive : drives_) drive.watch(outbox_);
  for (const Frame& frame : frames) {
    for (Drive& drive : drives_) drive.handle(frame, outbox_);
  }
}

void Rack::answer() {
  receive();
  answer(inbox_);
  if (!outbox_.empty()) bus_->send(outbox_);
  outbox_.clear();
}

void Rack::step(Time now) {
  receive();
  const auto is_sync = [](const Frame& frame) { return frame.id == 0x080; };
  const Time passed = std::max(now - stepped_.value_or(now), Time(0));
  stepped_ = now;
  const bool brief = passed <= kLongestWait;
  const auto parts =
      brief ? std::max(std::ranges::count_if(inbox_, is_sync), std::ptrdiff_t{1}) : 1;
  auto begin = inbox_.begin();
  for (auto left = parts; left-- > 0;) {
    auto end = left == 0 ? inbox_.end() : std::next(std::find_if(begin, inbox_.end(), is_sync));
    move(now - passed * left / parts);
    answer({begin, end});
    begin = end;
  }
  if (!outbox_.empty()) bus_->send(outbox_);
  outbox_.clear();
}

}  // namespace mimesis::hw::sim
