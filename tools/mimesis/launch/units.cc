#include "tools/mimesis/launch/units.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/wait.h>
#include <systemd/sd-journal.h>

#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace mimesis::launch {
namespace {

constexpr const char* kManager = "org.freedesktop.systemd1";
constexpr const char* kManagerPath = "/org/freedesktop/systemd1";
constexpr const char* kManagerInterface = "org.freedesktop.systemd1.Manager";
constexpr std::uint64_t kAnswer = 1'500'000;        // [us], shorter than a launcher may hang
constexpr std::uint64_t kNever = ~std::uint64_t{};  // [us]

/// @throws std::runtime_error "WHAT: why"
void check(int result, const std::string& what) {
  if (result < 0) throw std::runtime_error(what + ": " + std::strerror(-result));
}

/// Appends properties to the call that starts a unit.
class Properties {
 public:
  explicit Properties(sd_bus_message* call) : call_(call) {
    check(sd_bus_message_open_container(call_, 'a', "(sv)"), "properties");
  }
  template <class... Values>
  void add(const char* name, const char* type, Values... values) {
    check(sd_bus_message_append(call_, "(sv)", name, type, values...), name);
  }
  void add(const char* name, const std::string& value) { add(name, "s", value.c_str()); }
  void add(const char* name, const std::vector<std::string>& values) {
    std::vector<const char*> texts;
    for (const std::string& value : values) texts.push_back(value.c_str());
    texts.push_back(nullptr);
    open(name, "as");
    check(sd_bus_message_append_strv(call_, const_cast<char**>(texts.data())), name);
    close();
  }
  void add_bytes(const char* name, const std::vector<std::uint8_t>& bytes) {
    open(name, "ay");
    check(sd_bus_message_append_array(call_, 'y', bytes.data(), bytes.size()), name);
    close();
  }
  void add_command(const std::vector<std::string>& argv) {
    std::vector<const char*> words;
    for (const std::string& word : argv) words.push_back(word.c_str());
    words.push_back(nullptr);
    open("ExecStart", "a(sasb)");
    check(sd_bus_message_open_container(call_, 'a', "(sasb)"), "ExecStart");
    check(sd_bus_message_open_container(call_, 'r', "sasb"), "ExecStart");
    check(sd_bus_message_append(call_, "s", argv[0].c_str()), "ExecStart");
    check(sd_bus_message_append_strv(call_, const_cast<char**>(words.data())), "ExecStart");
    check(sd_bus_message_append(call_, "b", 0), "ExecStart");
    check(sd_bus_message_close_container(call_), "ExecStart");
    check(sd_bus_message_close_container(call_), "ExecStart");
    close();
  }
  /// No units beside this one.
  void finish() {
    check(sd_bus_message_close_container(call_), "properties");
    check(sd_bus_message_append(call_, "a(sa(sv))", 0), "properties");
  }

 private:
  void open(const char* name, const char* type) {
    check(sd_bus_message_open_container(call_, 'r', "sv"), name);
    check(sd_bus_message_append(call_, "s", name), name);
    check(sd_bus_message_open_container(call_, 'v', type), name);
  }
  void close() {
    check(sd_bus_message_close_container(call_), "properties");
    check(sd_bus_message_close_container(call_), "properties");
  }

  sd_bus_message* call_;
};

std::vector<std::string> environment_texts(
    const Start& start, const std::vector<std::pair<std::string, std::string>>& life) {
  Command command = start.command;
  command.env.insert(command.env.end(), life.begin(), life.end());
  std::vector<std::string> all = environment(command);
  // What another service manager told this process is not for the node.
  std::erase_if(all, [](const std::string& variable) {
    for (const char* name : {"NOTIFY_SOCKET=", "WATCHDOG_", "LISTEN_",
                             "INVOCATION_ID=", "JOURNAL_STREAM=", "SYSTEMD_EXEC_PID="}) {
      if (variable.starts_with(name)) return true;
    }
    return false;
  });
  return all;
}

/// Its own failure of systemd between fork and exec: exit codes from 200 (systemd.exec(5)).
std::string start_failure(int status) {
  switch (status) {
    case 200:
      return "the launcher's working folder is not open to it";
    case 203:
      return "it cannot be executed";
    case 205:
      return "the limits are not permitted";
    case 214:
      return "sched.policy: Operation not permitted";
    case 215:
      return "sched.cpus: Invalid argument";
    default:
      return fmt::format("systemd failed before it ran (exit code {}, systemd.exec(5))", status);
  }
}

}  // namespace

Units::Units(std::vector<std::pair<std::string, std::string>> life) : life_(std::move(life)) {
  sd_bus* bus = nullptr;
  const int opened = geteuid() == 0 ? sd_bus_open_system(&bus) : sd_bus_open_user(&bus);
  bus_.reset(bus);
  check(opened, "engine systemd: no service manager answers");
  check(sd_bus_call_method(bus, kManager, kManagerPath, kManagerInterface, "Subscribe", nullptr,
                           nullptr, nullptr),
        "engine systemd: no service manager answers");
}

