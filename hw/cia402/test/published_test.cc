// The frames of published examples, byte for byte: CANopenNode, ros2_canopen and libepos give the
// command bytes, codes and words.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "hw/can/testing/memory_wire.h"
#include "hw/cia402/canopen.h"
#include "hw/cia402/cia402.h"
#include "hw/cia402/setup.h"

namespace mimesis::hw::cia402 {
namespace {

using can::frame;

TEST(Published, NetworkManagement) {
  const std::pair<Nmt, const char*> commands[] = {{Nmt::start, "000#0105"},
                                                  {Nmt::stop, "000#0205"},
                                                  {Nmt::pre_operational, "000#8005"},
                                                  {Nmt::reset_node, "000#8105"},
                                                  {Nmt::reset_communication, "000#8205"}};
  for (const auto& [command, bytes] : commands) EXPECT_EQ(frame_text(nmt(command, 5)), bytes);
  EXPECT_EQ(frame_text(sync()), "080#");
  EXPECT_EQ(frame_text(heartbeat(5, NmtState::boot_up)), "705#00");
  EXPECT_EQ(frame_text(heartbeat(5, NmtState::stopped)), "705#04");
  EXPECT_EQ(frame_text(heartbeat(5, NmtState::operational)), "705#05");
  EXPECT_EQ(frame_text(heartbeat(5, NmtState::pre_operational)), "705#7F");
}

TEST(Published, Emergencies) {
  for (const auto& [code, words] : {std::pair<int, const char*>{0x8110, "CAN overrun (0x8110)"},
                                    {0x8120, "CAN error passive (0x8120)"},
                                    {0x8130, "heartbeat of the master lost (0x8130)"},
                                    {0x8140, "recovered from bus-off (0x8140)"},
                                    {0x8210, "PDO of wrong length (0x8210)"},
                                    {0x8250, "RPDO timed out (0x8250)"},
                                    {0x8611, "following error (0x8611)"}}) {
    EXPECT_EQ(emergency_text(static_cast<std::uint16_t>(code)), words);
  }
  EXPECT_EQ(frame_text(emergency(5, 0x8611, 0x21)), "085#1186210000000000");
}

TEST(Published, ExpeditedTransfers) {
  const char* const downloads[] = {"605#2F60600008000000", "605#2B17106408030000",
                                   "605#2760600008030100", "605#2300140105020080"};
  EXPECT_EQ(frame_text(sdo_download(5, {0x6060, 0}, 8, 1)), downloads[0]);
  EXPECT_EQ(frame_text(sdo_download(5, {0x1017, 0x64}, 0x0308, 2)), downloads[1]);
  EXPECT_EQ(frame_text(sdo_download(5, {0x6060, 0}, 0x010308, 3)), downloads[2]);
  EXPECT_EQ(frame_text(sdo_download(5, {0x1400, 1}, 0x80000205, 4)), downloads[3]);
  for (const auto& [answer, bytes] :
       {std::pair<const char*, std::size_t>{"585#4F61600008000000", 1},
        {"585#4B41603702000000", 2},
        {"585#4764600001020300", 3},
        {"585#4364600001020304", 4}}) {
    const can::Frame f = frame(answer);
    SdoTransfer transfer = SdoTransfer::upload(5, parse_sdo_response(f).object);
    EXPECT_EQ(frame_text(transfer.first()).substr(0, 6), "605#40");
    EXPECT_EQ(transfer.handle(f), std::nullopt);
    EXPECT_TRUE(transfer.done());
    EXPECT_EQ(transfer.data().size(), bytes);
  }
  EXPECT_EQ(parse_sdo_response(frame("585#60606000")).kind, Sdo::Kind::unsupported) << "too short";
  EXPECT_EQ(parse_sdo_response(frame("585#6060600000000000")).kind, Sdo::Kind::downloaded);
}

/// A name of 11 bytes: announced by 41h, asked for by 60h and 70h in turn, the last bit ends it.
TEST(Published, AnUploadInSegments) {
  SdoTransfer transfer = SdoTransfer::upload(5, {0x1008, 0});
  EXPECT_EQ(frame_text(transfer.first()), "605#4008100000000000");
  EXPECT_EQ(frame_text(*transfer.handle(frame("585#410810000B000000"))), "605#6000000000000000");
  EXPECT_EQ(transfer.handle(frame("586#00536572766F2064")), std::nullopt) << "of another node";
  EXPECT_EQ(frame_text(*transfer.handle(frame("585#00536572766F2064"))), "605#7000000000000000");
  EXPECT_EQ(transfer.handle(frame("585#1772697665000000")), std::nullopt);
  EXPECT_TRUE(transfer.done());
  EXPECT_EQ(transfer.failure(), "");
  EXPECT_EQ(std::string(transfer.data().begin(), transfer.data().end()), "Servo drive");
}

TEST(Published, ADownloadInSegments) {
  SdoTransfer transfer =
      SdoTransfer::download(5, {0x2000, 0}, {'a', 'b', 'c', 'd', 'e', 'f', 'g', 'h', 'i'});
  EXPECT_EQ(frame_text(transfer.first()), "605#2100200009000000");
  EXPECT_EQ(frame_text(*transfer.handle(frame("585#6000200000000000"))), "605#0061626364656667");
  EXPECT_EQ(frame_text(*transfer.handle(frame("585#2000000000000000"))), "605#1B68690000000000");
  EXPECT_EQ(transfer.handle(frame("585#3000000000000000")), std::nullopt);
  EXPECT_TRUE(transfer.done());
  EXPECT_EQ(transfer.failure(), "");
}

TEST(Published, TransfersThatFail) {
  const auto failure = [](const std::vector<std::string>& answers) {
    SdoTransfer transfer = SdoTransfer::upload(5, {0x1008, 0});
    std::string last;
    for (const std::string& answer : answers) {
      const auto next = transfer.handle(frame(answer));
      last = next ? frame_text(*next) : "";
    }
    EXPECT_TRUE(transfer.done());
    return transfer.failure() + (last.empty() ? "" : " " + last);
  };
  EXPECT_EQ(failure({"585#8008100000000206"}), "object does not exist (0x06020000)");
  EXPECT_EQ(failure({"585#8008100000000405"}), "SDO protocol timed out (0x05040000)");
  EXPECT_EQ(failure({"585#410810000B000000", "585#10536572766F2064"}),
            "toggle bit not alternated (0x05030000) 605#8008100000000305");
  EXPECT_EQ(failure({"585#410810000B000000", "585#01536572766F2064"}),
            "11 bytes announced, 7 sent");
  EXPECT_EQ(failure({"585#6008100000000000"}), "answer 0x60 to an upload 605#8008100001000405");
  EXPECT_EQ(failure({"585#41081000FFFFFFFF"}),
            "an object of 4294967295 bytes 605#8008100005000405");
}

TEST(Published, StatesAndCommandsOfADrive) {
  const std::pair<int, DriveState> words[] = {
      {0x0000, DriveState::not_ready_to_switch_on}, {0x0240, DriveState::switch_on_disabled},
      {0x0221, DriveState::ready_to_switch_on},     {0x0223, DriveState::switched_on},
      {0x1637, DriveState::operation_enabled},      {0x0207, DriveState::quick_stop_active},
      {0x020F, DriveState::fault_reaction_active},  {0x0238, DriveState::fault}};
  for (const auto& [word, state] : words)
    EXPECT_EQ(decode_statusword(static_cast<std::uint16_t>(word)), state) << std::hex << word;
  EXPECT_EQ(controlword::kShutdown, 0x06);
  EXPECT_EQ(controlword::kSwitchOn, 0x07);
  EXPECT_EQ(controlword::kEnableOperation, 0x0F);
  EXPECT_EQ(controlword::kFaultReset, 0x80);
}

/// PDO mapping: off, count 0, objects, count, on.
TEST(Published, TheOrderOfAMapping) {
  std::string order;
  for (const SetupStep& s :
       setup_steps({.node_id = 5}, {.q_min = -1, .q_max = 1, .v_max = 1, .a_max = 1}, {5, -3})) {
    if (s.object.index == 0x1400 || s.object.index == 0x1600)
      order += text(s.object) + "=" + fmt::format("{:X} ", s.value);
  }
  EXPECT_EQ(order,
            "1400:01=80000205 1600:00=0 1600:01=60400010 1600:02=607A0020 1600:00=2 1400:02=1 "
            "1400:01=205 1400:05=64 ");
}

}  // namespace
}  // namespace mimesis::hw::cia402
