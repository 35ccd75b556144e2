#pragma once
#include <fmt/format.h>
#include <google/protobuf/message_lite.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/error.h"
#include "common/runtime/replay.h"
#include "common/time.h"
#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/log/provenance.h"
#include "tools/mimesis/log/replay.h"
#include "tools/mimesis/log/replay_log.h"
#include "tools/mimesis/stop_signals.h"

// A recorded run of a node, stepped again: shared by the verbs that compare and that restore.
namespace mimesis::tool {

/// Path of the program to run a node again: the `wanted` one (a folder: of the recorded name in
/// it), else that of the recorded name beside this program. A log is data: it chooses no other.
/// @throws ConfigError if there is none, or if the log names what is no node's program
inline std::string program_of(const NodeRun& node_run, const std::string& wanted) {
  namespace fs = std::filesystem;
  const std::string& recorded = node_run.start.executable();
  std::error_code ignored;
  std::string path = wanted;
  if (wanted.empty() || fs::is_directory(wanted, ignored)) {
    if (wanted.empty() ? !is_program_name(recorded) : !is_file_name(recorded)) {
      throw ConfigError(fmt::format(
          "node '{}': the log names the program '{}', expected {}; --exec PATH says which one to "
          "run",
          node_run.node(), printable(recorded),
          wanted.empty() ? "mimesis_NAME, without a folder" : "a name without a folder"));
    }
    const fs::path folder = wanted.empty()
                                ? fs::read_symlink("/proc/self/exe", ignored).parent_path()
                                : fs::path(wanted);
    path = folder / recorded;
  }
  const std::string found = launch::find_executable(path);
  if (found.empty()) {
    throw ConfigError(fmt::format("node '{}': there is no program {}; --exec PATH names another",
                                  node_run.node(), path));
  }
  return found;
}

/// The program as a replay starts it; `socket`: its steps come there. `folder` is for its
/// parameters, and all that it may write to.
inline launch::Command replay_command(const std::string& program, const NodeRun& node_run,
                                      const std::string& folder,
                                      const std::vector<std::string>& sets, int socket) {
  const std::string parameters =
      folder + "/" + std::filesystem::path(node_run.node()).filename().string() + ".yaml";
  std::ofstream(parameters) << node_run.start.parameters();
  std::vector<std::string> argv{program,         "--replay", std::to_string(socket), "--name",
                                node_run.node(), "--clock",  node_run.start.clock(), "--params",
                                parameters};
  for (const std::string& set : sets) argv.insert(argv.end(), {"--set", set});
  const auto wire = [&argv](const char* option, const auto& topics) {
    for (const v1::TopicInfo& t : topics) {
      if (t.port().starts_with('.') || runtime::is_own_topic(t.topic())) continue;  // the runtime's
      argv.insert(argv.end(), {option, t.port() + "=" + t.topic()});
    }
  };
  wire("--in", node_run.start.inputs());
  wire("--out", node_run.start.outputs());
  return {argv, {}};
}

inline std::string missing_input(const NodeRunReader& reader, const RecordedStep& step,
                                 const v1::InputSource& source, std::uint64_t seq) {
  std::string why = "the message is not in the log: lost";
  if (!reader.has_input(source)) why = "the log does not hold this topic of that node";
  if (reader.was_let_go(source, seq)) {
    why = fmt::format("it was let go: more than {} MB of inputs waited to be taken",
                      kMostInputBytes / 1'000'000);
  }
  return fmt::format("step {} took {} #{} of node '{}' on input '{}': {}", step.number,
                     source.topic(), seq, source.node(), source.port(), why);
}

/// Gives the node a step with all its inputs. Returns why it cannot take them, or nothing.
inline std::string fill_step(NodeRunReader& reader, const RecordedStep& step,
                             v1::ReplayStep& message) {
  *message.mutable_step() = step.record;
  for (const v1::TakenMessage& taken : step.record.taken()) {
    if (taken.source() >= step.sources.size())
      return fmt::format("step {} names an input that is not described", step.number);
    const v1::InputSource& source = step.sources[taken.source()];
    const KeptMessage* input = reader.input(source, taken.seq());
    if (input == nullptr) return missing_input(reader, step, source, taken.seq());
    v1::ReplayMessage& in = *message.add_inputs();
    in.set_port(source.port());
    in.set_payload(input->payload);
    in.set_stamp_ns(input->publish_time_ns);
    in.set_seq(taken.seq());
    in.set_node(source.node());
  }
  return {};
}

/// A program that answers packets on a socket (common/runtime/replay.h).
class PacketProcess {
 public:
  /// Reports the end of the program in one line, then its last output.
  class Gone : public std::runtime_error {
   public:
    using std::runtime_error::runtime_error;
  };

