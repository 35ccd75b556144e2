#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace mimesis::vision {

/// Tells from the bytes of a camera's frames, as they come, which of them are no new picture: equal
/// to the last bit for long, rows missing at the end, or rows of a frame before. The latter are
/// known by a band of rows that is the same to the last bit as in one of the last frames while
/// another is not, which noise rules out. A source without noise, whose bands stay equal now and
/// then (films, too), is not judged so.
class FrameCheck {
 public:
  /// @param frozen_s frames that are equal for so long are refused [s]; 0: none
  explicit FrameCheck(double frozen_s) : frozen_s_(frozen_s) {}

  /// Takes a frame of `height` rows.
  /// @returns what is wrong with it, if anything is
  std::optional<std::string> fault(std::string_view data, std::size_t height, double stamp_s);

 private:
  static constexpr std::size_t kBands = 48, kFrames = 8;  ///< drivers have up to 8 buffers
  /// Hash of each band of rows; 0: all its bytes are the same, which tells nothing.
  using Bands = std::array<std::size_t, kBands>;
  std::optional<std::string> torn(const Bands& bands, std::size_t height);

  double frozen_s_;
  std::array<Bands, kFrames> last_{};
  std::size_t seen_ = 0;   ///< frames so far
  std::size_t whole_ = 0;  ///< hash of the newest frame
  double same_since_s_ = 0.0;
  int same_ = 0;            ///< frames in a row that were like it
  std::size_t lively_ = 0;  ///< frames in a row that had no band of an earlier one
  int torn_ = 0;            ///< frames in a row that were torn
};

}  // namespace mimesis::vision
