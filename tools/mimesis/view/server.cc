#include "tools/mimesis/view/server.h"

#include <fmt/format.h>
#include <sodium.h>

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <condition_variable>
#include <deque>
#include <fstream>
#include <mutex>
#include <random>
#include <thread>

#include "common/error.h"
#include "tools/mimesis/view/gathered_stream.h"

namespace mimesis::view {

struct File {
  std::string type, content;
};

namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
namespace net = boost::asio;
using tcp = net::ip::tcp;
using Payload = std::shared_ptr<const std::string>;
using HttpRequest = http::request<http::string_body>;
using HttpResponse = http::response<http::string_body>;

// Seats of those who say the key, and of strangers: these leave those free.
constexpr std::size_t kMostClients = 64, kMostStrangers = 32, kMostControl = 4096;
constexpr std::size_t kLargestOfStranger = 64 << 10;  // they subscribe, and no more [bytes]
constexpr std::size_t kMostAsked = 1024;              // requests that wait for the owner
constexpr std::chrono::seconds kHttpPatience{10};
constexpr std::chrono::milliseconds kPause{100};  // before a connection is accepted again

std::string media_type(const std::filesystem::path& file) {
  static const std::map<std::string, std::string, std::less<>> kTypes{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript"},
      {".css", "text/css"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".json", "application/json"}};
  const auto type = kTypes.find(file.extension().string());
  return type == kTypes.end() ? "application/octet-stream" : type->second;
}

std::map<std::string, File, std::less<>> read_page(const std::filesystem::path& folder) {
  std::map<std::string, File, std::less<>> files;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, ignored)) {
    if (!entry.is_regular_file(ignored)) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    files["/" + entry.path().lexically_relative(folder).generic_string()] = {
        media_type(entry.path()), std::string(std::istreambuf_iterator<char>(in), {})};
  }
  const auto index = files.find("/index.html");
  if (index != files.end()) {
    files["/"] = index->second;
  } else {
    files["/"] = {"text/plain",
                  "The page is not there (cmake --build build --target page). Foxglove and "
                  "Lichtblick can connect to this address.\n"};
  }
  return files;
}

bool same(std::string_view a, std::string_view b) {
  return a.size() == b.size() && sodium_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::string_view plain(beast::string_view text) { return {text.data(), text.size()}; }

/// Target without what follows '?', and the key in that.
std::pair<std::string_view, std::string_view> split(std::string_view target) {
  const std::size_t mark = target.find('?');
  if (mark == target.npos) return {target, {}};
  std::string_view rest = target.substr(mark + 1), key;
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    if (pair.starts_with("key=")) key = pair.substr(4);
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
  }
  return {target.substr(0, mark), key};
}

/// A page of elsewhere may name this computer as it likes: a browser says by which name it came.
bool is_loopback_name(std::string_view host) {
  if (host.starts_with("[")) return host.starts_with("[::1]");
  const std::string_view name = host.substr(0, host.rfind(':'));
  return name == "localhost" || name == "127.0.0.1";
}

}  // namespace

/// All but the mutex-guarded members belongs to the server's thread.
struct Server::Impl {
  class Client;
  class Visit;

  explicit Impl(const ServerOptions& o) : options(o), files(read_page(o.page)), acceptor(io) {
    if (sodium_init() < 0) throw ConfigError("libsodium cannot start");
    const std::string where = fmt::format("{}:{}", options.address, options.port);
    boost::system::error_code error;
    const auto address = net::ip::make_address(options.address, error);
    if (error) throw ConfigError(fmt::format("'{}' is no IP address", options.address));
    const tcp::endpoint endpoint(address, options.port);
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(net::socket_base::reuse_address(true), error);
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(net::socket_base::max_listen_connections, error);
    if (error) throw ConfigError(fmt::format("cannot listen on {}: {}", where, error.message()));
    session = fmt::format("{:08x}{:08x}", std::random_device{}(), std::random_device{}());
    accept();
    thread = std::thread([this] { io.run(); });
  }
  ~Impl() {
    io.stop();
    thread.join();
  }

