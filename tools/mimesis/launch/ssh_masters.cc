#include "tools/mimesis/launch/ssh_masters.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

namespace mimesis::launch {
namespace {

constexpr std::chrono::seconds kEnd{2};
constexpr std::size_t kSuffix = 18;  // ssh binds the socket under a longer name first

/// What the user's configuration says of a host, before anything is connected.
Command configuration(const Host& host) { return {{"ssh", "-G", host.target()}, {}}; }

bool shares_already(const std::string& configuration) {
  return ("\n" + configuration).find("\ncontrolpath ") != std::string::npos;
}

}  // namespace

SshMasters::SshMasters(const std::vector<const Host*>& hosts, const std::string& folder) {
  if (hosts.empty()) return;
  folder_ = folder + "/ssh-XXXXXX";
  if (mkdtemp(folder_.data()) == nullptr) folder_.clear();
  if (folder_.empty() || folder_.size() + 4 + kSuffix >= sizeof sockaddr_un{}.sun_path) return;
  std::vector<std::unique_ptr<OwnProcess>> asked;
  for (const Host* host : hosts)
    asked.push_back(std::make_unique<OwnProcess>(configuration(*host)));
  for (std::size_t i = 0; i < hosts.size(); ++i) {
    if (!asked[i]->wait(kEnd) || shares_already(asked[i]->last_words(1 << 16))) continue;
    Master& master = masters_[hosts[i]->target()];
    if (master.ssh) continue;
    master.socket = fmt::format("{}/{}", folder_, i);
    Command c = ssh(*hosts[i], "", {"-o", "ControlPersist=no", "-N", "-M", "-S", master.socket});
    c.argv.resize(c.argv.size() - 2);  // no command
    master.ssh = std::make_unique<OwnProcess>(c);
  }
}

SshMasters::~SshMasters() {
  for (auto& [target, master] : masters_) master.ssh->send(SIGTERM);
  for (auto& [target, master] : masters_) master.ssh->wait(kEnd);
  std::error_code ignored;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

SshMasters::Master* SshMasters::find(const Host& host) {
  const auto found = masters_.find(host.target());
  if (found == masters_.end()) return nullptr;
  Master& master = found->second;
  // ssh has a time-out of its own.
  while (!master.ssh->ending() && access(master.socket.c_str(), F_OK) != 0) poll(nullptr, 0, 2);
  return &master;
}

std::vector<std::string> SshMasters::options(const Host& host) {
  const Master* master = find(host);
  if (master == nullptr || master->ssh->ending()) return {};
  return {"-S", master->socket};
}

std::string SshMasters::failure(const Host& host) {
  const Master* master = find(host);
  if (master == nullptr || !master->ssh->ending()) return {};
  return fmt::format("host '{}' cannot be used: ssh {}: {}", host.name.text,
                     master->ssh->ending()->text(), master->ssh->last_words());
}

}  // namespace mimesis::launch