Units::Message Units::call(const char* member) const {
  sd_bus_message* message = nullptr;
  check(sd_bus_message_new_method_call(bus_.get(), &message, kManager, kManagerPath,
                                       kManagerInterface, member),
        member);
  return Message(message);
}

void Units::send_call(const Message& call, const std::string& unit) const {
  sd_bus_error error{};
  const int sent = sd_bus_call(bus_.get(), call.get(), kAnswer, &error, nullptr);
  const std::string why = error.message != nullptr ? error.message : std::strerror(-sent);
  sd_bus_error_free(&error);
  if (sent < 0) throw std::runtime_error(unit + ": " + why);
}

void Units::hold_lease(const std::string& name) {
  Pipe pipe = make_pipe();
  const Message start = call("StartTransientUnit");
  check(sd_bus_message_append(start.get(), "ss", name.c_str(), "fail"), name);
  Properties properties(start.get());
  properties.add("Description", std::string("Ends the nodes of a launcher with it"));
  properties.add("Type", std::string("exec"));
  properties.add("CollectMode", std::string("inactive-or-failed"));
  properties.add_command({"/bin/cat"});
  properties.add("StandardInputFileDescriptor", "h", pipe.read.get());
  properties.add("StandardOutput", std::string("null"));
  properties.finish();
  send_call(start, name);
  lease_unit_ = name;
  lease_ = std::move(pipe.write);
}

void Units::start(const Start& start, Fd& out, Fd& err) {
  if (lost_) throw std::runtime_error("the connection to systemd is lost");
  if (!lease_.open())
    hold_lease(start.slice.substr(0, start.slice.rfind('.')) + ".lease-" +
               std::to_string(getpid()) + ".service");
  std::vector<std::string> argv = start.command.argv;
  const std::string path = find_executable(argv[0]);
  if (path.empty()) throw std::runtime_error(argv[0] + ": there is no such program");
  argv[0] = std::filesystem::absolute(path).string();

  char* object = nullptr;
  check(sd_bus_path_encode("/org/freedesktop/systemd1/unit", start.unit.c_str(), &object),
        start.unit);
  const std::unique_ptr<char, decltype(&free)> freed(object, &free);
  Unit& unit = units_[start.unit] = Unit{};
  sd_bus_slot* slot = nullptr;
  check(sd_bus_match_signal(bus_.get(), &slot, kManager, object, "org.freedesktop.DBus.Properties",
                            "PropertiesChanged", changed, &unit),
        start.unit);
  unit.slot.reset(slot);

  Pipe output = make_pipe(), errors = make_pipe();
  const Message message = call("StartTransientUnit");
  check(sd_bus_message_append(message.get(), "ss", start.unit.c_str(), "fail"), start.unit);
  Properties p(message.get());
  p.add("Description", "Mimesis node " + start.unit.substr(0, start.unit.rfind('.')));
  p.add("Slice", start.slice);
  p.add("BindsTo", std::vector{lease_unit_});
  p.add("After", std::vector{lease_unit_});
  p.add("AddRef", "b", 1);  // kept until its ending has been read
  p.add("CollectMode", std::string("inactive-or-failed"));
  p.add("Type", std::string(start.notifies ? "notify" : "exec"));
  p.add("TimeoutStartUSec", "t", kNever);  // the launcher decides
  p.add_command(argv);
  p.add("WorkingDirectory", std::filesystem::current_path().string());
  p.add("Environment", environment_texts(start, life_));
  p.add("StandardInput", std::string("null"));
  p.add("StandardOutputFileDescriptor", "h", output.write.get());
  p.add("StandardErrorFileDescriptor", "h", errors.write.get());
  p.add("KillMode", std::string("mixed"));
  p.add("KillSignal", "i", start.stop_signal);
  p.add("TimeoutStopUSec", "t", static_cast<std::uint64_t>(start.stop_timeout.count() / 1000));
  if (start.watchdog.count() > 0)
    p.add("WatchdogUSec", "t", static_cast<std::uint64_t>(start.watchdog.count() / 1000));
  const Sched& sched = start.sched;
  if (sched.policy != "other") {
    p.add("CPUSchedulingPolicy", "i", sched.policy == "fifo" ? SCHED_FIFO : SCHED_RR);
    p.add("CPUSchedulingPriority", "i", sched.priority);
    p.add("LimitRTPRIO", "t", static_cast<std::uint64_t>(sched.priority));
  }
  if (!sched.cpus.empty()) {
    std::vector<std::uint8_t> mask(128);
    for (const int cpu : sched.cpus)
      mask[static_cast<std::size_t>(cpu) / 8] |= static_cast<std::uint8_t>(1 << cpu % 8);
    p.add_bytes("CPUAffinity", mask);
  }
  if (sched.mlock) p.add("LimitMEMLOCK", "t", kNever);
  p.finish();
  try {
    send_call(message, start.unit);
  } catch (const std::runtime_error&) {
    units_.erase(start.unit);
    throw;
  }
  for (const Fd* end : {&output.read, &errors.read}) fcntl(end->get(), F_SETFL, O_NONBLOCK);
  out = std::move(output.read);
  err = std::move(errors.read);
}