  void accept();
  void flush();
  /// For all clients.
  void control(const std::string& text);
  void send_graph(const Connections& now, const Connections& before);
  void ask(std::uint64_t client, Request request);
  void set_wanted(std::uint32_t channel, int change) {
    const std::lock_guard lock(mutex);
    int& count = listeners[channel];
    count += change;
    if (count == 0) {
      listeners.erase(channel);
      latched.erase(channel);  // nobody follows it now: it may become old
    }
  }
  const Channel* find(std::uint32_t id) const {
    const auto it = std::ranges::find(channels, id, &Channel::id);
    return it == channels.end() ? nullptr : &*it;
  }

  ServerOptions options;
  std::map<std::string, File, std::less<>> files;
  std::string session;
  std::vector<Channel> channels;
  std::vector<Service> services;
  Connections connections;
  struct Last {
    Payload payload;
    std::uint64_t ns;
  };
  std::map<std::uint32_t, Last> latched;  ///< of channels that somebody listens to
  std::map<std::uint64_t, std::weak_ptr<Client>> clients;
  std::uint64_t next_client = 1;
  std::atomic<std::uint64_t> open{0}, strangers{0}, sent{0}, left_out{0}, refused{0};

  mutable std::mutex mutex;
  std::map<std::uint32_t, int> listeners;  ///< number of clients by channel
  struct Outgoing {
    std::uint32_t channel;
    std::uint64_t ns;
    Payload payload;
  };
  std::vector<Outgoing> outbox;
  std::deque<Asked> asked;
  std::condition_variable news;

  net::io_context io{1};  // after what clients use: they end with it
  tcp::acceptor acceptor;
  net::steady_timer pause{io};
  std::thread thread;
};

