// Against foreign Modbus programs: Debian's mbpoll as client, python3-pymodbus as server.
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <optional>

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

const HandProfile k3f = load_hand_profile("hands/robotiq_3f.yaml");
constexpr HandSetpoint kPinch{.move = true, .mode = HandMode::pinch, .closure = 0.4, .force = 0.0};

/// What a server says to kPinch once it listens; ended afterwards.
tl::expected<HandReading, Status> answer_of(HandClient& client, pid_t server) {
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

/// Two serial devices of this machine whose lines are joined, by a process of its own.
class SerialLine {
 public:
  SerialLine() {
    for (int i = 0; i < 2; ++i) {
      termios raw{};
      cfmakeraw(&raw);
      std::array<char, 64> name{};
      if (openpty(&masters_[i], &slaves_[i], name.data(), &raw, nullptr) == 0)
        names[i] = name.data();
    }
    copier_ = fork();
    if (copier_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (;;) {
      pollfd ready[2] = {{masters_[0], POLLIN, 0}, {masters_[1], POLLIN, 0}};
      poll(ready, 2, -1);
      for (int i = 0; i < 2; ++i) {
        std::array<char, 256> data;
        const ssize_t n = ready[i].revents != 0 ? read(masters_[i], data.data(), data.size()) : 0;
        if (n > 0 && write(masters_[1 - i], data.data(), static_cast<std::size_t>(n)) != n)
          _exit(1);
      }
    }
  }
  ~SerialLine() {
    kill(copier_, SIGKILL);
    waitpid(copier_, nullptr, 0);
    for (const int fd : masters_) close(fd);
    for (const int fd : slaves_) close(fd);
  }
  SerialLine(const SerialLine&) = delete;
  SerialLine& operator=(const SerialLine&) = delete;

  std::array<std::string, 2> names;

 private:
  std::array<int, 2> masters_{}, slaves_{};
  pid_t copier_ = -1;
};

/// Over TCP and on a serial line (RTU).
class Mbpoll : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Peer, Mbpoll, ::testing::Bool(),
                         [](const auto& p) { return p.param ? "Rtu" : "Tcp"; });

TEST_P(Mbpoll, ReadsAndWritesTheSimulatedHand) {
  if (output_of("command -v mbpoll").empty()) GTEST_SKIP() << "mbpoll is not installed";
  std::optional<SerialLine> line;
  if (GetParam()) line.emplace();
  const std::string port = std::to_string(21000 + getpid() % 10'000);
  sim::HandServer server(
      parse_address(line ? "rtu:" + line->names[0] : "tcp:127.0.0.1:" + port, ""));
  server.exchange(
      {.activated = true, .initialisation = sim::Initialisation::done, .position = 0x80});
  const std::string mbpoll =
      "mbpoll -0 -1 -q -a 9 " + (line ? "-m rtu -b 115200 -P none" : "-p " + port);
  const std::string where = line ? line->names[1] : "127.0.0.1";
  const std::string read = output_of(mbpoll + " -t 4:hex -r 2000 -c 8 " + where);
  EXPECT_NE(read.find("[2000]: \t0x31C0"), std::string::npos) << read;
  EXPECT_NE(read.find("[2002]: \t0x8000"), std::string::npos) << read;
  const std::string written =
      output_of(mbpoll + " -t 4 -r 1000 " + where + " 2816 200 65344 0 0 0 0 0");
  const sim::HandOutput o = server.exchange({});
  EXPECT_TRUE(o.activate) << written;
  EXPECT_EQ(o.mode, sim::HandMode::pinch);
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
            p = values[1] & 0xFF
            super().setValues(2000, [0xF9FF | values[0] & 0x0600, p, p << 8, p << 8 | p, p, p << 8])
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
  HandClient client(parse_address("tcp:127.0.0.1:" + port, ""), k3f, 500ms);
  const auto answer = answer_of(client, child);
  ASSERT_TRUE(answer.has_value()) << answer.error().reason;
  EXPECT_TRUE(answer->active);
  EXPECT_EQ(answer->mode, HandMode::pinch);
  EXPECT_EQ(answer->closure, 0.4);
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
block.setValues(2000, [0xF9FF, 102, 102 << 8, 102, 0, 102 << 8])
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
  HandClient client(parse_address("rtu:" + device, ""), k3f, 500ms);
  const auto answer = answer_of(client, child);
  close(names[0]);
  ASSERT_TRUE(answer.has_value()) << answer.error().reason;
  EXPECT_EQ(answer->closure, 0.4);
  const auto gone = client.exchange(2h, kPinch);
  EXPECT_FALSE(gone.has_value()) << "the line is dead";
}

}  // namespace
}  // namespace mimesis::hw::modbus
