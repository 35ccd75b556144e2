#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "common/runtime/bus.h"
#include "common/time.h"
#include "proto/steps.pb.h"

namespace mimesis::runtime {

/// Collects inputs and actions of a node's steps, for NODE/steps. Allocates nothing once its
/// buffers have grown.
class StepRecorder {
 public:
  /// Events from now on belong to this step; those since the last step, too (services
  /// are answered between steps).
  void begin(v1::StepKind kind, Time now);
  void end();

  void took(std::string_view port, std::string_view topic, const Received& message);
  void outside(std::string_view name, std::string_view bytes, bool written);
  void served(std::string_view service, const std::string& request,
              const tl::expected<std::string, Status>& response);
  void published() { open_.set_published(open_.published() + 1); }

  /// Time to publish: 0.1 s of graph time since the first step in it, or many bytes.
  bool due(Time now) const;
  /// The steps since the last call; valid until the next `begin`. Not between begin and end.
  v1::StepLog& take();

 private:
  void forget();

  v1::StepLog log_;
  v1::StepRecord open_;
  std::size_t bytes_ = 0;
  std::uint64_t steps_ = 0;  // ended so far
  bool taken_ = false;       // log_ was given away
};

/// The node's bus with all that passes it recorded.
class RecordedBus final : public Bus {
 public:
  /// `inner` and `recorder` outlive it. `inputs`: topic by port.
  RecordedBus(Bus& inner, StepRecorder& recorder,
              std::map<std::string, std::string, std::less<>> inputs);

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
  bool lockstep() const override { return inner_.lockstep(); }
  Outside& outside() override { return outside_; }
  const std::string& node() const override { return inner_.node(); }
  const std::string& directory() const override { return inner_.directory(); }

 private:
  class RecordingOutside final : public Outside {
   public:
    explicit RecordingOutside(StepRecorder& recorder) : recorder_(recorder) {}
    bool replaying() const override { return false; }
    void record(std::string_view name, std::string_view bytes) override {
      recorder_.outside(name, bytes, false);
    }
    std::string replay(std::string_view) override { return {}; }
    void written(std::string_view name, std::string_view bytes) override {
      recorder_.outside(name, bytes, true);
    }

   private:
    StepRecorder& recorder_;
  };

  Bus& inner_;
  StepRecorder& recorder_;
  RecordingOutside outside_;
  std::map<std::string, std::string, std::less<>> inputs_;
};

/// A call to another node as bytes for Outside: its answer or why there is none.
std::string encode_answer(const tl::expected<std::string, Status>& answer);
tl::expected<std::string, Status> decode_answer(const std::string& bytes);

}  // namespace mimesis::runtime
