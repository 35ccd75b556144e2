#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "common/image/image_file.h"
#include "tools/mimesis/log/export.h"

namespace mimesis::tool {
namespace {

using PixelRow = const std::uint8_t*;
constexpr std::uint32_t kLargestSide = 16384;

std::uint8_t clamped(double value) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0l, 255l));
}

void put_yuv(double y, double u, double v, std::uint8_t* bgr) {
  bgr[0] = clamped(y + 1.772 * (u - 128.0));
  bgr[1] = clamped(y - 0.344136 * (u - 128.0) - 0.714136 * (v - 128.0));
  bgr[2] = clamped(y + 1.402 * (v - 128.0));
}

/// Packed pixels of `size` bytes; at these places are blue, green and red.
struct Packed {
  std::string_view name;
  int size, blue, green, red;
};
constexpr Packed kPacked[] = {{"bgr8", 3, 0, 1, 2},  {"8UC3", 3, 0, 1, 2}, {"rgb8", 3, 2, 1, 0},
                              {"bgra8", 4, 0, 1, 2}, {"8UC4", 4, 0, 1, 2}, {"rgba8", 4, 2, 1, 0},
                              {"mono8", 1, 0, 0, 0}, {"8UC1", 1, 0, 0, 0}};

/// Two pixels in four bytes: places of the first luminance, U, the second luminance and V.
struct Yuv422 {
  std::string_view name;
  int y0, u, y1, v;
};
constexpr Yuv422 kYuv422[] = {{"uyvy", 1, 0, 3, 2},
                              {"yuv422", 1, 0, 3, 2},
                              {"yuyv", 0, 1, 2, 3},
                              {"yuv422_yuy2", 0, 1, 2, 3}};

tl::unexpected<Status> no_image(std::string reason) {
  return tl::unexpected(Status{std::move(reason)});
}

/// Fills an image row by row once its size is known to fit.
template <class Convert>
tl::expected<image::Image, Status> convert_rows(const foxglove::RawImage& raw,
                                                std::uint64_t row_bytes, std::uint64_t rows,
                                                const Convert& convert_row) {
  if (raw.width() == 0 || raw.height() == 0 || raw.width() > kLargestSide ||
      raw.height() > kLargestSide) {
    return no_image(fmt::format("{} x {} px is no size of an image", raw.width(), raw.height()));
  }
  const std::uint64_t step = raw.step() != 0 ? raw.step() : row_bytes;
  if (step < row_bytes || raw.data().size() < step * (rows - 1) + row_bytes) {
    return no_image(fmt::format("{} x {} px {} need {} bytes in rows of {}, found {} in rows of {}",
                                raw.width(), raw.height(), raw.encoding(), row_bytes * rows,
                                row_bytes, raw.data().size(), step));
  }
  image::Image out(static_cast<int>(raw.width()), static_cast<int>(raw.height()));
  const auto* data = reinterpret_cast<PixelRow>(raw.data().data());
  for (int v = 0; v < out.height; ++v) convert_row(data, step, v, out);
  return out;
}

tl::expected<image::Image, Status> from_packed(const foxglove::RawImage& raw, const Packed& p) {
  const auto size = static_cast<std::uint64_t>(p.size);
  return convert_rows(raw, raw.width() * size, raw.height(),
                      [&](PixelRow data, std::uint64_t step, int v, image::Image& out) {
                        PixelRow from = data + step * static_cast<std::uint64_t>(v);
                        for (int u = 0; u < out.width; ++u, from += p.size) {
                          std::uint8_t* to = out.at(u, v);
                          to[0] = from[p.blue];
                          to[1] = from[p.green];
                          to[2] = from[p.red];
                        }
                      });
}

tl::expected<image::Image, Status> from_yuv422(const foxglove::RawImage& raw, const Yuv422& p) {
  if (raw.width() % 2 != 0) return no_image(raw.encoding() + ": the width is odd");
  return convert_rows(raw, raw.width() * 2ull, raw.height(),
                      [&](PixelRow data, std::uint64_t step, int v, image::Image& out) {
                        PixelRow from = data + step * static_cast<std::uint64_t>(v);
                        for (int u = 0; u < out.width; u += 2, from += 4) {
                          put_yuv(from[p.y0], from[p.u], from[p.v], out.at(u, v));
                          put_yuv(from[p.y1], from[p.u], from[p.v], out.at(u + 1, v));
                        }
                      });
}

