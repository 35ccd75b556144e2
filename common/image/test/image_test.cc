#include "common/image/image.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <fstream>

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
