#pragma once
#include <google/protobuf/message.h>

#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/runtime/bus.h"

namespace mimesis::testing {

/// A bus in memory for one node under test: `send` feeds its inputs, `take` reads its outputs, by
/// port name.
class Loopback final : public runtime::Bus {
 public:
  /// Settings that a test may change.
  struct Options {
    bool lockstep;
    runtime::Outside* outside;  ///< null: nothing is recorded
  };
  Loopback() : Loopback({.lockstep = true, .outside = nullptr}) {}
  explicit Loopback(const Options& options);
  ~Loopback() override;

  /// Delivers `message` to input `port`, published at `stamp` by node `source`. The header is
  /// filled in.
  template <class M>
  void send(std::string_view port, M message, runtime::Time stamp,
            std::string_view source = "test") {
    if constexpr (requires { message.mutable_header()->set_stamp_ns(0); }) {
      message.mutable_header()->set_stamp_ns(static_cast<std::uint64_t>(stamp.count()));
    } else if constexpr (requires { message.mutable_timestamp()->set_seconds(0); }) {
      message.mutable_timestamp()->set_seconds(stamp.count() / 1'000'000'000);
      message.mutable_timestamp()->set_nanos(static_cast<int>(stamp.count() % 1'000'000'000));
    }
    send_raw(port, message.SerializeAsString(), stamp, source);
  }
  /// Delivers bytes as they are: malformed messages.
  void send_raw(std::string_view port, std::string payload, runtime::Time stamp,
                std::string_view source = "test");

  /// Oldest message the node published on `port` and not taken yet.
  template <class M>
  std::optional<M> take(std::string_view port) {
    M m;
    return take_raw(port, m) ? std::optional<M>(std::move(m)) : std::nullopt;
  }
  /// Newest message published on `port`; all older ones are discarded.
  template <class M>
  std::optional<M> take_last(std::string_view port) {
    std::optional<M> last;
    while (auto m = take<M>(port)) last = std::move(m);
    return last;
  }

  /// Everything published and not taken yet, serialised: what two runs are compared by.
  std::map<std::string, std::vector<std::string>> take_all();

  /// Counters of input `port`.
  runtime::InCounters counters(std::string_view port) const;

  std::unique_ptr<runtime::InChannel> subscribe(std::string_view port,
                                                const google::protobuf::Message& prototype,
                                                const runtime::InOptions& options) override;
  std::unique_ptr<runtime::OutChannel> advertise(std::string_view port,
                                                 const google::protobuf::Message& prototype,
                                                 const runtime::OutOptions& options) override;
  void serve(std::string_view name, const google::protobuf::Message& request,
             const google::protobuf::Message& response, runtime::Handler handler) override;
  tl::expected<std::string, Status> call(std::string_view service, const std::string& request,
                                         std::chrono::milliseconds timeout) override;
  bool lockstep() const override { return lockstep_; }
  runtime::Outside& outside() override { return outside_; }
  const std::string& node() const override { return node_; }
  /// a fresh temporary folder
  const std::string& directory() const override { return directory_; }

  /// What the test has sent to a port.
  struct Input {
    runtime::InOptions options;
    std::deque<runtime::Received> pending;
    runtime::InCounters counters;
    std::uint64_t seq = 0;
    std::string last_reject;
  };
  /// What the node has published on a port.
  struct Output {
    std::string type;
    std::deque<std::string> sent;
    std::uint64_t seq = 0;
  };

 private:
  bool take_raw(std::string_view port, google::protobuf::Message& out);

  bool lockstep_;
  runtime::LiveOutside live_;
  runtime::Outside& outside_;
  std::string node_ = "test";
  std::string directory_;
  std::map<std::string, std::shared_ptr<Input>, std::less<>> inputs_;
  std::map<std::string, std::shared_ptr<Output>, std::less<>> outputs_;
  std::map<std::string, runtime::Handler, std::less<>> services_;
};

}  // namespace mimesis::testing
