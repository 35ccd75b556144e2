#include "common/testing/net_host.h"

#include <unistd.h>

#include <cstdio>

namespace mimesis::testing {
namespace {

std::filesystem::path network_of(pid_t pid) {
  std::error_code gone;
  return std::filesystem::read_symlink("/proc/" + std::to_string(pid) + "/ns/net", gone);
}

}  // namespace

std::string NetHost::missing() {
  const bool there =
      geteuid() == 0 && Process("/usr/bin/unshare", {"-n", "ip", "link"}).wait() == 0;
  return there ? "" : "not here: no network namespaces";
}

NetHost::NetHost(int number, bool own)
    : number_(number),
      keeper_(own ? std::make_unique<Process>("/usr/bin/unshare",
                                              std::vector<std::string>{"-n", "sleep", "600"})
                  : nullptr),
      pid_(own ? keeper_->pid() : getpid()) {
  const auto end = TestNode::now() + 10s;
  const auto separate = [&] { return network_of(pid_) != network_of(getpid()); };
  while (own && !separate() && TestNode::now() < end) usleep(2000);
  made_ = separate() == own && runs("ip link set lo up && ip addr add " + address() +
                                    "/32 dev lo && ip addr add " + address6() + "/128 dev lo");
}

std::string NetHost::wire(const NetHost& other) {
  Process make("/usr/sbin/ip",
               {"link", "add", device(other), "netns", std::to_string(pid_), "type", "veth", "peer",
                "name", other.device(*this), "netns", std::to_string(other.pid_)});
  if (make.wait() != 0) return "not here: no virtual network: " + make.errors();
  return up(other) && other.up(*this) ? "" : "not here: a wire cannot be set up";
}

std::unique_ptr<Process> NetHost::start(const std::string& line) const {
  return std::make_unique<Process>(
      "/usr/bin/nsenter",
      std::vector<std::string>{"-t", std::to_string(pid_), "-n", "sh", "-c", line});
}

bool NetHost::mute(const NetHost& other) const {
  return runs("ip neigh replace " + other.address() +
              " lladdr 02:00:00:00:00:01 nud permanent dev " + device(other));
}
bool NetHost::unmute(const NetHost& other) const {
  return runs("ip neigh del " + other.address() + " dev " + device(other));
}
bool NetHost::cut(const NetHost& other) const {
  return runs("ip link set " + device(other) + " down");
}
bool NetHost::up(const NetHost& other) const {
  // Of IPv6 a wire answers for its own addresses alone, and loses them with the link.
  const std::string dev = " dev " + device(other);
  return runs("ip link set " + device(other) + " up && ip route replace " + other.address() +
              "/32" + dev + " src " + address() + " && ip addr replace " + address6() + "/128" +
              dev + " nodad && ip route replace " + other.address6() + "/128" + dev + " src " +
              address6());
}

bool NetHost::runs(const std::string& line) const {
  const auto shell = start(line);
  const auto code = shell->wait();
  if (code != 0) std::printf("%s: %s", line.c_str(), shell->errors().c_str());
  return code == 0;
}

}  // namespace mimesis::testing
