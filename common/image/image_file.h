#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "common/error.h"
#include "common/image/image.h"

namespace mimesis::image {

/// Reads a PNG or JPEG file, recognised by its first bytes; grey and palette images become colour,
/// alpha is dropped. Refuses images wider or higher than 16384 px. The reason names the file.
tl::expected<Image, Status> read_image(const std::filesystem::path& path);

/// Decodes a JPEG picture in memory (a camera's MJPEG frame) into `out`, whose storage is reused.
tl::expected<void, Status> decode_jpeg(std::span<const std::uint8_t> jpeg, Image& out);

/// A PNG file's bytes (8-bit RGB), and those of a JPEG file, `quality` 1..100.
tl::expected<std::string, Status> encode_png(const Image& image);
tl::expected<std::string, Status> encode_jpeg(const Image& image, int quality);

/// Writes such a file.
tl::expected<void, Status> write_png(const std::filesystem::path& path, const Image& image);

}  // namespace mimesis::image
