#pragma once
#include <google/protobuf/message_lite.h>

#include <chrono>
#include <functional>
#include <string>
#include <tl/expected.hpp>

#include "common/error.h"
#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/stop_signals.h"

namespace mimesis::tool {

/// A program that answers packets on a socket (common/runtime/replay.h). It is killed with this
/// object.
class PacketProcess {
 public:
  /// @param name     the program's name in messages
  /// @param command  the program and its arguments; `fd` is the socket's number in the program
  /// @param timeout_s  wall time for each answer and for the end
  /// @throws std::runtime_error if it cannot be started.
  PacketProcess(std::string name, const std::function<launch::Command(int fd)>& command,
                double timeout_s);
  ~PacketProcess();
  PacketProcess(const PacketProcess&) = delete;
  PacketProcess& operator=(const PacketProcess&) = delete;

  /// Sends `request` and waits for the answer. Fails with the reason why the program is gone (one
  /// line, then the last lines it wrote), or with an empty one if `stop` (null: never) was
  /// requested meanwhile.
  /// @throws ConfigError with its words if it ends with exit code 2 before its first answer.
  tl::expected<void, Status> ask(const google::protobuf::MessageLite& request,
                                 google::protobuf::MessageLite& answer,
                                 const StopSignals* stop = nullptr);
  /// Closes the socket and waits for the end. Returns what was wrong with that, or nothing.
  std::string finish();
  /// An answer or the end took too long, and the program was killed.
  bool timed_out() const { return timed_out_; }

 private:
  bool wait_for_answer(const StopSignals* stop);
  launch::Ending wait();
  std::string too_long(std::string_view what) const;
  std::string describe(const launch::Ending& how) const;
  std::string last_words() const;

  std::string name_;
  launch::Fd socket_;
  launch::Fd words_;  ///< holds what the program writes to standard output and error
  launch::Child child_;
  std::chrono::milliseconds timeout_;
  bool answered_ = false, timed_out_ = false;
};

}  // namespace mimesis::tool