/// One WebSocket.
class Server::Impl::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Impl& server, beast::tcp_stream stream, bool trusted)
      : server_(server),
        socket_(GatheredStream(std::move(stream))),
        trusted_(trusted),
        id_(server.next_client++) {
    ++server_.open;
    if (!trusted_) ++server_.strangers;
  }
  ~Client() {
    for (const auto& [channel, subscription] : subscriptions_) server_.set_wanted(channel, -1);
    server_.clients.erase(id_);
    --server_.open;
    if (!trusted_) --server_.strangers;
  }

  void start(const HttpRequest& request, std::string_view subprotocol) {
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.set_option(websocket::stream_base::decorator([subprotocol](auto& response) {
      response.set(http::field::sec_websocket_protocol,
                   beast::string_view(subprotocol.data(), subprotocol.size()));
    }));
    const std::size_t largest = server_.options.largest_request;
    socket_.read_message_max(trusted_ ? largest : std::min(largest, kLargestOfStranger));
    socket_.auto_fragment(false);
    socket_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
      if (!error) self->greet();
    });
  }

  void control(std::string bytes, bool binary = false) {
    if (control_.size() >= kMostControl) return close();  // it reads nothing
    control_.push_back({std::move(bytes), binary});
    write();
  }
  void send(std::uint32_t channel, std::uint64_t ns, const Payload& payload) {
    const auto it = subscriptions_.find(channel);
    if (it == subscriptions_.end()) return;
    data_.push_back({channel, message_header(it->second, ns), payload});
    bytes_ += payload->size();
    bytes_of_[channel] += payload->size();
    while (data_.size() > 1 && (bytes_ > server_.options.backlog_bytes ||
                                data_.size() > server_.options.backlog_messages))
      leave_out();
    write();
  }
  bool trusted() const { return trusted_; }
  bool watches_connections() const { return watches_connections_; }
  bool watches(const std::string& parameter) const { return watched_.contains(parameter); }
  /// The channel is gone.
  void forget(std::uint32_t channel) {
    if (subscriptions_.erase(channel) > 0) server_.set_wanted(channel, -1);
  }

 private:
  struct Control {
    std::string bytes;
    bool binary;
  };
  struct Data {
    std::uint32_t channel;
    MessageHeader header;
    Payload payload;
  };

  void greet() {
    server_.clients[id_] = weak_from_this();
    const ServerOptions& o = server_.options;
    control(server_info(o.name, server_.session, o.metadata, trusted_));
    if (!server_.channels.empty()) control(advertise(server_.channels));
    if (trusted_ && !server_.services.empty()) control(advertise_services(server_.services));
    read();
  }
  void close() {
    beast::error_code ignored;
    beast::get_lowest_layer(socket_).socket().close(ignored);
  }

  void read() {
    socket_.async_read(in_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error) return;
      const std::string_view bytes(static_cast<const char*>(self->in_.data().data()),
                                   self->in_.size());
      self->take(self->socket_.got_text() ? parse_text(bytes) : parse_binary(bytes));
      self->in_.consume(self->in_.size());
      self->read();
    });
  }

  void take(tl::expected<Request, std::string> request) {
    if (!request) return control(status(Level::error, request.error()));
    std::visit([this](auto& r) { handle(r); }, *request);
  }
  void handle(Subscribe& all) {
    for (const auto& [subscription, channel] : all.subscriptions) {
      const Channel* known = server_.find(channel);
      if (known == nullptr) {
        if (control_.size() >= kMostControl) return close();
        control(status(Level::warning, fmt::format("there is no channel {}", channel)));
        continue;
      }
      if (!subscriptions_.emplace(channel, subscription).second) {
        control(status(Level::warning, known->topic + " is subscribed already"));
        continue;
      }
      channels_[subscription] = channel;
      server_.set_wanted(channel, +1);
      if (const auto last = server_.latched.find(channel); last != server_.latched.end())
        send(channel, last->second.ns, last->second.payload);
    }
  }
  void handle(Unsubscribe& all) {
    for (const std::uint32_t subscription : all.subscriptions) {
      const auto channel = channels_.find(subscription);
      if (channel == channels_.end()) continue;
      forget(channel->second);
      channels_.erase(channel);
    }
  }
  void handle(WatchConnections& watch) {
    watches_connections_ = watch.on;
    if (watch.on) control(connection_graph(server_.connections, {}));
  }
  void handle(WatchParameters& watch) {
    for (std::string& name : watch.names) {
      if (!watch.on) {
        watched_.erase(name);
      } else if (watched_.size() < kMostControl) {
        watched_.insert(std::move(name));
      }
    }
  }
  template <class R>
  void handle(R& request) {
    if (!trusted_)
      return control(status(Level::error,
                            "only who opens the page by the whole address that was printed, with "
                            "its key, may see and change parameters and call services"));
    server_.ask(id_, std::move(request));
  }

  /// The oldest message of the channel with most bytes: pictures do not starve numbers.
  void leave_out() {
    const auto most = std::ranges::max_element(
        bytes_of_, {}, &std::pair<const std::uint32_t, std::size_t>::second);
    auto oldest = std::ranges::find(data_, most->first, &Data::channel);
    if (oldest == data_.end()) oldest = data_.begin();
    const std::uint32_t channel = oldest->channel;
    taken(*oldest);
    data_.erase(oldest);
    ++server_.left_out, ++left_out_;
    const auto now = std::chrono::steady_clock::now();
    if (now < next_word_) return;
    next_word_ = now + std::chrono::seconds(1);
    const Channel* known = server_.find(channel);
    control(
        status(Level::warning,
               fmt::format("this connection is slow: {} messages were left out so far, last of {}",
                           left_out_, known == nullptr ? "?" : known->topic),
               "slow"));
  }
  void taken(const Data& data) {
    bytes_ -= data.payload->size();
    bytes_of_[data.channel] -= data.payload->size();
  }

  void write() {
    if (writing_) return;
    const auto done = [self = shared_from_this()](beast::error_code error, std::size_t) {
      self->writing_ = false;
      if (!error) self->write();
    };
    if (!control_.empty()) {
      now_control_ = std::move(control_.front());
      control_.pop_front();
      writing_ = true;
      socket_.next_layer().expect_more(!control_.empty() || !data_.empty());
      socket_.binary(now_control_.binary);
      socket_.async_write(net::buffer(now_control_.bytes), done);
    } else if (!data_.empty()) {
      now_ = std::move(data_.front());
      data_.pop_front();
      taken(now_);
      ++server_.sent;
      writing_ = true;
      socket_.next_layer().expect_more(!data_.empty());
      socket_.binary(true);
      socket_.async_write(
          std::array<net::const_buffer, 2>{net::buffer(now_.header), net::buffer(*now_.payload)},
          done);
    }
  }

  Impl& server_;
  websocket::stream<GatheredStream> socket_;
  const bool trusted_;
  const std::uint64_t id_;
  beast::flat_buffer in_;
  std::map<std::uint32_t, std::uint32_t> subscriptions_;  ///< by channel
  std::map<std::uint32_t, std::uint32_t> channels_;       ///< by subscription
  std::set<std::string> watched_;
  bool watches_connections_ = false, writing_ = false;
  std::deque<Control> control_;
  std::deque<Data> data_;
  Control now_control_{};
  Data now_{};  ///< being written
  std::size_t bytes_ = 0;
  std::map<std::uint32_t, std::size_t> bytes_of_;  ///< in data_, by channel
  std::uint64_t left_out_ = 0;
  std::chrono::steady_clock::time_point next_word_{};
};

