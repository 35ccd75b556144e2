#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"

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

/// Reads a PNG or JPEG file, recognised by its first bytes; grey and palette images become colour,
/// alpha is dropped. Refuses images wider or higher than 16384 px. The reason names the file.
tl::expected<Image, Status> read_image(const std::filesystem::path& path);

/// Decodes a JPEG picture in memory (a camera's MJPEG frame) into `out`, whose storage is reused.
/// What its Exif says of its orientation is done. A picture that is cut off or whose data
/// contradict themselves is refused; up to 16 stray bytes before a restart marker, 4 before
/// another, are none.
tl::expected<void, Status> decode_jpeg(std::span<const std::uint8_t> jpeg, Image& out);

/// A PNG file's bytes (8-bit RGB), and those of a JPEG file, `quality` 1..100.
tl::expected<std::string, Status> encode_png(const Image& image);
tl::expected<std::string, Status> encode_jpeg(const Image& image, int quality);

/// Writes such a file.
tl::expected<void, Status> write_png(const std::filesystem::path& path, const Image& image);

}  // namespace mimesis::image
