#include "common/runtime/keys.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zmq.h>

#include <array>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <vector>

#include "common/error.h"
#include "common/runtime/log.h"

namespace mimesis::runtime {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kKeyLength = 40;

fs::path config_folder() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const char* home = std::getenv("HOME");
  if (config != nullptr && *config == '/') return fs::path(config) / "mimesis";
  return fs::path(home != nullptr ? home : "/") / ".config/mimesis";
}

bool is_key(const std::string& text) {
  std::array<std::uint8_t, 32> bytes;
  return text.size() == kKeyLength && zmq_z85_decode(bytes.data(), text.c_str()) != nullptr;
}

/// Replaces a file of this user alone in one step.
void write_file(const fs::path& path, const std::string& text) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  const std::string temporary = path.string() + ".new";
  unlink(temporary.c_str());
  const int fd = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  const bool written = fd >= 0 &&
                       write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                       rename(temporary.c_str(), path.c_str()) == 0;
  const int why = errno;
  if (fd >= 0) close(fd);
  if (!written) throw ConfigError("cannot write " + path.string() + ": " + std::strerror(why));
}

/// Why a list of keys is not believed; empty: it is, or there is none.
std::string unsafe(const fs::path& path) {
  struct stat st {};
  if (stat(path.c_str(), &st) != 0) return {};
  const bool ours = st.st_uid == geteuid() || st.st_uid == 0,
             shared = (st.st_mode & (S_IWGRP | S_IWOTH)) != 0;
  return ours && !shared ? "" : path.string() + ": other users may write it";
}

void say_once(const std::string& line) {
  static std::set<std::string> said;
  if (said.size() < 100 && said.insert(line).second) warn("{}", line);
}

}  // namespace

std::optional<KeyPair> own_key() {
  const fs::path path = config_folder() / "key";
  struct stat st {};
  if (stat(path.c_str(), &st) != 0) return std::nullopt;
  if ((st.st_mode & 0077) != 0)
    throw ConfigError(path.string() + " is open to other users; expected mode 0600");
  std::ifstream file(path);
  KeyPair keys;
  std::array<char, kKeyLength + 1> derived{};
  if (!(file >> keys.public_key >> keys.secret_key) || !is_key(keys.secret_key) ||
      zmq_curve_public(derived.data(), keys.secret_key.c_str()) != 0 ||
      keys.public_key != derived.data()) {
    throw ConfigError(path.string() + ": expected a public key and its secret key, a line each");
  }
  return keys;
}

KeyPair make_key(bool replace) {
  const fs::path path = config_folder() / "key";
  if (!replace && fs::exists(path))
    throw ConfigError(path.string() + " exists: --replace makes a new key, which no host trusts");
  std::array<char, kKeyLength + 1> public_key{}, secret_key{};
  do {
    if (zmq_curve_keypair(public_key.data(), secret_key.data()) != 0)
      throw ConfigError(std::string("no keys: ") + zmq_strerror(errno));
  } while (std::isalnum(static_cast<unsigned char>(public_key[0])) == 0);  // "-..." is an option
  write_file(path, std::string(public_key.data()) + "\n" + secret_key.data() + "\n");
  return {public_key.data(), secret_key.data()};
}

std::map<std::string, std::string> trusted_keys() {
  std::map<std::string, std::string> keys;
  for (const fs::path& path : {config_folder() / "trusted", fs::path("/etc/mimesis/trusted")}) {
    if (const std::string why = unsafe(path); !why.empty()) {
      say_once(why + ", so none of its keys is trusted");
      continue;
    }
    std::ifstream file(path);
    for (auto [number, line] = std::pair(1, std::string()); std::getline(file, line); ++number) {
      std::istringstream words(line);
      std::string key, name;
      if (words >> key >> name && is_key(key))  // which may begin with #, too
        keys.emplace(key, name);
      else if (!key.empty() && key.front() != '#')
        say_once(fmt::format("{}:{}: ignored, expected a key of {} characters and a name",
                             path.string(), number, kKeyLength));
    }
  }
  return keys;
}

void trust_key(const std::string& name, const std::string& key) {
  if (!is_key(key)) {
    throw ConfigError("'" + key +
                      "' is no key: expected the 40 characters that `mimesis key show` "
                      "prints on host " +
                      name);
  }
  const fs::path path = config_folder() / "trusted";
  if (const std::string why = unsafe(path); !why.empty()) throw ConfigError(why);
  std::string text;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with(key + " ")) text += line + "\n";
  }
  write_file(path, text + key + " " + name + "\n");
}

std::vector<std::string> untrust_key(const std::string& name_or_key) {
  const fs::path path = config_folder() / "trusted";
  std::vector<std::string> gone;
  std::string text;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string key, name;
    words >> key >> name;
    if (key == name_or_key || name == name_or_key) {
      gone.push_back(key);
    } else {
      text += line + "\n";
    }
  }
  file.close();
  if (!gone.empty()) write_file(path, text);
  for (const auto& [key, name] : trusted_keys()) {
    if (key == name_or_key || name == name_or_key)
      throw ConfigError("'" + name_or_key +
                        "' stands in /etc/mimesis/trusted, too: remove the line there");
  }
  if (gone.empty()) throw ConfigError("'" + name_or_key + "': no trusted key has this name");
  return gone;
}

std::string tcp_at(const std::string& address) {
  return address.find(':') == std::string::npos ? "tcp://" + address : "tcp://[" + address + "]";
}

bool leaves_host(const std::string& endpoint) {
  return endpoint.starts_with("tcp://") && !endpoint.starts_with("tcp://127.") &&
         !endpoint.starts_with("tcp://[::1]");
}

}  // namespace mimesis::runtime
