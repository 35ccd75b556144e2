// The circuit of an emergency stop at a Modbus server that is libmodbus's own.
#include "hw/modbus/stop_input.h"

#include <gtest/gtest.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "common/testing/loopback.h"

namespace mimesis::hw::modbus {
namespace {

using namespace std::chrono_literals;

/// Serves discrete inputs on one connection after the other, on a thread.
class Server {
 public:
  explicit Server(const Address& address)
      : socket_(listen(address)), map_(modbus_mapping_new(0, 8, 0, 0)) {
    thread_ = std::thread([this] { serve(); });
  }
  ~Server() {
    stopping = true;
    thread_.join();
    close(socket_);
    modbus_mapping_free(map_);
  }
  std::atomic<bool> closed{true}, silent{false}, stopping{false};

 private:
  static bool readable(int fd) {
    pollfd waiting{.fd = fd, .events = POLLIN, .revents = 0};
    return poll(&waiting, 1, 5) > 0;
  }
  void serve() {
    modbus_t* context = modbus_new_tcp(nullptr, 0);
    int connection = -1;
    while (!stopping) {
      if (connection < 0 && readable(socket_)) {
        connection = accept(socket_, nullptr, nullptr);
        modbus_set_socket(context, connection);
      }
      if (connection < 0 || silent || !readable(connection)) continue;
      std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> request{};
      const int length = modbus_receive(context, request.data());
      map_->tab_input_bits[5] = closed ? 1 : 0;
      if (length > 0 && modbus_reply(context, request.data(), length, map_) > 0) continue;
      close(connection);
      connection = -1;
    }
    if (connection >= 0) close(connection);
    modbus_free(context);
  }
  int socket_;
  modbus_mapping_t* map_;
  std::thread thread_;
};

class Circuit : public ::testing::TestWithParam<bool> {
 protected:
  /// Until the input says so; false after a time that no test needs.
  bool becomes(const std::string& why) {
    const auto end = std::chrono::steady_clock::now() + 20s;
    std::string is = input.open();
    while (is != why && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(1ms);
      is = input.open();
    }
    EXPECT_EQ(is, why);
    return is == why;
  }
  testing::Loopback graph;
  Address address = parse_address("unix:stop", graph.directory());
  std::optional<Server> server;
  StopInput input{address, 1, 5, GetParam(), 100ms};
};
INSTANTIATE_TEST_SUITE_P(Reads, Circuit, ::testing::Bool(),
                         [](const auto& how) { return how.param ? "OnAThread" : "InTheStep"; });

TEST_P(Circuit, IsClosedOnlyWhileItIsKnownToBe) {
  EXPECT_NE(input.open(), "") << "before the first answer";
  ASSERT_TRUE(becomes("input 5 at unix:stop: nobody serves there"));
  server.emplace(address);
  ASSERT_TRUE(becomes(""));
  server->closed = false;
  ASSERT_TRUE(becomes("input 5 at unix:stop: is open"));
  server->closed = true;
  ASSERT_TRUE(becomes(""));
  server->silent = true;
  ASSERT_TRUE(becomes("input 5 at unix:stop: no answer of unit 1 within 100 ms"));
  server->silent = false;
  ASSERT_TRUE(becomes(""));
  server.reset();
  ASSERT_TRUE(becomes("input 5 at unix:stop: Connection refused"));
}

}  // namespace
}  // namespace mimesis::hw::modbus
