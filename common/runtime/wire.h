#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/time.h"

namespace google::protobuf {
class Message;
}

namespace mimesis::runtime {

/// Header before every payload on the wire, after the topic and a NUL: five little-endian 64-bit
/// words.
struct WireHeader {
  std::uint64_t seq = 0;        ///< number within this publisher and topic, from 1 [1]
  Time stamp{};                 ///< graph time of the content
  std::uint64_t type_hash = 0;  ///< type_hash() of the payload's type
  std::uint64_t start_id = 0;   ///< start id of the publishing process
  std::uint64_t tick = 0;       ///< graph time of the publishing step [ns], 0 outside lock-step
};

/// Largest frame that a socket takes or a node publishes [bytes]: images have about 1 MB.
constexpr std::size_t kLargestMessage = std::size_t{64} << 20U;

/// Order of the numbers of one publisher's messages on one topic. A single number far from the
/// others (a forged one) changes nothing.
class SeqOrder {
 public:
  enum class Place { next, repetition, far };
  /// `lost`: numbers left out before `seq`, if it is `next`. A number more than kFar away counts
  /// once the one after it is beyond it, too: then the publisher really is there.
  Place place(std::uint64_t seq, std::uint64_t& lost) {
    lost = 0;
    const std::uint64_t distance = seq > last_ ? seq - last_ : last_ - seq;
    if (last_ != 0 && distance > kFar) {
      if (far_ == 0 || seq <= far_) {
        far_ = seq;
        return Place::far;
      }
    } else if (seq <= last_) {
      return Place::repetition;
    }
    if (last_ != 0 && seq > last_) lost = seq - last_ - 1;
    last_ = seq;
    far_ = 0;
    return Place::next;
  }

 private:
  static constexpr std::uint64_t kFar = 1000;
  std::uint64_t last_ = 0, far_ = 0;  // 0: none, as numbers count from 1
};

struct WireMessage {
  std::string_view topic;  ///< points into the frame
  WireHeader header;
};

/// First frame of a message.
std::string encode_frame(std::string_view topic, const WireHeader& header);
/// Overwrites the header in a frame of encode_frame: no allocation per message.
void rewrite_header(std::string& frame, const WireHeader& header);
/// Empty if `frame` is not a result of encode_frame (any bytes are safe to pass).
std::optional<WireMessage> decode_frame(std::string_view frame);

/// Exactly `message.ByteSizeLong()` bytes, asked before; maps in sorted order, so that equal runs
/// give equal logs.
void serialise(const google::protobuf::Message& message, void* out, std::size_t size);

/// Subscription to one topic and not to topics that begin alike.
std::string subscription(std::string_view topic);

/// Subscription by which a subscriber names itself to publishers. It sorts behind every topic, and
/// ZeroMQ sends subscriptions to a new connection in sorted order: a publisher that has seen it has
/// seen them all.
std::string hello(std::uint64_t start_id);
/// start_id of a hello, or nothing.
std::optional<std::uint64_t> decode_hello(std::string_view subscription);

/// Subscription, taken back at once, by which a reliable subscriber tells a publisher that it has
/// missed messages of it: only the receiver can know how many.
std::string missed(std::uint64_t publisher_start_id, std::uint64_t messages);
/// Number in a `missed` for this publisher, or nothing.
std::optional<std::uint64_t> decode_missed(std::string_view subscription,
                                           std::uint64_t publisher_start_id);

}  // namespace mimesis::runtime
