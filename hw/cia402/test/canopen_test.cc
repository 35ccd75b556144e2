#include "hw/cia402/canopen.h"

#include <gtest/gtest.h>

namespace mimesis::hw::cia402 {
namespace {

using Bytes = std::vector<int>;

Bytes bytes(const can::Frame& f) { return Bytes(f.data.begin(), f.data.begin() + f.length); }

TEST(Canopen, NetworkManagement) {
  EXPECT_EQ(nmt(Nmt::start, 0).id, 0x000u);
  EXPECT_EQ(bytes(nmt(Nmt::start, 0)), (Bytes{1, 0}));
  EXPECT_EQ(bytes(nmt(Nmt::stop, 3)), (Bytes{2, 3}));
  EXPECT_EQ(bytes(nmt(Nmt::pre_operational, 5)), (Bytes{0x80, 5}));
  EXPECT_EQ(bytes(nmt(Nmt::reset_communication, 0)), (Bytes{0x82, 0}));
  EXPECT_EQ(sync().id, 0x080u);
  EXPECT_EQ(bytes(sync()), Bytes{});
  EXPECT_EQ(heartbeat(127, NmtState::operational).id, 0x77Fu);
  EXPECT_EQ(bytes(heartbeat(127, NmtState::operational)), Bytes{5});
}

TEST(Canopen, Emergency) {
  const can::Frame f = emergency(4, 0x8130, 0x11);
  EXPECT_EQ(f.id, 0x084u);
  EXPECT_EQ(bytes(f), (Bytes{0x30, 0x81, 0x11, 0, 0, 0, 0, 0}));
  EXPECT_EQ(emergency_text(0x8611), "following error (0x8611)");
  EXPECT_EQ(emergency_text(0xFF01), "0xFF01");
}

TEST(Canopen, SdoDownloadOfEachSize) {
  EXPECT_EQ(sdo_download(1, {0x6060, 0}, 8, 1).id, 0x601u);
  EXPECT_EQ(bytes(sdo_download(1, {0x6060, 0}, 8, 1)), (Bytes{0x2F, 0x60, 0x60, 0, 8, 0, 0, 0}));
  EXPECT_EQ(bytes(sdo_download(1, {0x1017, 0}, 100, 2)),
            (Bytes{0x2B, 0x17, 0x10, 0, 100, 0, 0, 0}));
  EXPECT_EQ(bytes(sdo_download(1, {0x1016, 1}, 0x7F00FA, 4)),
            (Bytes{0x23, 0x16, 0x10, 1, 0xFA, 0x00, 0x7F, 0}));
}

can::Frame response(Bytes data) {
  can::Frame f{.id = 0x589, .length = 8};
  std::copy(data.begin(), data.end(), f.data.begin());
  return f;
}

TEST(Canopen, SdoResponses) {
  EXPECT_EQ(bytes(sdo_upload(2, {0x1000, 0})), (Bytes{0x40, 0, 0x10, 0, 0, 0, 0, 0}));
  const Sdo up = parse_sdo_response(response({0x4B, 0x41, 0x60, 0, 0x37, 0x02, 0xFF, 0xFF}));
  EXPECT_EQ(up.kind, Sdo::Kind::uploaded);
  EXPECT_EQ(up.object, (Object{0x6041, 0}));
  EXPECT_EQ(up.value, 0x0237u);
  EXPECT_EQ(up.bytes, 2);
  EXPECT_EQ(parse_sdo_response(response({0x43, 0, 0x10, 0, 0x92, 1, 2, 0})).value, 0x00020192u);
  EXPECT_EQ(parse_sdo_response(response({0x60, 0x40, 0x60, 0, 0, 0, 0, 0})).kind,
            Sdo::Kind::downloaded);
  const Sdo abort = parse_sdo_response(sdo_abort(9, {0x2000, 0}, 0x06020000));
  EXPECT_EQ(abort.kind, Sdo::Kind::abort);
  EXPECT_EQ(abort_text(abort.value), "object does not exist (0x06020000)");
}

TEST(Canopen, SdoThatIsShortOrSegmentedIsNotSupported) {
  can::Frame f = response({0x43, 0, 0x10, 0, 0x92, 1, 2, 0});
  f.length = 7;
  EXPECT_EQ(parse_sdo_response(f).kind, Sdo::Kind::unsupported);
  f = response({0x41, 0x08, 0x10, 0, 12, 0, 0, 0});  // 12 bytes will follow in segments
  EXPECT_EQ(parse_sdo_response(f).kind, Sdo::Kind::unsupported);
}

TEST(Canopen, NumbersInPdos) {
  can::Frame f = rpdo(1, 3);
  append(f, 0x0F, 2);
  append(f, static_cast<std::uint32_t>(-2), 4);
  EXPECT_EQ(f.id, 0x203u);
  EXPECT_EQ(bytes(f), (Bytes{0x0F, 0, 0xFE, 0xFF, 0xFF, 0xFF}));
  EXPECT_EQ(signed_at(f, 2, 4), -2);
  EXPECT_EQ(signed_at(f, 4, 2), -1);
  EXPECT_EQ(unsigned_at(f, 4, 2), 0xFFFFu);
  EXPECT_EQ(unsigned_at(f, 4, 4), std::nullopt);
}

TEST(Canopen, EveryIdentifierHasItsMeaning) {
  using Kind = Identity::Kind;
  const auto is = [](std::uint32_t id, Kind kind, int node, int n = 0) {
    const Identity i = identify(can::Frame{.id = id});
    EXPECT_EQ(i.kind, kind) << std::hex << id;
    EXPECT_EQ(i.node, node) << std::hex << id;
    EXPECT_EQ(i.n, n) << std::hex << id;
  };
  is(0x000, Kind::nmt, 0);
  is(0x080, Kind::sync, 0);
  is(0x081, Kind::emergency, 1);
  is(0x187, Kind::tpdo, 7, 1);
  is(0x207, Kind::rpdo, 7, 1);
  is(0x287, Kind::tpdo, 7, 2);
  is(0x307, Kind::rpdo, 7, 2);
  is(0x4FF, Kind::tpdo, 127, 4);
  is(0x57F, Kind::rpdo, 127, 4);
  is(0x581, Kind::sdo_response, 1);
  is(0x601, Kind::sdo_request, 1);
  is(0x77F, Kind::heartbeat, 127);
  is(0x180, Kind::other, 0);
  is(0x80000081, Kind::other, 0);
  is(can::kErrorFlag | can::kBusOff, Kind::other, 0);
}

}  // namespace
}  // namespace mimesis::hw::cia402
