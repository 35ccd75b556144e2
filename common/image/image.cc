#include "common/image/image.h"

#include <jerror.h>
#include <jpeglib.h>
#include <png.h>
#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csetjmp>
#include <cstdio>  // before jpeglib.h
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>

namespace mimesis::image {
namespace {

constexpr int kLargestSide = 16384;  // beyond this a header is damaged, not a picture

tl::unexpected<Status> fail(std::string reason) {
  return tl::unexpected(Status{std::move(reason)});
}

struct TurboDelete {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Turbo = std::unique_ptr<void, TurboDelete>;

tl::expected<std::vector<std::uint8_t>, Status> read_bytes(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) {
    return fail(path.string() + ": " + (errno != 0 ? std::strerror(errno) : "not a readable file"));
  }
  return std::vector<std::uint8_t>(std::istreambuf_iterator<char>(file), {});
}

tl::expected<void, Status> write_bytes(const std::filesystem::path& path,
                                       const tl::expected<std::string, Status>& bytes) {
  if (!bytes) return fail(path.string() + ": " + bytes.error().reason);
  errno = 0;
  std::ofstream file(path, std::ios::binary);
  file << *bytes;
  file.close();
  if (!file) return fail(path.string() + ": cannot be written: " + std::strerror(errno));
  return {};
}

tl::expected<Image, Status> decode_png(const std::vector<std::uint8_t>& bytes) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) {
    return fail(png.message);
  }
  if (png.width > kLargestSide || png.height > kLargestSide) {
    png_image_free(&png);
    return fail("larger than 16384 px");
  }
  png.format = PNG_FORMAT_BGR;
  png.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;  // else 16 bits without a gamma count as linear light
  Image image(static_cast<int>(png.width), static_cast<int>(png.height));
  const png_color black{0, 0, 0};
  if (png_image_finish_read(&png, &black, image.bgr.data(), 0, nullptr) == 0) {
    return fail(png.message);
  }
  return image;
}

}  // namespace

namespace {

/// libjpeg's way to fail and to complain. What it can go on after is not always damage: webcams
/// leave bytes of their buffers before markers, and every decoder skips them. After a restart
/// marker the picture is in step again; at the end a damaged one would have left more.
struct JpegErrors {
  jpeg_error_mgr manager{};  // first: libjpeg knows no more of this
  std::jmp_buf back{};
  std::array<char, JMSG_LENGTH_MAX> reason{};

  static JpegErrors& of(j_common_ptr jpeg) { return *reinterpret_cast<JpegErrors*>(jpeg->err); }
  [[noreturn]] static void leave(j_common_ptr jpeg) {
    jpeg->err->format_message(jpeg, of(jpeg).reason.data());
    std::longjmp(of(jpeg).back, 1);
  }
  static void warn(j_common_ptr jpeg, int level) {
    constexpr int kMostBeforeRestart = 16, kMostElsewhere = 4;  // bytes
    if (level >= 0) return;
    const int bytes = jpeg->err->msg_parm.i[0], marker = jpeg->err->msg_parm.i[1];
    const bool restart = marker >= 0xD0 && marker <= 0xD7;
    if (jpeg->err->msg_code == JWRN_EXTRANEOUS_DATA &&
        bytes <= (restart ? kMostBeforeRestart : kMostElsewhere))
      return;
    leave(jpeg);
  }
};

/// Orientation 1..8 of an Exif block (tag 0112h of the first directory); 1 without one.
int orientation_in(std::span<const std::uint8_t> exif) {
  constexpr std::string_view kExif("Exif\0\0", 6);
  if (exif.size() < 14 || !std::equal(kExif.begin(), kExif.end(), exif.begin())) return 1;
  const std::span<const std::uint8_t> tiff = exif.subspan(6);
  const bool little = tiff[0] == 'I';
  const auto number = [&](std::size_t at, std::size_t bytes) {
    std::size_t value = 0;
    for (std::size_t k = 0; k < bytes && at + k < tiff.size(); ++k)
      value |= std::size_t{tiff[at + k]} << 8 * (little ? k : bytes - 1 - k);
    return value;
  };
  constexpr std::size_t kEntry = 12, kOrientation = 0x0112;
  const std::size_t directory = number(4, 4), entries = number(directory, 2);
  for (std::size_t i = 0; i < entries && directory + 2 + kEntry * (i + 1) <= tiff.size(); ++i) {
    const std::size_t entry = directory + 2 + kEntry * i;
    if (number(entry, 2) != kOrientation) continue;
    const std::size_t value = number(entry + 8, 2);
    return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
  }
  return 1;
}

/// The picture as it was meant to be looked at. [Exif 2.3, 4.6.4: 0112h]
void turn(Image& image, int orientation) {
  if (orientation == 1) return;
  const bool across = orientation >= 5;  // rows become columns
  Image out(across ? image.height : image.width, across ? image.width : image.height);
  for (int v = 0; v < out.height; ++v) {
    for (int u = 0; u < out.width; ++u) {
      int x = across ? v : u, y = across ? u : v;
      if (orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8)
        x = image.width - 1 - x;
      if (orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7)
        y = image.height - 1 - y;
      std::copy_n(image.at(x, y), 3, out.at(u, v));
    }
  }
  image = std::move(out);
}

}  // namespace

