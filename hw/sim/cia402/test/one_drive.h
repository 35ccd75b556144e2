#pragma once
#include <gtest/gtest.h>

#include "hw/sim/cia402/drive.h"

namespace mimesis::hw::sim {

using namespace std::chrono_literals;
namespace obj = arm::object;

/// One drive, spoken to frame by frame.
class OneDrive : public ::testing::Test {
 protected:
  explicit OneDrive(const DriveConfig& config = {.axis = {.node_id = 4}, .home_rad = 0.25})
      : drive(config) {
    drive.advance(now, out);
  }

  arm::Sdo ask(const can::Frame& request) {
    out.clear();
    drive.handle(request, now, out);
    return out.empty() ? arm::Sdo{} : arm::parse_sdo_response(out.back());
  }
  std::uint32_t abort_of(const can::Frame& request) {
    const arm::Sdo s = ask(request);
    return s.kind == arm::Sdo::Kind::abort ? s.value : 0;
  }
  void set(arm::Object object, std::uint32_t value, int bytes) {
    ASSERT_EQ(abort_of(arm::sdo_download(4, object, value, bytes)), 0u);
  }
  void aim(double rad) {
    set(obj::kTarget, static_cast<std::uint32_t>(arm::Axis{}.to_increments(rad)), 4);
  }
  void pass(Time duration) {
    for (const Time end = now + duration; now < end;) drive.advance(now += 1ms, out);
  }
  /// RPDO of the default mapping: controlword alone.
  void hear(std::uint16_t word) {
    can::Frame f = arm::rpdo(1, 4);
    arm::append(f, word, 2);
    drive.handle(f, now, out);
  }
  void sync() { drive.handle(arm::sync(), now, out); }
  void command(std::uint16_t word) {
    hear(word);
    sync();
  }
  void tell(arm::Nmt what) { drive.handle(arm::nmt(what, 4), now, out); }
  void enable() {
    tell(arm::Nmt::start);
    for (const int word : {0x06, 0x07, 0x0F}) command(static_cast<std::uint16_t>(word));
    ASSERT_EQ(drive.state(), DriveState::operation_enabled);
  }

  Drive drive;
  Time now = 1s;
  std::vector<can::Frame> out;
};

}  // namespace mimesis::hw::sim
