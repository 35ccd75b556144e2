#include "hw/cia402/sdo_transfer.h"

#include <fmt/core.h>

#include <algorithm>

namespace mimesis::hw::cia402 {
namespace {

using can::Frame;

constexpr std::size_t kPerSegment = 7, kMostBytes = 1u << 16;
constexpr std::uint32_t kToggle = 0x05030000, kCommand = 0x05040001, kNoMemory = 0x05040005;

std::uint32_t number(const std::vector<std::uint8_t>& data) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < data.size(); ++i) value |= std::uint32_t{data[i]} << 8 * i;
  return value;
}

}  // namespace

Frame SdoTransfer::first() const {
  if (up_) return sdo_upload(node_, object_);
  const std::size_t size = data_.size();
  if (size >= 1 && size <= 4)
    return sdo_download(node_, object_, number(data_), static_cast<int>(size));
  Frame frame = sdo_upload(node_, object_);
  frame.data[0] = 0x21;  // segments of a size that bytes 4 to 7 tell
  for (std::size_t i = 0; i < 4; ++i) frame.data[4 + i] = static_cast<std::uint8_t>(size >> 8 * i);
  return frame;
}

/// The next segment, or the request for it.
Frame SdoTransfer::segment_request() const {
  Frame frame = sdo_upload(node_, {});
  const unsigned toggle = toggle_ ? 0x10 : 0;
  frame.data.fill(0);
  if (up_) {
    frame.data[0] = static_cast<std::uint8_t>(0x60u | toggle);
    return frame;
  }
  const std::size_t count = std::min(kPerSegment, data_.size() - sent_);
  const bool last = sent_ + count == data_.size();
  frame.data[0] = static_cast<std::uint8_t>(toggle | (kPerSegment - count) << 1 | (last ? 1u : 0u));
  std::copy_n(data_.begin() + static_cast<std::ptrdiff_t>(sent_), count, frame.data.begin() + 1);
  return frame;
}

std::optional<Frame> SdoTransfer::finish(std::string failure) {
  done_ = true;
  failure_ = std::move(failure);
  return std::nullopt;
}

std::optional<Frame> SdoTransfer::give_up(std::uint32_t code, const std::string& why) {
  finish(why);
  Frame frame = sdo_abort(node_, object_, code);
  frame.id = sdo_upload(node_, object_).id;  // from the client
  return frame;
}

std::optional<Frame> SdoTransfer::handle(const Frame& frame) {
  const Identity id = identify(frame);
  if (done_ || id.kind != Identity::Kind::sdo_response || id.node != node_ || frame.length != 8)
    return std::nullopt;
  const Sdo answer = parse_sdo_response(frame);
  if (frame.data[0] == 0x80) return finish(abort_text(answer.value));
  if (!segments_ && answer.object != object_) return std::nullopt;  // to an earlier request
  return up_ ? on_upload(frame) : on_download(frame);
}

std::optional<Frame> SdoTransfer::on_upload(const Frame& frame) {
  const unsigned command = frame.data[0];
  if (!segments_) {
    if (command >> 5 != 2)
      return give_up(kCommand, fmt::format("answer 0x{:02X} to an upload", command));
    const bool sized = (command & 1u) != 0;
    if ((command & 2u) != 0) {
      const std::size_t size = sized ? 4 - (command >> 2 & 3u) : 4;
      data_.assign(frame.data.begin() + 4,
                   frame.data.begin() + 4 + static_cast<std::ptrdiff_t>(size));
      return finish();
    }
    if (sized) announced_ = *unsigned_at(frame, 4, 4);
    if (announced_.value_or(0) > kMostBytes)
      return give_up(kNoMemory, fmt::format("an object of {} bytes", *announced_));
    segments_ = true;
    return segment_request();
  }
  if (command >> 5 != 0)
    return give_up(kCommand, fmt::format("answer 0x{:02X} instead of a segment", command));
  if (((command & 0x10u) != 0) != toggle_) return give_up(kToggle, abort_text(kToggle));
  const std::size_t count = kPerSegment - (command >> 1 & 7u);
  data_.insert(data_.end(), frame.data.begin() + 1,
               frame.data.begin() + 1 + static_cast<std::ptrdiff_t>(count));
  if (data_.size() > kMostBytes)
    return give_up(kNoMemory, fmt::format("more than {} bytes", kMostBytes));
  toggle_ = !toggle_;
  if ((command & 1u) == 0) return segment_request();
  if (announced_ && *announced_ != data_.size())
    return finish(fmt::format("{} bytes announced, {} sent", *announced_, data_.size()));
  return finish();
}

std::optional<Frame> SdoTransfer::on_download(const Frame& frame) {
  const unsigned command = frame.data[0];
  const bool expedited = data_.size() >= 1 && data_.size() <= 4;
  if (!segments_) {
    if (command >> 5 != 3)
      return give_up(kCommand, fmt::format("answer 0x{:02X} to a download", command));
    if (expedited) return finish();
    segments_ = true;
    return segment_request();
  }
  if (command >> 5 != 1)
    return give_up(kCommand, fmt::format("answer 0x{:02X} to a segment", command));
  if (((command & 0x10u) != 0) != toggle_) return give_up(kToggle, abort_text(kToggle));
  sent_ += std::min(kPerSegment, data_.size() - sent_);
  toggle_ = !toggle_;
  if (sent_ == data_.size()) return finish();
  return segment_request();
}

}  // namespace mimesis::hw::cia402
