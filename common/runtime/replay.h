#pragma once
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "common/runtime/bus.h"
#include "common/runtime/run_node.h"
#include "common/runtime/zmq_bus.h"
#include "proto/steps.pb.h"

namespace google::protobuf {
class MessageLite;
}

namespace mimesis::runtime {

/// Runs `node` step by step on commands of the process at the other end of the stream socket `fd`
/// (v1.ReplayStep in, v1.ReplayOutcome out). Returns the exit code: 0 at the end of the stream.
int run_replay(const BusOptions& options, int fd, AnyNode& node);

/// A message on such a stream: its length (32 bits, little-endian), then its bytes. False: the
/// other end is gone.
bool write_packet(int fd, const google::protobuf::MessageLite& message);
/// False at the end of the stream, or if what arrives is no such message.
bool read_packet(int fd, google::protobuf::MessageLite& message);

/// A bus that gives a node the recorded inputs of a step and collects the node's outputs. No
/// sockets, no other nodes, no outside.
class ReplayBus final : public Bus {
 public:
  /// @param outputs  wiring: port -> topic; others publish on NODE/PORT
  ReplayBus(std::string node, bool lockstep,
            std::map<std::string, std::string, std::less<>> outputs);
  ~ReplayBus() override;

  /// The step to come: its messages wait at the inputs, its requests are answered now.
  void begin(const v1::ReplayStep& step);
  /// The node's actions since `begin`, with a note if it took or read less than the record holds.
  v1::ReplayOutcome end();

  std::unique_ptr<InChannel> subscribe(std::string_view port,
                                       const google::protobuf::Message& prototype,
                                       const InOptions& options) override;
  std::unique_ptr<OutChannel> advertise(std::string_view port,
                                        const google::protobuf::Message& prototype,
                                        const OutOptions& options) override;
  void serve(std::string_view name, const google::protobuf::Message& request,
             const google::protobuf::Message& response, Handler handler) override;
  tl::expected<std::string, Status> call(std::string_view service, const std::string& request,
                                         std::chrono::milliseconds timeout) override;
  bool lockstep() const override { return lockstep_; }
  Outside& outside() override { return outside_; }
  const std::string& node() const override { return node_; }
  /// A path that does not exist: a node that opens something there has forgotten Outside.
  const std::string& directory() const override { return directory_; }

  using Pending = std::deque<Received>;

 private:
  class ReplayedOutside final : public Outside {
   public:
    explicit ReplayedOutside(ReplayBus& bus) : bus_(bus) {}
    bool replaying() const override { return true; }
    void record(std::string_view, std::string_view) override {}
    std::string replay(std::string_view name) override;
    void written(std::string_view name, std::string_view bytes) override;

   private:
    ReplayBus& bus_;
  };
  void problem(std::string what);  // the first one counts

  std::string node_, directory_ = "/dev/null/replay";
  bool lockstep_;
  std::map<std::string, std::string, std::less<>> outputs_;
  ReplayedOutside outside_;
  std::map<std::string, std::shared_ptr<Pending>, std::less<>> inputs_;  ///< by port
  std::map<std::string, Handler, std::less<>> services_;
  std::deque<v1::OutsideBytes> reads_;  ///< bytes of this step, not yet read
  v1::ReplayOutcome outcome_;
};

}  // namespace mimesis::runtime