/// One request by HTTP: a file, or the begin of a WebSocket.
class Server::Impl::Visit : public std::enable_shared_from_this<Visit> {
 public:
  Visit(Impl& server, tcp::socket socket) : server_(server), stream_(std::move(socket)) {
    parser_.header_limit(8192);
    parser_.body_limit(0);
  }
  void start() {
    stream_.expires_after(kHttpPatience);
    http::async_read(stream_, buffer_, parser_,
                     [self = shared_from_this()](beast::error_code error, std::size_t) {
                       if (!error) self->take(self->parser_.get());
                     });
  }

 private:
  void take(const HttpRequest& request) {
    const auto [path, key] = split(plain(request.target()));
    if (websocket::is_upgrade(request)) return upgrade(request, key);
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return answer(request, http::status::method_not_allowed, {"text/plain", "GET alone\n"});
    const auto file = server_.files.find(path);
    if (file == server_.files.end())
      return answer(request, http::status::not_found, {"text/plain", "no such file\n"});
    answer(request, http::status::ok, file->second);
  }

  void upgrade(const HttpRequest& request, std::string_view key) {
    const bool trusted = same(key, server_.options.key);
    if (const char* why = trusted ? nullptr : stranger(request)) {
      return answer(request, http::status::forbidden, {"text/plain", std::string(why) + "\n"});
    }
    const std::uint64_t untrusted = server_.strangers;
    const std::uint64_t seated = trusted ? server_.open - untrusted : untrusted;
    if (seated >= (trusted ? kMostClients : kMostStrangers))
      return answer(request, http::status::service_unavailable,
                    {"text/plain", "too many clients\n"});
    const auto offered = request[http::field::sec_websocket_protocol];
    for (const std::string_view known : kSubprotocols) {
      if (!http::token_list(offered).exists(beast::string_view(known.data(), known.size())))
        continue;
      stream_.expires_never();
      std::make_shared<Client>(server_, std::move(stream_), trusted)->start(request, known);
      return;
    }
    answer(request, http::status::bad_request,
           {"text/plain",
            fmt::format("expected a subprotocol {} or {}\n", kSubprotocols[0], kSubprotocols[1])});
  }

