#include "common/image/image.h"

#include <gtest/gtest.h>
#include <jpeglib.h>
#include <stdlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>  // before jpeglib.h
#include <fstream>
#include <tuple>

#include "common/testing/temporary_folder.h"

namespace mimesis::image {
namespace {

class ImageFile : public ::testing::Test {
 protected:
  testing::TemporaryFolder folder_;
};

Image gradient() {
  Image image(37, 21);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      std::uint8_t* p = image.at(u, v);
      p[0] = static_cast<std::uint8_t>(6 * u);
      p[1] = static_cast<std::uint8_t>(10 * v);
      p[2] = static_cast<std::uint8_t>(255 - 5 * u);
    }
  }
  return image;
}

TEST_F(ImageFile, PngKeepsEveryByteAndTheOrderOfChannels) {
  const Image image = gradient();
  ASSERT_TRUE(write_png(folder_ / "a.png", image));
  const auto back = read_image(folder_ / "a.png");
  ASSERT_TRUE(back) << back.error().reason;
  EXPECT_EQ(back->width, 37);
  EXPECT_EQ(back->height, 21);
  EXPECT_EQ(back->bgr, image.bgr);
}

/// One grey pixel of 0x8040, without a word on its gamma: the upper byte counts, as other readers
/// have it.
TEST_F(ImageFile, PngOf16BitsIsNotTakenForLinearLight) {
  constexpr std::array<std::uint8_t, 68> kPng{
      0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48,
      0x44, 0x52, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x10, 0x00, 0x00, 0x00,
      0x00, 0x6a, 0xee, 0x47, 0x16, 0x00, 0x00, 0x00, 0x0b, 0x49, 0x44, 0x41, 0x54, 0x78,
      0x9c, 0x63, 0x68, 0x70, 0x00, 0x00, 0x01, 0x43, 0x00, 0xc1, 0x5f, 0xd4, 0x95, 0x0d,
      0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
  std::ofstream(folder_ / "a.png", std::ios::binary)
      .write(reinterpret_cast<const char*>(kPng.data()), kPng.size());
  const auto image = read_image(folder_ / "a.png");
  ASSERT_TRUE(image) << image.error().reason;
  EXPECT_EQ(image->at(0, 0)[0], 0x80);
  EXPECT_EQ(image->at(0, 0)[2], 0x80);
}

TEST_F(ImageFile, JpegKeepsColoursWithinItsLoss) {
  const Image image = gradient();
  std::ofstream(folder_ / "a.jpg") << encode_jpeg(image, 95).value();
  const auto back = read_image(folder_ / "a.jpg");
  ASSERT_TRUE(back) << back.error().reason;
  ASSERT_EQ(back->bgr.size(), image.bgr.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < image.bgr.size(); ++i) sum += std::abs(back->bgr[i] - image.bgr[i]);
  EXPECT_LT(sum / static_cast<double>(image.bgr.size()), 3.0);  // swapped channels give > 50
}

TEST_F(ImageFile, RefusesWhatIsNoImageWithTheFilesName) {
  std::ofstream(folder_ / "text.png") << "this is no picture";
  for (const char* name : {"text.png", "absent.jpg", "."}) {
    const auto image = read_image(folder_ / name);
    ASSERT_FALSE(image) << name;
    EXPECT_NE(image.error().reason.find((folder_ / name).string()), std::string::npos);
  }
}

/// A JPEG with a restart marker in each row of blocks.
std::string with_restarts(const Image& image) {
  jpeg_error_mgr errors{};
  jpeg_compress_struct to{};
  to.err = jpeg_std_error(&errors);
  jpeg_create_compress(&to);
  unsigned char* data = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&to, &data, &size);
  to.image_width = static_cast<JDIMENSION>(image.width);
  to.image_height = static_cast<JDIMENSION>(image.height);
  to.input_components = 3;
  to.in_color_space = JCS_EXT_BGR;
  jpeg_set_defaults(&to);
  to.restart_in_rows = 1;
  jpeg_start_compress(&to, TRUE);
  for (int v = 0; v < image.height; ++v) {
    JSAMPROW row = const_cast<JSAMPROW>(image.at(0, v));
    jpeg_write_scanlines(&to, &row, 1);
  }
  jpeg_finish_compress(&to);
  jpeg_destroy_compress(&to);
  const std::string jpeg(reinterpret_cast<char*>(data), size);
  std::free(data);
  return jpeg;
}

