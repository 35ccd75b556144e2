#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace mimesis::image {

/// Colour image, 8 bits a channel, blue green red, rows without padding. Pixel (u, v): u right, v
/// down, (0, 0) is the centre of the top left one.
struct Image {
  int width = 0;                  ///< [px]
  int height = 0;                 ///< [px]
  std::vector<std::uint8_t> bgr;  ///< 3 · width · height

  Image() = default;
  Image(int w, int h)
      : width(w), height(h), bgr(3 * static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  std::uint8_t* at(int u, int v) { return bgr.data() + offset(u, v); }
  const std::uint8_t* at(int u, int v) const { return bgr.data() + offset(u, v); }

 private:
  std::size_t offset(int u, int v) const {
    return 3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                static_cast<std::size_t>(u));
  }
};

}  // namespace mimesis::image
