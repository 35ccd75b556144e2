#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/mimesis/view/protocol.h"

namespace mimesis::view {

struct ServerOptions {
  std::string name;                       ///< what clients see
  std::string address = "127.0.0.1";      ///< to listen on
  std::uint16_t port = 8765;              ///< 0: any that is free
  std::string key;                        ///< not empty
  std::filesystem::path page;             ///< folder of the page; its files are read once
  std::vector<std::string> origins = {};  ///< of foreign pages that may look, as https://host
  std::map<std::string, std::string> metadata = {};
  std::size_t backlog_bytes = 4 << 20;  ///< messages that wait for a slow client; then the oldest
                                        ///< of the topic with most bytes are left out
  std::size_t backlog_messages = 8192;
  std::size_t largest_request = 1 << 20;  ///< of those who say the key [bytes]
};

/// Serves the page, and messages by WebSocket, in a thread of its own. Calls below never wait for
/// a client. Who says the key (?key=KEY) may do all; others may look, if they are on this computer
/// and, as pages, came from here. Nothing that a client sends is a file name.
class Server {
 public:
  /// @throws ConfigError if the address cannot be listened on.
  explicit Server(const ServerOptions& options);
  ~Server();

  std::uint16_t port() const;
  /// URL of the page, with the key.
  std::string url() const;

  void announce(std::vector<Channel> channels);
  void announce(std::vector<Service> services);
  void announce(Connections connections);

  /// Channels that somebody listens to.
  std::set<std::uint32_t> wanted() const;
  /// `ns`: time of the content
  void send(std::uint32_t channel, std::string payload, std::uint64_t ns);
  void send_time(std::uint64_t ns);

  /// A request for the owner: parameters and services, of clients that may.
  struct Asked {
    std::uint64_t client;
    Request request;
  };
  /// Waits at most `patience`.
  std::optional<Asked> asked(std::chrono::milliseconds patience);
  void answer(std::uint64_t client, std::string text);
  void answer_binary(std::uint64_t client, std::string bytes);
  /// To all that watch one of these.
  void tell(const std::vector<Parameter>& values);

  struct Counters {
    std::uint64_t clients = 0, sent = 0, left_out = 0, refused = 0;
  };
  Counters counters() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mimesis::view