  /// @param name     the program's name in messages
  /// @param command  the program and its arguments; `fd` is the socket's number in the program
  /// @param timeout_s  wall time for each answer and for the end
  /// @param writable   the only folder that it may write to; empty: it is not confined
  /// @throws std::runtime_error if it cannot be started; ConfigError if it cannot be confined.
  PacketProcess(std::string name, const std::function<launch::Command(int fd)>& command,
                double timeout_s, const std::string& writable)
      : name_(std::move(name)) {
    constexpr double kLongest_s = 1e6;  // poll takes an int
    timeout_ = std::chrono::milliseconds(std::llround(std::min(timeout_s, kLongest_s) * 1e3));
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
      throw std::runtime_error(std::string("socketpair: ") + std::strerror(errno));
    }
    socket_ = launch::Fd(ends[0]);
    const launch::Fd other(ends[1]);
    // Limits each read and write, for a program that hangs in the middle of a packet.
    const auto us = std::max<std::int64_t>(1000, timeout_.count() * 1000);
    const timeval limit{us / 1'000'000, us % 1'000'000};
    setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    setsockopt(socket_.get(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    std::optional<launch::Confinement> confinement;
    if (!writable.empty()) confinement.emplace(writable);
    process_.emplace(command(other.get()), other.get(), confinement ? &*confinement : nullptr);
  }

  /// Sends `request` and waits for the answer; false if `stop` (null: never) was requested
  /// meanwhile. @throws Gone; ConfigError with its words if it ends with exit code 2 before its
  /// first answer
  bool ask(const google::protobuf::MessageLite& request, google::protobuf::MessageLite& answer,
           const StopSignals* stop = nullptr) {
    errno = 0;
    if (runtime::write_packet(socket_.get(), request) && wait_for_answer(stop) &&
        runtime::read_packet(socket_.get(), answer)) {
      return answered_ = true;
    }
    if (stop != nullptr && stop->requested()) return false;
    timed_out_ = timed_out_ || errno == EAGAIN;
    if (timed_out_) throw Gone(too_long("the step"));
    const std::string why = finish();
    if (!timed_out_ && !answered_ && process_->ending()->code == 2) {
      throw ConfigError(process_->last_words());
    }
    throw Gone(why.empty() ? describe() : why);
  }
  /// Closes the socket and waits for the end. Returns an error, or nothing.
  std::string finish() {
    socket_.reset();
    timed_out_ = !process_->wait(timeout_) || timed_out_;
    if (timed_out_) return too_long(name_ + "'s end");
    return process_->ending()->good() ? "" : describe();
  }
  /// An answer or the end took too long, and the program was killed.
  bool timed_out() const { return timed_out_; }

 private:
  /// False if a stop was requested or it took too long.
  bool wait_for_answer(const StopSignals* stop) {
    using Clock = std::chrono::steady_clock;
    const auto deadline = Clock::now() + timeout_;
    for (;;) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
      pollfd readable{socket_.get(), POLLIN, 0};
      if (poll(&readable, 1, static_cast<int>(std::max<std::int64_t>(0, left.count()))) > 0) {
        return true;
      }
      if (stop != nullptr && stop->requested()) return false;
      timed_out_ = Clock::now() >= deadline;
      if (timed_out_) return false;
    }
  }
  std::string too_long(std::string_view what) const {
    return fmt::format("{} took longer than {} s (--timeout): {} was killed", what,
                       to_seconds(timeout_), name_);
  }
  std::string describe() {
    const std::string words = process_->last_words();
    return name_ + " " + process_->ending()->text() + (words.empty() ? "" : ":\n" + words);
  }

  std::string name_;
  launch::Fd socket_;
  std::optional<launch::OwnProcess> process_;
  std::chrono::milliseconds timeout_{};
  bool answered_ = false, timed_out_ = false;
};

}  // namespace mimesis::tool
