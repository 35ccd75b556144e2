#include "tools/mimesis/log/lockstep_player.h"

#include <map>

#include "common/runtime/raw.h"
#include "common/runtime/run_node.h"
#include "common/runtime/zmq_bus.h"

namespace mimesis::tool {
namespace {

using runtime::Time;
constexpr std::uint64_t kYear2000Ns = 946'684'800'000'000'000;  // later log times are wall time

/// Recorded graph times are kept, so that stamps in the messages stay true; wall times start at 0.
class LockstepPlayer final : public runtime::AnyNode {
 public:
  explicit LockstepPlayer(const PlayOptions& options)
      : rate_hz_(options.step_rate_hz), playback_(options.file, options.playback) {
    if (playback_.start_time_ns() > kYear2000Ns) shift_ns_ = playback_.start_time_ns();
  }

  void visit(runtime::ParamVisitor& v) override { v("rate_hz", rate_hz_, 1.0, 1e5); }
  void create(runtime::Bus& bus) override {
    auto* zmq = dynamic_cast<runtime::ZmqBus*>(&bus);
    MIMESIS_ASSERT(zmq != nullptr);
    for (const PlayedTopic& topic : playback_.topics()) {
      outs_[&topic] = zmq->advertise_raw(topic.topic, topic.type, topic.descriptors,
                                         {.latched = topic.latched});
    }
  }
  void step(Time now) override {
    if (!started_) {
      started_ = true;
      for (const auto& [topic, payload] : playback_.latched()) {
        outs_[topic]->send_raw(payload, graph_time(playback_.start_time_ns()));
      }
      more_ = playback_.next(next_);
    }
    for (; more_ && graph_time(next_.log_time_ns) <= now; more_ = playback_.next(next_)) {
      outs_[next_.topic]->send_raw(next_.payload, graph_time(next_.publish_time_ns));
    }
  }
  void stop(Time) noexcept override { outs_.clear(); }
  bool recorded() const override { return false; }  // it is a log already
  double rate_hz() const override { return rate_hz_; }
  double offset_s() const override { return 0.0; }

 private:
  Time graph_time(std::uint64_t ns) const {
    return Time(static_cast<std::int64_t>(ns < shift_ns_ ? 0 : ns - shift_ns_));
  }

  double rate_hz_;
  Playback playback_;
  std::uint64_t shift_ns_ = 0;
  std::map<const PlayedTopic*, std::unique_ptr<runtime::RawOut>> outs_;
  bool started_ = false, more_ = false;
  Played next_;
};

}  // namespace

int play_in_lockstep(const PlayOptions& options) {
  LockstepPlayer player(options);
  std::vector<std::string> words{
      "mimesis", "--name", options.name, "--graph", runtime::graph_name(), "--clock", "lockstep"};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  return runtime::run(static_cast<int>(words.size()), argv.data(),
                      {.name = "player", .about = "Plays a log in lock-step"}, player);
}

}  // namespace mimesis::tool
