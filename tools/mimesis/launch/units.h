#pragma once
#include <systemd/sd-bus.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {

/// Nodes as transient units of systemd, through D-Bus: of the system's manager for root, else of
/// the user's. Units are bound to a lease, a unit that reads a pipe of ours: when this process
/// ends, however that comes about, systemd stops them.
class Units {
 public:
  /// @param life  environment of a node that gives signs of life
  /// @throws std::runtime_error if there is no manager.
  explicit Units(std::vector<std::pair<std::string, std::string>> life);
  Units(const Units&) = delete;
  Units& operator=(const Units&) = delete;

  /// Asks systemd to start a node; its output comes by `out` and `err`. @throws std::runtime_error
  void start(const Start& start, Fd& out, Fd& err);
  /// SIGKILL to all processes of a unit, other signals to its main one.
  void send(const std::string& unit, int signal);
  /// Main process; 0: not known yet, or gone.
  pid_t pid(const std::string& unit) const;
  /// It runs its own program, and is ready if it tells that.
  bool active(const std::string& unit) const;
  /// How it ended, once it has; then it is forgotten.
  struct End {
    Ending ending;
    std::string failure;  ///< systemd could not start it: why
  };
  std::optional<End> reap(const std::string& unit);
  /// A line of a node into the journal, as one of its unit.
  void log(const std::string& unit, const std::string& line) const;

  /// Takes the manager's news.
  void poll();
  int fd() const { return sd_bus_get_fd(bus_.get()); }
  short events() const;  ///< of `fd`

 private:
  struct Release {
    void operator()(sd_bus* bus) const { sd_bus_close_unref(bus); }
    void operator()(sd_bus_message* message) const { sd_bus_message_unref(message); }
    void operator()(sd_bus_slot* slot) const { sd_bus_slot_unref(slot); }
  };
  using Message = std::unique_ptr<sd_bus_message, Release>;
  struct Unit {
    std::unique_ptr<sd_bus_slot, Release> slot;  ///< of its news
    std::uint32_t pid = 0;
    std::int32_t code = 0, status = 0;  ///< as of waitid(2)
    std::string state, result;
    bool begun = false, active = false;
  };

  static int changed(sd_bus_message* message, void* unit, sd_bus_error*);
  Message call(const char* member) const;
  /// Sends a call to start a unit and waits until systemd has taken it.
  void send_call(const Message& call, const std::string& unit) const;
  void hold_lease(const std::string& name);

  std::unique_ptr<sd_bus, Release> bus_;
  std::vector<std::pair<std::string, std::string>> life_;
  Fd lease_;  ///< its end is that of the units
  std::string lease_unit_;
  std::map<std::string, Unit> units_;
  bool lost_ = false;  ///< the connection
};

}  // namespace mimesis::launch