  /// Why somebody without the key may not even look; null: he may.
  const char* stranger(const HttpRequest& request) const {
    beast::error_code error;
    const auto peer = stream_.socket().remote_endpoint(error);
    const std::string_view host = plain(request[http::field::host]);
    if (error || !peer.address().is_loopback() || !is_loopback_name(host))
      return "from another computer the address needs ?key=KEY, as printed at the start";
    const std::string_view origin = plain(request[http::field::origin]);
    const bool own = origin.empty() || origin == fmt::format("http://{}", host);
    if (!own && std::ranges::find(server_.options.origins, origin) == server_.options.origins.end())
      return "a page from elsewhere: mimesis view --origin, or ?key=KEY in the address";
    return nullptr;
  }

  void answer(const HttpRequest& request, http::status status, const File& file) {
    if (status != http::status::ok) ++server_.refused;
    response_ = {status, request.version()};
    response_.set(http::field::content_type, file.type);
    response_.set(http::field::cache_control, "no-cache");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set("Referrer-Policy", "no-referrer");  // the address holds the key
    response_.set(
        "Content-Security-Policy",
        "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
        "connect-src 'self' ws:; frame-ancestors 'none'");
    if (request.method() == http::verb::head) {
      response_.content_length(file.content.size());
    } else {
      response_.body() = file.content;
      response_.prepare_payload();
    }
    response_.keep_alive(false);
    stream_.expires_after(kHttpPatience);
    http::async_write(stream_, response_,
                      [self = shared_from_this()](beast::error_code, std::size_t) {
                        beast::error_code ignored;
                        self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
                      });
  }

  Impl& server_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  http::request_parser<http::string_body> parser_;
  HttpResponse response_;
};

void Server::Impl::accept() {
  acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
    if (!error) {
      beast::error_code ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      std::make_shared<Visit>(*this, std::move(socket))->start();
      return accept();
    }
    pause.expires_after(kPause);  // no descriptors are left, for instance
    pause.async_wait([this](beast::error_code) { accept(); });
  });
}

void Server::Impl::control(const std::string& text) {
  for (const auto& [id, client] : clients) {
    if (const auto c = client.lock()) c->control(text);
  }
}

void Server::Impl::send_graph(const Connections& now, const Connections& before) {
  const std::string text = connection_graph(now, before);
  for (const auto& [id, client] : clients) {
    if (const auto c = client.lock(); c && c->watches_connections()) c->control(text);
  }
}

void Server::Impl::ask(std::uint64_t client, Request request) {
  const std::lock_guard lock(mutex);
  if (asked.size() < kMostAsked) asked.push_back({client, std::move(request)});
  news.notify_one();
}

void Server::Impl::flush() {
  std::vector<Outgoing> messages;
  {
    const std::lock_guard lock(mutex);
    messages.swap(outbox);
  }
  for (const Outgoing& m : messages) {
    const Channel* channel = find(m.channel);
    if (channel == nullptr) continue;
    if (channel->latched) latched[m.channel] = {m.payload, m.ns};
    for (const auto& [id, client] : clients) {
      if (const auto c = client.lock()) c->send(m.channel, m.ns, m.payload);
    }
  }
}

