#pragma once
#include <poll.h>

#include <chrono>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "proto/runtime.pb.h"
#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/launch/units.h"
#include "tools/mimesis/launch/watchdog.h"

namespace mimesis::launch {

using WallTime = std::chrono::steady_clock::time_point;

/// Event of a node's process.
struct HostEvent {
  enum class Kind : int {
    output,   ///< `text`: a line on standard output
    error,    ///< `text`: a line on standard error
    silent,   ///< no sign of life for `time`; `text`: what it does
    heard,    ///< it goes on after `time`
    ended,    ///< as `ending` says; after all its lines
    failed,   ///< it could not be started: `text`
    refused,  ///< it runs, but the system did not grant what it needs: `text`
  };
  std::string node;
  Kind kind = Kind::output;
  std::string text = {};
  nanoseconds time{};
  Ending ending = {};
};

/// Where nodes run: this machine, or one behind ssh (far_host.h).
class NodeHost {
 public:
  virtual ~NodeHost() = default;
  virtual bool up() const = 0;  ///< nodes can be started
  virtual void start(const std::string& node, const Start& start) = 0;
  virtual void send(const std::string& node, int signal) = 0;
  /// What has happened since the last call; to be called at least every kLook.
  virtual std::vector<HostEvent> poll() = 0;
  virtual void watch(std::vector<pollfd>& fds) const = 0;  ///< adds what wakes `poll`
  /// The process of a node; 0: it does not run.
  virtual pid_t pid(const std::string& node) const = 0;
};

class LocalHost final : public NodeHost {
 public:
  /// `directory`: of the graph. @throws std::runtime_error without a socket in it.
  explicit LocalHost(const std::string& directory);
  bool up() const override { return true; }
  void start(const std::string& node, const Start& start) override;
  void send(const std::string& node, int signal) override;
  std::vector<HostEvent> poll() override;
  void watch(std::vector<pollfd>& fds) const override;
  pid_t pid(const std::string& node) const override;
  std::vector<std::string> running() const;

 private:
  struct Running {
    Child child;           ///< of a unit: its output alone
    std::string out, err;  ///< begun lines
    Silence silence;
    std::string unit;  ///< of systemd; empty: it is our child
    Sched sched;
    bool checked = false, refused = false;
  };
  pid_t pid(const Running& process) const;
  void wait_for(int fd);
  std::set<int> readable() const;  ///< of those waited for
  std::optional<Units::End> reap(Running& process);
  /// Reads back what the system granted it. `ready`: it has done what it can itself.
  void check(const std::string& node, Running& process, bool ready, std::vector<HostEvent>& events);

  Watchdog watchdog_;
  Fd epoll_;  ///< of signs of life and of children: what many idle nodes cost does not grow
  std::optional<Units> units_;  ///< once a node needs them
  Watched watched_;
  std::map<std::string, Running> running_;
  std::vector<HostEvent> failed_;
};

}  // namespace mimesis::launch
