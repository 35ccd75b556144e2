#pragma once
#include <gtest/gtest.h>

#include "hw/cia402/cia402.h"
#include "hw/sim/cia402/drive.h"

namespace mimesis::hw::sim {

using namespace std::chrono_literals;
namespace obj = cia402::object;

/// One drive, spoken to frame by frame.
class OneDrive : public ::testing::Test {
 protected:
  explicit OneDrive(const DriveConfig& config = {.axis = {.node_id = 4}, .home_rad = 0.25})
      : drive(config) {
    drive.advance(now, out);
  }

  cia402::Sdo ask(const can::Frame& request) {
    out.clear();
    drive.handle(request, out);
    return out.empty() ? cia402::Sdo{} : cia402::parse_sdo_response(out.back());
  }
  std::uint32_t abort_of(const can::Frame& request) {
    const cia402::Sdo s = ask(request);
    return s.kind == cia402::Sdo::Kind::abort ? s.value : 0;
  }
  void set(cia402::Object object, std::uint32_t value, int bytes) {
    ASSERT_EQ(abort_of(cia402::sdo_download(4, object, value, bytes)), 0u);
  }
  void aim(double rad) {
    set(obj::kTarget, static_cast<std::uint32_t>(cia402::Axis{}.to_increments(rad)), 4);
  }
  void pass(Time duration) {
    for (const Time end = now + duration; now < end;) drive.advance(now += 1ms, out);
  }
  /// RPDO of the default mapping: controlword alone.
  void hear(std::uint16_t word) {
    can::Frame f = cia402::rpdo(1, 4);
    cia402::append(f, word, 2);
    drive.handle(f, out);
  }
  void sync() { drive.handle(cia402::sync(), out); }
  void command(std::uint16_t word) {
    hear(word);
    sync();
  }
  void tell(cia402::Nmt what) { drive.handle(cia402::nmt(what, 4), out); }
  void enable() {
    tell(cia402::Nmt::start);
    for (const int word : {0x06, 0x07, 0x0F}) command(static_cast<std::uint16_t>(word));
    ASSERT_EQ(drive.state(), DriveState::operation_enabled);
  }

  Drive drive;
  Time now = 1s;
  std::vector<can::Frame> out;
};

}  // namespace mimesis::hw::sim
