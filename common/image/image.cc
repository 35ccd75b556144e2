#include "common/image/image.h"

#include <png.h>
#include <turbojpeg.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>

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
  Image image(static_cast<int>(png.width), static_cast<int>(png.height));
  const png_color black{0, 0, 0};
  if (png_image_finish_read(&png, &black, image.bgr.data(), 0, nullptr) == 0) {
    return fail(png.message);
  }
  return image;
}

}  // namespace

tl::expected<void, Status> decode_jpeg(std::span<const std::uint8_t> jpeg, Image& out) {
  const Turbo turbo(tjInitDecompress());
  int width = 0, height = 0, subsampling = 0, colorspace = 0;
  const auto size = static_cast<unsigned long>(jpeg.size());
  if (tjDecompressHeader3(turbo.get(), jpeg.data(), size, &width, &height, &subsampling,
                          &colorspace) != 0) {
    return fail(tjGetErrorStr2(turbo.get()));
  }
  if (width > kLargestSide || height > kLargestSide) return fail("larger than 16384 px");
  out.width = width;
  out.height = height;
  out.bgr.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  if (tjDecompress2(turbo.get(), jpeg.data(), size, out.bgr.data(), width, 3 * width, height,
                    TJPF_BGR, TJFLAG_STOPONWARNING) != 0) {
    return fail(tjGetErrorStr2(turbo.get()));  // a warning is a truncated picture
  }
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