tl::expected<void, Status> decode(const std::string& jpeg, Image& out) {
  return decode_jpeg({reinterpret_cast<const std::uint8_t*>(jpeg.data()), jpeg.size()}, out);
}

/// As webcams send it: bytes of their buffers before a marker. The picture is the same.
TEST(Jpeg, StrayBytesBeforeAMarkerAreNoDamage) {
  const std::string whole = with_restarts(gradient());
  Image truth, out;
  ASSERT_TRUE(decode(whole, truth));
  const std::size_t restart = whole.find("\xFF\xD0"), end = whole.size() - 2;
  ASSERT_NE(restart, std::string::npos);
  for (const auto& [at, bytes, read] :
       {std::tuple{restart, 9, true}, {restart, 40, false}, {end, 2, true}, {end, 30, false}}) {
    std::string jpeg = whole;
    jpeg.insert(at, std::string(static_cast<std::size_t>(bytes), '\x55'));
    const auto done = decode(jpeg, out);
    EXPECT_EQ(done.has_value(), read) << at << " " << bytes;
    if (read) {
      EXPECT_EQ(out.bgr, truth.bgr);
    } else {
      EXPECT_NE(done.error().reason.find("extraneous bytes"), std::string::npos);
    }
  }
}

/// The eight orientations of Exif, in both byte orders, give one picture.
TEST(Jpeg, IsTurnedAsItsExifSays) {
  Image upright(24, 16);
  for (int v = 0; v < 16; ++v) {
    for (int u = 0; u < 24; ++u)
      std::fill_n(upright.at(u, v), 3, static_cast<std::uint8_t>(u < 8 && v < 8 ? 250 : u * 4));
  }
  const auto stored = [&](int orientation, int x, int y) {  // from where in the upright picture
    constexpr int kRight = 23, kLow = 15;
    switch (orientation) {
      case 2:
        return std::pair{kRight - x, y};
      case 3:
        return std::pair{kRight - x, kLow - y};
      case 4:
        return std::pair{x, kLow - y};
      case 5:
        return std::pair{y, x};
      case 6:
        return std::pair{kRight - y, x};
      case 7:
        return std::pair{kRight - y, kLow - x};
      case 8:
        return std::pair{y, kLow - x};
      default:
        return std::pair{x, y};
    }
  };
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const bool across = orientation >= 5;
    Image turned(across ? 16 : 24, across ? 24 : 16);
    for (int y = 0; y < turned.height; ++y) {
      for (int x = 0; x < turned.width; ++x) {
        const auto [u, v] = stored(orientation, x, y);
        std::copy_n(upright.at(u, v), 3, turned.at(x, y));
      }
    }
    std::string jpeg = encode_jpeg(turned, 95).value();
    const char value = static_cast<char>(orientation);
    const bool little = orientation % 2 == 0;
    const std::string tiff =
        little ? std::string("II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0", 18) + value +
                     std::string(7, '\0')
               : std::string("MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0", 19) + value +
                     std::string(6, '\0');
    const std::string exif = std::string("Exif\0\0", 6) + tiff;
    jpeg.insert(2, std::string("\xFF\xE1\0", 3) + static_cast<char>(exif.size() + 2) + exif);
    Image out;
    const auto done = decode(jpeg, out);
    ASSERT_TRUE(done) << done.error().reason;
    ASSERT_EQ(out.width, 24) << orientation;
    double sum = 0.0;
    for (std::size_t i = 0; i < out.bgr.size(); ++i) sum += std::abs(out.bgr[i] - upright.bgr[i]);
    EXPECT_LT(sum / static_cast<double>(out.bgr.size()), 4.0) << orientation;
  }
}

TEST_F(ImageFile, RefusesTruncatedFiles) {
  ASSERT_TRUE(write_png(folder_ / "a.png", gradient()));
  std::ofstream(folder_ / "a.jpg") << encode_jpeg(gradient(), 90).value();
  for (const char* name : {"a.png", "a.jpg"}) {
    const auto path = folder_ / name;
    for (const double part : {0.6, 0.5, 0.2}) {
      const auto size = static_cast<double>(std::filesystem::file_size(path));
      std::filesystem::resize_file(path, static_cast<std::uintmax_t>(part * size));
      EXPECT_FALSE(read_image(path)) << name << " " << part;
    }
  }
}

}  // namespace
}  // namespace mimesis::image
