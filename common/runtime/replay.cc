#include "common/runtime/replay.h"

#include <google/protobuf/message_lite.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <iostream>

#include "common/runtime/log.h"
#include "common/runtime/log_lines.h"
#include "common/runtime/replay_bus.h"

namespace mimesis::runtime {
namespace {

constexpr std::uint32_t kLargestPacket = 1U << 30U;

bool send_all(int fd, const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t n = ::send(fd, data, size, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    data += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

bool receive_all(int fd, char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t n = ::recv(fd, data, size, 0);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    data += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

void play(const v1::StepRecord& step, ReplayBus& bus, AnyNode& node) {
  const Time now(static_cast<Time::rep>(step.time_ns()));
  switch (step.kind()) {
    case v1::STEP_KIND_CREATE:
      return node.create(bus);
    case v1::STEP_KIND_STEP:
      return node.step(now);
    case v1::STEP_KIND_STOP:
      return node.stop(now);
    default:
      throw ConfigError("a step of unknown kind");
  }
}

}  // namespace

bool write_packet(int fd, const google::protobuf::MessageLite& message) {
  const auto size = static_cast<std::uint32_t>(message.ByteSizeLong());
  std::string bytes(sizeof size, '\0');
  std::memcpy(bytes.data(), &size, sizeof size);
  return message.AppendToString(&bytes) && send_all(fd, bytes.data(), bytes.size());
}

bool read_packet(int fd, google::protobuf::MessageLite& message) {
  std::uint32_t size = 0;
  std::array<char, sizeof size> head{};
  if (!receive_all(fd, head.data(), head.size())) return false;
  std::memcpy(&size, head.data(), sizeof size);
  if (size > kLargestPacket) return false;
  std::string bytes(size, '\0');
  return receive_all(fd, bytes.data(), bytes.size()) && message.ParseFromString(bytes);
}

int run_replay(const BusOptions& options, int fd, AnyNode& node) {
  set_log_name(options.name);
  ReplayBus bus(options.name, options.clock == ClockKind::lockstep, options.out);
  v1::ReplayStep step;
  int exit_code = 0;
  while (exit_code == 0 && read_packet(fd, step)) {
    bool failed = false;
    std::string failure;
    bus.begin(step);
    try {
      play(step.step(), bus, node);
    } catch (const std::exception& e) {
      failed = true;
      failure = e.what();
      exit_code = dynamic_cast<const ConfigError*>(&e) != nullptr ? 2 : 1;
    }
    v1::ReplayOutcome outcome = bus.end();
    outcome.set_failed(failed);
    if (failed) outcome.set_problem(failure);
    take_log_lines();  // nobody publishes them here
    if (!write_packet(fd, outcome)) break;
  }
  node.stop(Time(0));  // before the bus that its ports refer to
  return exit_code;
}

}  // namespace mimesis::runtime
