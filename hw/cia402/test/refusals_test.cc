// Drives that refuse an object: each is handled by what it says.
#include <gtest/gtest.h>

#include "hw/can/testing/memory_wire.h"
#include "hw/cia402/joint_driver.h"
#include "hw/cia402/setup.h"
#include "hw/sim/cia402/drive.h"

namespace mimesis::hw::cia402 {
namespace {

using namespace std::chrono_literals;

class Stubborn : public ::testing::Test {
 protected:
  /// Phase after set-up and 0.2 s of following to 0.1 rad.
  Phase run(const sim::DriveConfig& drive, JointDriverOptions options = {}) {
    const auto one = [](double x) { return Eigen::VectorXd::Constant(1, x); };
    options.axes = {drive.axis};
    options.limits = {.q_min = one(-1), .q_max = one(1), .v_max = one(1), .a_max = one(5)};
    driver.reset();
    rack.emplace(std::vector{drive}, wire.join());
    driver.emplace(options, wire.join());
    return follow(0.0, 1s, Mode::idle) == Phase::idle ? follow(0.1, 500ms)
                                                      : driver->reading().phase;
  }
  Phase follow(double target, Time duration, Mode mode = Mode::follow) {
    for (const Time end = now + duration; now < end; now += 5ms) {
      const std::array q{target};
      driver->read(now);
      driver->write(now, {.mode = mode, .position_rad = q});
      rack->step(now + 2500us);
    }
    return driver->reading().phase;
  }
  std::string reason() const { return driver->reading().reason; }
  sim::Drive& drive() { return rack->drives()[0]; }