Server::Server(const ServerOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Server::~Server() = default;

std::uint16_t Server::port() const { return impl_->acceptor.local_endpoint().port(); }

std::string Server::url() const {
  const auto address = impl_->acceptor.local_endpoint().address();
  const std::string host = address.is_v6() ? "[" + address.to_string() + "]" : address.to_string();
  return fmt::format("http://{}:{}/?key={}", host, port(), impl_->options.key);
}

void Server::announce(std::vector<Channel> channels) {
  net::post(impl_->io, [s = impl_.get(), now = std::move(channels)]() mutable {
    std::vector<Channel> added;
    std::vector<std::uint32_t> removed;
    for (const Channel& c : now) {
      if (s->find(c.id) == nullptr) added.push_back(c);
    }
    for (const Channel& c : s->channels) {
      if (std::ranges::find(now, c.id, &Channel::id) == now.end()) removed.push_back(c.id);
    }
    s->channels = std::move(now);
    if (!removed.empty()) s->control(unadvertise(removed));
    for (const std::uint32_t id : removed) {
      for (const auto& [client_id, client] : s->clients) {
        if (const auto c = client.lock()) c->forget(id);
      }
    }
    if (!added.empty()) s->control(advertise(added));
  });
}

void Server::announce(std::vector<Service> services) {
  net::post(impl_->io, [s = impl_.get(), now = std::move(services)]() mutable {
    std::vector<Service> added;
    std::vector<std::uint32_t> removed;
    for (const Service& one : now) {
      if (std::ranges::find(s->services, one.id, &Service::id) == s->services.end())
        added.push_back(one);
    }
    for (const Service& one : s->services) {
      if (std::ranges::find(now, one.id, &Service::id) == now.end()) removed.push_back(one.id);
    }
    s->services = std::move(now);
    for (const auto& [id, client] : s->clients) {
      const auto c = client.lock();
      if (!c || !c->trusted()) continue;
      if (!removed.empty()) c->control(unadvertise_services(removed));
      if (!added.empty()) c->control(advertise_services(added));
    }
  });
}

void Server::announce(Connections connections) {
  net::post(impl_->io, [s = impl_.get(), now = std::move(connections)]() mutable {
    if (now == s->connections) return;
    std::swap(s->connections, now);
    s->send_graph(s->connections, now);
  });
}

std::set<std::uint32_t> Server::wanted() const {
  const std::lock_guard lock(impl_->mutex);
  std::set<std::uint32_t> channels;
  for (const auto& [channel, count] : impl_->listeners) channels.insert(channel);
  return channels;
}

void Server::send(std::uint32_t channel, std::string payload, std::uint64_t ns) {
  bool first = false;
  {
    const std::lock_guard lock(impl_->mutex);
    first = impl_->outbox.empty();
    impl_->outbox.push_back({channel, ns, std::make_shared<const std::string>(std::move(payload))});
  }
  if (first) net::post(impl_->io, [s = impl_.get()] { s->flush(); });
}

void Server::send_time(std::uint64_t ns) {
  net::post(impl_->io, [s = impl_.get(), bytes = time(ns)] {
    for (const auto& [id, client] : s->clients) {
      if (const auto c = client.lock()) c->control(bytes, true);
    }
  });
}

std::optional<Server::Asked> Server::asked(std::chrono::milliseconds patience) {
  std::unique_lock lock(impl_->mutex);
  if (!impl_->news.wait_for(lock, patience, [&] { return !impl_->asked.empty(); }))
    return std::nullopt;
  Asked first = std::move(impl_->asked.front());
  impl_->asked.pop_front();
  return first;
}

void Server::answer(std::uint64_t client, std::string text) {
  net::post(impl_->io, [s = impl_.get(), client, text = std::move(text)] {
    const auto it = s->clients.find(client);
    if (it == s->clients.end()) return;
    if (const auto c = it->second.lock()) c->control(text);
  });
}

void Server::answer_binary(std::uint64_t client, std::string bytes) {
  net::post(impl_->io, [s = impl_.get(), client, bytes = std::move(bytes)] {
    const auto it = s->clients.find(client);
    if (it == s->clients.end()) return;
    if (const auto c = it->second.lock()) c->control(bytes, true);
  });
}

void Server::tell(const std::vector<Parameter>& values) {
  net::post(impl_->io, [s = impl_.get(), values] {
    for (const auto& [id, client] : s->clients) {
      const auto c = client.lock();
      if (!c || !c->trusted()) continue;
      std::vector<Parameter> watched;
      std::ranges::copy_if(values, std::back_inserter(watched),
                           [&](const Parameter& p) { return c->watches(p.name); });
      if (!watched.empty()) c->control(parameter_values(watched, {}));
    }
  });
}

Server::Counters Server::counters() const {
  return {impl_->open, impl_->sent, impl_->left_out, impl_->refused};
}

}  // namespace mimesis::view