int Units::changed(sd_bus_message* message, void* unit, sd_bus_error*) {
  auto& u = *static_cast<Unit*>(unit);
  // The interface, and the properties of it that have changed, each with its new value.
  if (sd_bus_message_skip(message, "s") < 0 ||
      sd_bus_message_enter_container(message, 'a', "{sv}") < 0)
    return 0;
  while (sd_bus_message_enter_container(message, 'e', "sv") > 0) {
    const char *name = nullptr, *text = nullptr;
    sd_bus_message_read(message, "s", &name);
    const std::string property = name != nullptr ? name : "";
    if (property == "MainPID") {
      sd_bus_message_read(message, "v", "u", &u.pid);
    } else if (property == "ExecMainCode") {
      sd_bus_message_read(message, "v", "i", &u.code);
    } else if (property == "ExecMainStatus") {
      sd_bus_message_read(message, "v", "i", &u.status);
    } else if (property == "Result" || property == "ActiveState") {
      sd_bus_message_read(message, "v", "s", &text);
      if (text != nullptr) (property == "Result" ? u.result : u.state) = text;
    } else {
      sd_bus_message_skip(message, "v");
    }
    sd_bus_message_exit_container(message);
  }
  u.begun = u.begun || u.code != 0 || (!u.state.empty() && u.state != "inactive");
  u.active = u.active || u.state == "active";
  return 0;
}

void Units::poll() {
  while (!lost_) {
    const int taken = sd_bus_process(bus_.get(), nullptr);
    if (taken == 0) return;
    lost_ = taken < 0;
  }
  lease_.reset();
}

short Units::events() const {
  const int events = sd_bus_get_events(bus_.get());
  return static_cast<short>(events < 0 ? 0 : events);
}

pid_t Units::pid(const std::string& unit) const {
  const auto it = units_.find(unit);
  return it != units_.end() ? static_cast<pid_t>(it->second.pid) : 0;
}

bool Units::active(const std::string& unit) const {
  const auto it = units_.find(unit);
  return it != units_.end() && it->second.state == "active";
}

void Units::send(const std::string& unit, int signal) {
  // Answers are not waited for: a unit that is gone needs no signal.
  if (signal != SIGKILL && pid(unit) == 0) {
    sd_bus_call_method_async(bus_.get(), nullptr, kManager, kManagerPath, kManagerInterface,
                             "StopUnit", nullptr, nullptr, "ss", unit.c_str(), "replace");
  } else {
    sd_bus_call_method_async(bus_.get(), nullptr, kManager, kManagerPath, kManagerInterface,
                             "KillUnit", nullptr, nullptr, "ssi", unit.c_str(),
                             signal == SIGKILL ? "all" : "main", signal);
  }
}

std::optional<Units::End> Units::reap(const std::string& name) {
  const auto it = units_.find(name);
  if (it == units_.end()) return std::nullopt;
  const Unit& unit = it->second;
  End end;
  if (lost_) {
    end.ending.lost = "of the service manager";
  } else if (unit.state != "failed" && !(unit.state == "inactive" && unit.begun)) {
    return std::nullopt;
  } else if (unit.code == CLD_KILLED || unit.code == CLD_DUMPED) {
    end.ending.signal = unit.status;
  } else {
    end.ending.code = unit.status;
    if (unit.code == 0 && unit.result != "success") {
      end.failure = "systemd: " + unit.result;
    } else if (unit.status >= 200 && !unit.active) {
      end.failure = start_failure(unit.status);
    }
  }
  // So that the name is free for the next start.
  for (const char* member : {"UnrefUnit", "ResetFailedUnit"})
    sd_bus_call_method_async(bus_.get(), nullptr, kManager, kManagerPath, kManagerInterface, member,
                             nullptr, nullptr, "s", name.c_str());
  units_.erase(it);
  return end;
}

void Units::log(const std::string& unit, const std::string& line) const {
  // journalctl -u (or --user-unit) shows lines about a unit of whoever may speak for it.
  const char* about = geteuid() == 0 ? "OBJECT_SYSTEMD_UNIT=%s" : "OBJECT_SYSTEMD_USER_UNIT=%s";
  const std::string name = unit.substr(0, unit.rfind('.'));
  sd_journal_send("MESSAGE=%s", line.c_str(), "PRIORITY=%i", 6, "SYSLOG_IDENTIFIER=%s",
                  name.c_str(), about, unit.c_str(), nullptr);
}

}  // namespace mimesis::launch