  can::MemoryWire wire;
  std::optional<sim::Rack> rack;
  std::optional<JointDriver> driver;
  Time now = 1s;
  sim::DriveConfig config{.axis = {.node_id = 3}};
};

TEST_F(Stubborn, ObjectsThatMayBeMissing) {
  config.lacks = {0x1400'05, 0x6502'00, 0x607F'00, 0x607D'01, 0x607D'02, 0x6085'00, 0x1029'01};
  EXPECT_EQ(run(config), Phase::following) << reason();
  EXPECT_NEAR(drive().position_rad(), 0.1, 1e-3);
  EXPECT_EQ(driver->notes(),
            (std::vector<std::string>{
                "A1 (node 3): SDO 607F:00 (the robot's velocity limit): object does not exist "
                "(0x06020000); how fast it can turn is not known",
                "A1 (node 3): SDO 607D:01 (position limit): sub-index does not exist (0x06090011); "
                "the bridge alone keeps the position limits",
                "A1 (node 3): SDO 607D:02 (position limit): sub-index does not exist (0x06090011); "
                "the bridge alone keeps the position limits",
                "A1 (node 3): SDO 6085:00 (deceleration): object does not exist (0x06020000); its "
                "quick stop has a deceleration of its own",
                "A1 (node 3): SDO 1400:05 (watch over our set-points): sub-index does not exist "
                "(0x06090011); it stops 250 ms after our last heartbeat, not 100 ms after the last "
                "set-point"}));
  driver.reset();  // and so it does
  for (const Time end = now + 300ms; now < end; now += 5ms) rack->step(now);
  EXPECT_NE(drive().state(), DriveState::operation_enabled);
}

TEST_F(Stubborn, ObjectsThatMayNot) {
  const std::pair<sim::Address, const char*> needed[] = {
      {0x1016'01, "1016:01 (watch over our heartbeat): sub-index does not exist (0x06090011)"},
      {0x6007'00,
       "6007:00 (quick stop when the connection is lost): object does not exist (0x06020000)"},
      {0x605A'00, "605A:00 (quick stop by ramp, then disable): object does not exist (0x06020000)"},
      {0x60C2'01, "60C2:01 (interpolation period): sub-index does not exist (0x06090011)"}};
  for (const auto& [object, words] : needed) {
    config.lacks = {object};
    EXPECT_EQ(run(config), Phase::fault);
    EXPECT_TRUE(reason().starts_with(std::string("A1 (node 3): SDO ") + words)) << reason();
    EXPECT_NE(reason().find("; `accept: [" + lack_of({static_cast<std::uint16_t>(object >> 8), 0}) +
                            "]` of its axis uses it without: "),
              std::string::npos)
        << reason();
  }
}

/// What the user accepts is said with what is lost by it; not all at once.
TEST_F(Stubborn, ObjectsThatItsUserAccepts) {
  config.lacks = {0x1017'00, 0x6007'00, 0x60C2'01, 0x60C2'02};
  config.axis.accept = {"no_1017", "no_6007", "no_60C2"};
  EXPECT_EQ(run(config), Phase::following) << reason();
  EXPECT_NEAR(drive().position_rad(), 0.1, 1e-3);
  ASSERT_EQ(driver->notes().size(), 4u);
  EXPECT_EQ(driver->notes()[0],
            "A1 (node 3): SDO 6007:00 (quick stop when the connection is lost): object does not "
            "exist (0x06020000); what it does when the connection is lost is its maker's choice");
  config.lacks = {0x1016'01, 0x1016'02, 0x1400'05};
  config.axis.accept = {"no_1016"};
  EXPECT_EQ(run(config), Phase::fault);
  EXPECT_EQ(reason(),
            "A1 (node 3): nothing stops it when the bridge is lost: it lacks 1016:01 and 1400:05");
  config.lacks = {0x1016'01, 0x1016'02};
  EXPECT_EQ(run(config), Phase::following) << reason();
  driver.reset();  // its set-points end
  for (const Time end = now + 150ms; now < end; now += 5ms) rack->step(now);
  EXPECT_NE(drive().state(), DriveState::operation_enabled);
}

/// An object that cannot be written may already have the wanted value.
TEST_F(Stubborn, ReadOnlyObjectsAreRead) {
  config.fixed = {0x605A'00, 0x1029'01};  // 605Ah: 2, as wanted
  EXPECT_EQ(run(config), Phase::following) << reason();
  EXPECT_TRUE(driver->notes().empty());
  config.fixed = {0x6007'00};
  EXPECT_EQ(run(config), Phase::fault);
  EXPECT_EQ(
      reason(),
      "A1 (node 3): SDO 6007:00 (quick stop when the connection is lost): object is "
      "read-only (0x06010002): expected 0x0003, is 0x0001; `accept: [no_6007]` of its axis uses "
      "it without: what it does when the connection is lost is its maker's choice");
}

/// A drive that would go on without its master is not enabled.
TEST_F(Stubborn, ItsWatchOverOurHeartbeatIsSetAndReadBack) {
  EXPECT_EQ(run(config), Phase::following) << reason();
  EXPECT_EQ(drive().objects().value(0x1016'01), 0x7F00FA) << "node 127, 250 ms";
  config.fixed = {0x1016'01};
  EXPECT_EQ(run(config), Phase::fault);
  EXPECT_EQ(reason(),
            "A1 (node 3): SDO 1016:01 (watch over our heartbeat): object is read-only "
            "(0x06010002): expected 0x7F00FA, is 0x0000; `guarding: true` of its axis uses node "
            "guarding (100Ch) instead; `accept: [no_1016]` of its axis uses it "
            "without: it does not notice the end of our heartbeat, only that of the set-points");
}

/// Its maker's PDOs: mode and controlword and target together; position before status.
TEST_F(Stubborn, PdosThatCannotBeMapped) {
  const auto fix = [&](std::uint16_t index) {
    for (unsigned sub = 0; sub <= 8; ++sub) config.fixed.push_back(std::uint32_t{index} << 8 | sub);
  };
  fix(0x1600);
  fix(0x1A00);
  config.made = {{0x1600'00, 3},          {0x1600'01, 0x60600008}, {0x1600'02, 0x60400010},
                 {0x1600'03, 0x607A0020}, {0x1A00'00, 2},          {0x1A00'01, 0x60640020},
                 {0x1A00'02, 0x60410010}};
  EXPECT_EQ(run(config), Phase::following) << reason();
  EXPECT_NEAR(drive().position_rad(), 0.1, 1e-3);
  EXPECT_NEAR(driver->reading().joints[0].position_rad, 0.1, 1e-3);
  ASSERT_EQ(driver->notes().size(), 2u);
  EXPECT_EQ(driver->notes()[0],
            "A1 (node 3): SDO 1600:00 (PDO mapping): object is read-only (0x06010002); its own "
            "mapping is used");
  config.made[0x1600'03] = 0x60FF0020;
  EXPECT_EQ(run(config), Phase::fault);
  EXPECT_EQ(reason(), "A1 (node 3): RPDO1 carries 60FF:00, which the bridge cannot give");
  config.made[0x1600'00] = 2;
  EXPECT_EQ(run(config), Phase::fault);
  EXPECT_EQ(reason(), "A1 (node 3): 607A:00 is not in RPDO1");
  config.made[0x1600'00] = 4;
  config.made[0x1600'04] = 0x607A0020;
  EXPECT_EQ(run(config), Phase::fault);
  EXPECT_EQ(reason(), "A1 (node 3): SDO 1600:04 (PDO mapping): it carries more than 8 bytes");
}

/// Without velocity in a PDO it is that of the positions.
TEST_F(Stubborn, VelocityFromPositions) {
  for (unsigned sub = 0; sub <= 8; ++sub) config.fixed.push_back(0x1A01'00 + sub);
  EXPECT_EQ(run(config), Phase::following) << reason();
  follow(0.5, 250ms);
  EXPECT_NEAR(driver->reading().joints[0].velocity_rad_s, drive().velocity_rad_s(), 0.05);
  EXPECT_GT(driver->reading().joints[0].velocity_rad_s, 0.3);
}

TEST_F(Stubborn, FollowingErrorIsSetAndReadBack) {
  EXPECT_EQ(run(config, {.following_window_rad = 0.02, .following_time_s = 0.03}),
            Phase::following);
  EXPECT_EQ(drive().objects().value(0x6065'00), 3200);
  EXPECT_EQ(drive().objects().value(0x6066'00), 30);
  config.fixed = {0x6065'00};
  EXPECT_EQ(run(config, {.following_window_rad = 0.02}), Phase::fault);
  EXPECT_EQ(reason(),
            "A1 (node 3): SDO 6065:00 (largest following error): object is read-only (0x06010002): "
            "expected 0x0C80, is 0x1F40");
}

/// Where the drive counts 0 need not be where the model does; signs and offset meet twice.
TEST_F(Stubborn, OffsetAndSign) {
  config.axis.sign = -1;
  config.axis.offset_rad = 0.3;
  config.home_rad = 0.05;
  EXPECT_EQ(run(config), Phase::following) << reason();
  EXPECT_NEAR(drive().position_rad(), 0.1, 1e-3);
  EXPECT_NEAR(static_cast<double>(drive().objects().value(0x6064'00)), -160'000.0 * (0.1 - 0.3),
              20);
  EXPECT_EQ(drive().objects().value(0x607D'01), -160'000 * 0.7) << "position limits follow";
}

}  // namespace
}  // namespace mimesis::hw::cia402