tl::expected<void, Status> decode_jpeg(std::span<const std::uint8_t> jpeg, Image& out) {
  JpegErrors errors;
  jpeg_decompress_struct from{};
  from.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = JpegErrors::leave;
  errors.manager.emit_message = JpegErrors::warn;
  int orientation = 1;
  if (setjmp(errors.back) != 0) {  // nothing between here and the jump has a destructor
    jpeg_destroy_decompress(&from);
    return fail(errors.reason.data());
  }
  jpeg_create_decompress(&from);
  jpeg_mem_src(&from, jpeg.data(), static_cast<unsigned long>(jpeg.size()));
  jpeg_save_markers(&from, JPEG_APP0 + 1, 0xFFFF);
  jpeg_read_header(&from, TRUE);
  if (from.image_width > kLargestSide || from.image_height > kLargestSide) {
    jpeg_destroy_decompress(&from);
    return fail("larger than 16384 px");
  }
  from.out_color_space = JCS_EXT_BGR;
  for (const jpeg_marker_struct* m = from.marker_list; m != nullptr; m = m->next) {
    const int found = orientation_in({m->data, m->data_length});
    if (found != 1) orientation = found;
  }
  jpeg_start_decompress(&from);
  out.width = static_cast<int>(from.output_width);
  out.height = static_cast<int>(from.output_height);
  out.bgr.resize(std::size_t{3} * from.output_width * from.output_height);
  while (from.output_scanline < from.output_height) {
    JSAMPROW row = out.bgr.data() + std::size_t{3} * from.output_width * from.output_scanline;
    jpeg_read_scanlines(&from, &row, 1);
  }
  jpeg_finish_decompress(&from);
  jpeg_destroy_decompress(&from);
  turn(out, orientation);
  return {};
}

tl::expected<Image, Status> read_image(const std::filesystem::path& path) {
  const auto bytes = read_bytes(path);
  if (!bytes) return tl::unexpected(bytes.error());
  tl::expected<Image, Status> image = fail("neither PNG nor JPEG");
  if (bytes->size() > 8 && png_sig_cmp(bytes->data(), 0, 8) == 0) {
    image = decode_png(*bytes);
  } else if (bytes->size() > 3 && (*bytes)[0] == 0xff && (*bytes)[1] == 0xd8) {
    Image decoded;
    const auto done = decode_jpeg(*bytes, decoded);
    if (done) {
      image = std::move(decoded);
    } else {
      image = tl::unexpected(done.error());
    }
  }
  if (!image) return fail(path.string() + ": " + image.error().reason);
  return image;
}

tl::expected<std::string, Status> encode_png(const Image& image) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_BGR;
  std::string file(PNG_IMAGE_PNG_SIZE_MAX(png), '\0');
  png_alloc_size_t size = file.size();
  if (png_image_write_to_memory(&png, file.data(), &size, 0, image.bgr.data(), 0, nullptr) == 0)
    return fail(png.message);
  file.resize(size);
  return file;
}

tl::expected<std::string, Status> encode_jpeg(const Image& image, int quality) {
  const Turbo turbo(tjInitCompress());
  unsigned char* data = nullptr;
  unsigned long size = 0;
  const int failed = tjCompress2(turbo.get(), image.bgr.data(), image.width, 3 * image.width,
                                 image.height, TJPF_BGR, &data, &size, TJSAMP_444, quality, 0);
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> owned(data, tjFree);
  if (failed != 0) return fail(tjGetErrorStr2(turbo.get()));
  return std::string(reinterpret_cast<const char*>(data), size);
}

tl::expected<void, Status> write_png(const std::filesystem::path& path, const Image& image) {
  return write_bytes(path, encode_png(image));
}

}  // namespace mimesis::image