/// A plane of luminance, then one of U and V by turns with half as many rows.
tl::expected<image::Image, Status> from_nv12(const foxglove::RawImage& raw) {
  if (raw.width() % 2 != 0 || raw.height() % 2 != 0) return no_image("nv12: an odd side");
  return convert_rows(raw, raw.width(), raw.height() * 3ull / 2,
                      [&](PixelRow data, std::uint64_t step, int v, image::Image& out) {
                        PixelRow y = data + step * static_cast<std::uint64_t>(v);
                        PixelRow uv = data + step * static_cast<std::uint64_t>(out.height + v / 2);
                        for (int u = 0; u < out.width; ++u) {
                          put_yuv(y[u], uv[u / 2 * 2], uv[u / 2 * 2 + 1], out.at(u, v));
                        }
                      });
}

class ImageExport {
 public:
  explicit ImageExport(const ImageOptions& options) : options_(options) {}

  void take(const Item& item, std::uint64_t origin_ns) {
    if (count_++ % static_cast<std::uint64_t>(options_.every) != 0) return;
    const log::Message& m = *item.message;
    const auto written = write(item, fmt::format("{:06}_{}", m.sequence != 0 ? m.sequence : count_,
                                                 seconds_text(m.log_time, origin_ns)));
    if (written) {
      ++result.items;
    } else {
      ++result.failures;
      std::cerr << fmt::format("{}: seq {}: {}\n", options_.topic, m.sequence,
                               written.error().reason);
    }
  }

  ExportResult result;

 private:
  tl::expected<void, Status> write(const Item& item, const std::string& name) {
    const auto size = static_cast<int>(item.message->data.size());
    if (item.schema->name == "foxglove.CompressedImage") {
      foxglove::CompressedImage image;
      if (!image.ParseFromArray(item.message->data.data(), size))
        return no_image("no valid message");
      const std::string& format = image.format();
      const bool plain =
          !format.empty() && format.size() < 8 &&
          std::ranges::all_of(format, [](unsigned char c) { return std::isalnum(c); });
      if (!plain) return no_image("format '" + format + "': expected jpeg, png or the like");
      errno = 0;
      std::ofstream out(path(name, format == "jpeg" ? ".jpg" : "." + format), std::ios::binary);
      out << image.data();
      out.close();
      return out ? tl::expected<void, Status>{} : no_image(std::strerror(errno));
    }
    foxglove::RawImage raw;
    if (!raw.ParseFromArray(item.message->data.data(), size)) return no_image("no valid message");
    const auto image = raw_image(raw);
    if (!image) return tl::unexpected(image.error());
    return options_.jpeg ? image::write_jpeg(path(name, ".jpg"), *image, options_.quality)
                         : image::write_png(path(name, ".png"), *image);
  }

  std::filesystem::path path(const std::string& name, const std::string& extension) {
    return std::filesystem::path(options_.folder) / names_.unique(name, extension);
  }

  const ImageOptions& options_;
  FileNames names_;
  std::uint64_t count_ = 0;
};

}  // namespace

tl::expected<image::Image, Status> raw_image(const foxglove::RawImage& raw) {
  for (const Packed& p : kPacked) {
    if (p.name == raw.encoding()) return from_packed(raw, p);
  }
  for (const Yuv422& p : kYuv422) {
    if (p.name == raw.encoding()) return from_yuv422(raw, p);
  }
  if (raw.encoding() == "nv12") return from_nv12(raw);
  return no_image(
      "encoding '" + raw.encoding() +
      "': expected one of bgr8, rgb8, bgra8, rgba8, mono8, 8UC1, 8UC3, 8UC4, uyvy, yuyv, "
      "yuv422, yuv422_yuy2, nv12");
}

ExportResult export_images(const std::vector<OpenLog>& logs, const ImageOptions& options) {
  require_topic(logs, options.topic);
  for (const OpenChannel& c : channels_of(logs)) {
    const bool images = c.type() == "foxglove.RawImage" || c.type() == "foxglove.CompressedImage";
    if (c.channel->topic != options.topic || images) continue;
    throw ConfigError(options.topic + ": expected foxglove.RawImage or foxglove.CompressedImage" +
                      ", found '" + c.type() + "'");
  }
  make_folder(options.folder);
  const Span span = span_of(logs);
  const LogTimes times = resolve(options.range, span);
  ImageExport images(options);
  const auto wanted = [&](const log::Channel& c) { return c.topic == options.topic; };
  images.result.failures += scan_logs(logs, {wanted, times.start, times.end}, "images",
                                      [&](const Item& item) { images.take(item, span.start_ns); });
  images.result.files.push_back(options.folder);
  return std::move(images.result);
}

}  // namespace mimesis::tool
