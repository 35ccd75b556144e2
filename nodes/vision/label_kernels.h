#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace mimesis::vision {

/// Look-up of the class of pixels, chosen at run time: with AVX2 eight or sixteen pixels at a time,
/// else one by one (`_scalar`: the reference, bit-identical).
/// @param bgr    3 · pixels bytes
/// @param cells  32768 classes by (B >> 3) | (G >> 3) << 5 | (R >> 3) << 10
void look_up_bgr(const std::uint8_t* bgr, std::size_t pixels, const std::uint8_t* cells,
                 std::uint8_t* labels);
void look_up_bgr_scalar(const std::uint8_t* bgr, std::size_t pixels, const std::uint8_t* cells,
                        std::uint8_t* labels);

/// Classes by a camera's colours, and a sieve of them: most pixels of a picture are of no class,
/// and U and V alone tell so of most of these.
class YuyvCells {
 public:
  /// @param cells  65536 classes by (U >> 2) | (V >> 2) << 6 | (Y >> 4) << 12
  explicit YuyvCells(std::vector<std::uint8_t> cells);
  const std::uint8_t* cells() const { return cells_.data(); }
  using Sieve = std::array<std::uint8_t, 64>;
  /// By U >> 2 and V >> 2: bits of all classes that have such cells. No common bit, no class.
  const Sieve& u() const { return u_; }
  const Sieve& v() const { return v_; }

 private:
  std::vector<std::uint8_t> cells_;
  Sieve u_{}, v_{};
};

/// The same for a camera's YUYV: Y0 U Y1 V for two pixels.
/// @param pixels even
void look_up_yuyv(const std::uint8_t* yuyv, std::size_t pixels, const YuyvCells& cells,
                  std::uint8_t* labels);
void look_up_yuyv_scalar(const std::uint8_t* yuyv, std::size_t pixels, const std::uint8_t* cells,
                         std::uint8_t* labels);

/// Opening of all classes at once, 3x3: a pixel keeps its class if it lies in a square of 3x3
/// pixels of this class; beyond the border everything is of its class. What an opening of each
/// class's mask leaves.
/// @param scratch grows to a few rows
/// @param opened  width · height; not `labels`
void open_labels(const std::uint8_t* labels, int width, int height,
                 std::vector<std::uint8_t>& scratch, std::uint8_t* opened);

}  // namespace mimesis::vision
