// Against foreign Modbus programs: Debian's mbpoll as client, python3-pymodbus as server.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>

#include "hw/modbus/hand.h"
#include "hw/sim/hand/hand.h"

namespace mimesis::hw::modbus {
namespace {

using namespace std::chrono_literals;

std::string output_of(const std::string& command) {
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  std::string out;
  std::array<char, 256> buffer;
  while (fgets(buffer.data(), buffer.size(), pipe) != nullptr) out += buffer.data();
  pclose(pipe);
  return out;
}

constexpr HandOutput kPinch{.activate = true, .mode = HandMode::pinch, .go = true, .position = 99};

/// What a server says to kPinch once it listens; ended afterwards.
tl::expected<HandInput, Status> answer_of(HandClient& client, pid_t server) {
  const auto start = std::chrono::steady_clock::now();
  auto answer = client.exchange(0s, kPinch);
  while (!answer && std::chrono::steady_clock::now() - start < 20s) {
    if (waitpid(server, nullptr, WNOHANG) != 0) return tl::unexpected(Status{"the peer has ended"});
    answer = client.exchange(std::chrono::steady_clock::now() - start + 1h, kPinch);
  }
  kill(server, SIGKILL);
  waitpid(server, nullptr, 0);
  return answer;
}

TEST(Peer, MbpollReadsAndWritesTheSimulatedHand) {
  if (output_of("command -v mbpoll").empty()) GTEST_SKIP() << "mbpoll is not installed";
  const int port = 21000 + getpid() % 10'000;
  sim::HandServer server(parse_address("tcp:127.0.0.1:" + std::to_string(port), ""));
  server.exchange({.activated = true, .initialisation = Initialisation::done, .position = 0x80});
  const std::string mbpoll = "mbpoll -0 -1 -q -a 9 -p " + std::to_string(port);
  const std::string read = output_of(mbpoll + " -t 4:hex -r 2000 -c 8 127.0.0.1");
  EXPECT_NE(read.find("[2000]: \t0x31C0"), std::string::npos) << read;
  EXPECT_NE(read.find("[2002]: \t0x8000"), std::string::npos) << read;
  const std::string written =
      output_of(mbpoll + " -t 4 -r 1000 127.0.0.1 2816 200 65344 0 0 0 0 0");
  const HandOutput o = server.exchange({});
  EXPECT_TRUE(o.activate) << written;
  EXPECT_EQ(o.mode, HandMode::pinch);
  EXPECT_EQ(o.position, 200);
  EXPECT_EQ(o.force, 64);
}

constexpr const char* kPymodbusHand = R"(
import sys
from pymodbus.server import StartTcpServer
from pymodbus.datastore import ModbusSlaveContext, ModbusServerContext, ModbusSparseDataBlock
class Hand(ModbusSparseDataBlock):
    def setValues(self, address, values, use_as_default=False):
        super().setValues(address, values)
        if address == 1000:  # shows the request as reached
            super().setValues(2000, [0xF900 | values[0] & 0x0600, values[1] & 0xFF, (values[1] & 0xFF) << 8])
block = Hand({**{a: 0 for a in range(1000, 1008)}, **{a: 0 for a in range(2000, 2008)}})
context = ModbusServerContext(slaves=ModbusSlaveContext(hr=block, zero_mode=True), single=True)
StartTcpServer(context=context, address=("127.0.0.1", int(sys.argv[1])))
)";

TEST(Peer, OurClientDrivesAPymodbusHand) {
  if (system("/usr/bin/python3 -c 'import pymodbus.server' 2>/dev/null") != 0) {
    GTEST_SKIP() << "python3-pymodbus (with python3-serial-asyncio) is not installed";
  }
  const std::string port = std::to_string(31000 + getpid() % 10'000);
  const pid_t child = fork();
  if (child == 0) {
    execl("/usr/bin/python3", "python3", "-c", kPymodbusHand, port.c_str(), nullptr);
    _exit(127);
  }
  HandClient client(parse_address("tcp:127.0.0.1:" + port, ""), 500ms);
  const auto answer = answer_of(client, child);
  ASSERT_TRUE(answer.has_value()) << answer.error().reason;
  EXPECT_TRUE(answer->activated);
  EXPECT_EQ(answer->mode, HandMode::pinch);
  EXPECT_EQ(answer->requested, 99);
}

// Two pseudo terminals joined by a thread are a serial line; the second one's name goes to standard
// output.
constexpr const char* kPymodbusSerialHand = R"(
import os, pty, threading, tty
from pymodbus.server import StartSerialServer
from pymodbus.transaction import ModbusRtuFramer
from pymodbus.datastore import ModbusSlaveContext, ModbusServerContext, ModbusSequentialDataBlock
ends = [pty.openpty(), pty.openpty()]
for master, slave in ends: tty.setraw(master); tty.setraw(slave)
def copy(a, b):
    while True: os.write(b, os.read(a, 1000))
for a, b in ((0, 1), (1, 0)): threading.Thread(target=copy, args=(ends[a][0], ends[b][0]), daemon=True).start()
print(os.ttyname(ends[1][1]), flush=True)
block = ModbusSequentialDataBlock(1000, [0] * 1008)
block.setValues(2000, [0xF900, 77, 77 << 8])
context = ModbusServerContext(slaves={9: ModbusSlaveContext(hr=block, zero_mode=True)}, single=False)
StartSerialServer(context=context, framer=ModbusRtuFramer, port=os.ttyname(ends[0][1]), baudrate=115200)
)";

TEST(Peer, OurClientDrivesAPymodbusHandOnASerialLine) {
  if (system("/usr/bin/python3 -c 'import pymodbus.server, serial' 2>/dev/null") != 0) {
    GTEST_SKIP() << "python3-pymodbus (with python3-serial-asyncio) is not installed";
  }
  int names[2];
  ASSERT_EQ(pipe(names), 0);
  const pid_t child = fork();
  if (child == 0) {
    dup2(names[1], 1);
    execl("/usr/bin/python3", "python3", "-c", kPymodbusSerialHand, nullptr);
    _exit(127);
  }
  close(names[1]);
  std::string device;
  for (char c; read(names[0], &c, 1) == 1 && c != '\n';) device += c;
  HandClient client(parse_address("rtu:" + device, ""), 500ms);
  const auto answer = answer_of(client, child);
  close(names[0]);
  ASSERT_TRUE(answer.has_value()) << answer.error().reason;
  EXPECT_EQ(answer->requested, 77);
  const auto gone = client.exchange(2h, kPinch);
  EXPECT_FALSE(gone.has_value()) << "the line is dead";
}

}  // namespace
}  // namespace mimesis::hw::modbus
