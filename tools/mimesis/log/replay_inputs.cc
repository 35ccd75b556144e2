#include "tools/mimesis/log/replay_inputs.h"

#include <algorithm>

namespace mimesis::tool {
namespace {

std::size_t size_of(const KeptMessage& message) {
  return message.payload.size() + sizeof(KeptMessage);
}

}  // namespace

void WaitingInputs::add_port(const std::string& topic, const std::string& port, bool latest) {
  ports_[topic][port] = {latest, 0};
}

void WaitingInputs::add_publisher(const std::string& topic, std::uint64_t start_id) {
  if (const auto it = ports_.find(topic); it != ports_.end()) {
    tracks_[{topic, start_id}].ports = it->second;
  }
}

bool WaitingInputs::has_publisher(const std::string& topic, std::uint64_t start_id) const {
  return tracks_.contains({topic, start_id});
}

void WaitingInputs::keep(const std::string& topic, std::uint64_t start_id, KeptMessage message) {
  const auto it = tracks_.find({topic, start_id});
  if (it == tracks_.end()) return;
  Track& track = it->second;
  if (message.seq <= std::max(track.done, track.let_go)) return;  // repeated at a split's head
  const std::size_t size = size_of(message);
  if (!track.messages.try_emplace(message.seq, std::move(message)).second) return;
  track.bytes += size;
  bytes_ += size;
  if (bytes_ > most_bytes_) limit_bytes();
}

const KeptMessage* WaitingInputs::find(const v1::InputSource& source, std::uint64_t seq) const {
  const auto track = tracks_.find({source.topic(), source.start_id()});
  if (track == tracks_.end()) return nullptr;
  const auto message = track->second.messages.find(logged_seq(seq));
  return message == track->second.messages.end() ? nullptr : &message->second;
}

void WaitingInputs::take(const v1::InputSource& source, std::uint64_t seq) {
  const auto track = tracks_.find({source.topic(), source.start_id()});
  if (track == tracks_.end()) return;
  std::uint64_t& taken = track->second.ports[source.port()].taken;
  taken = std::max(taken, logged_seq(seq));
}

bool WaitingInputs::was_let_go(const v1::InputSource& source, std::uint64_t seq) const {
  const auto track = tracks_.find({source.topic(), source.start_id()});
  return track != tracks_.end() && logged_seq(seq) > track->second.done &&
         logged_seq(seq) <= track->second.let_go;
}

void WaitingInputs::forget(std::uint64_t time_ns) {
  for (auto& [key, track] : tracks_) {
    std::uint64_t everywhere = ~0ull, in_queues = ~0ull;
    for (const auto& [name, port] : track.ports) {
      everywhere = std::min(everywhere, port.taken);
      if (!port.latest) in_queues = std::min(in_queues, port.taken);
    }
    track.done = std::max(track.done, everywhere);
    Messages& messages = track.messages;
    while (!messages.empty() && messages.begin()->first <= track.done) drop_first(track);
    // What a newer message has replaced before the step was never seen by those that keep one.
    while (messages.size() > 1 && messages.begin()->first <= in_queues &&
           std::next(messages.begin())->second.log_time_ns + kLate < time_ns) {
      drop_first(track);
    }
  }
}

void WaitingInputs::drop_first(Track& track) {
  const auto first = track.messages.begin();
  track.bytes -= size_of(first->second);
  bytes_ -= size_of(first->second);
  track.messages.erase(first);
}

/// The one that holds most loses its oldest; never its newest, which is the likeliest to be taken.
void WaitingInputs::limit_bytes() {
  while (bytes_ > most_bytes_) {
    Track* largest = nullptr;
    for (auto& [key, track] : tracks_) {
      if (track.messages.size() > 1 && (largest == nullptr || track.bytes > largest->bytes)) {
        largest = &track;
      }
    }
    if (largest == nullptr) return;
    largest->let_go = largest->messages.begin()->first;
    drop_first(*largest);
  }
}

}  // namespace mimesis::tool
