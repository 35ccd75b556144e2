#include "nodes/vision/frame_check.h"

#include <fmt/core.h>

#include <algorithm>
#include <functional>

namespace mimesis::vision {

std::optional<std::string> FrameCheck::fault(std::string_view data, std::size_t height,
                                             double stamp_s) {
  constexpr int kSame = 10;  // frames: fewer are no stream
  const std::size_t row = data.size() / height;
  // A lost packet leaves a part of the frame empty; an empty frame is black.
  const std::size_t end = data.find_last_not_of('\0');
  const std::size_t filled = end == data.npos ? height : end / row + 1;
  if (height - filled > height / 50)
    return fmt::format("torn: the last {} of {} rows are empty", height - filled, height);

  Bands bands{};
  std::size_t whole = 0;
  for (std::size_t b = 0; b < kBands; ++b) {
    const std::size_t from = b * height / kBands, to = (b + 1) * height / kBands;
    const std::string_view band = data.substr(from * row, (to - from) * row);
    const std::size_t hash = std::hash<std::string_view>()(band);
    whole = 31 * whole + hash;
    if (band.find_first_not_of(band.front()) != band.npos) bands[b] = hash;
  }
  const bool same = seen_ > 0 && whole == whole_;
  if (!same) {
    same_since_s_ = stamp_s;
    same_ = 0;
  }
  whole_ = whole;
  ++same_;
  auto why = torn(bands, height);
  last_[seen_++ % kFrames] = bands;
  if (why) return why;
  const double same_s = stamp_s - same_since_s_;
  if (frozen_s_ == 0.0 || same_ <= kSame || same_s < frozen_s_) return std::nullopt;
  return fmt::format("the same for {:.1f} s, to the last bit: the camera hangs", same_s);
}

std::optional<std::string> FrameCheck::torn(const Bands& bands, std::size_t height) {
  constexpr int kTrust = 30;  // frames: what tears for longer has no noise
  std::size_t told = 0, old = 0, first = kBands, last = 0;
  for (std::size_t b = 0; b < kBands; ++b) told += bands[b] != 0 ? 1 : 0;
  for (std::size_t f = 0; f < std::min(seen_, kFrames); ++f) {
    std::size_t equal = 0;
    for (std::size_t b = 0; b < kBands; ++b) {
      if (bands[b] == 0 || bands[b] != last_[f][b]) continue;
      ++equal;
      first = std::min(first, b);
      last = std::max(last, b);
    }
    old = std::max(old, equal);
  }
  if (old == 0 || old == told) {
    lively_ = old == 0 && told > 0 ? lively_ + 1 : 0;
    torn_ = 0;
    return std::nullopt;
  }
  if (lively_ < kFrames || ++torn_ > kTrust) lively_ = 0;
  if (lively_ == 0) return std::nullopt;
  return fmt::format("torn: of {} rows those from {} to {} are of an earlier image", height,
                     first * height / kBands, (last + 1) * height / kBands);
}

}  // namespace mimesis::vision
