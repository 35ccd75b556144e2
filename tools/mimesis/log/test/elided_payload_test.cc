// Payloads that a node computes again: as the demo records its images.
#include "tools/mimesis/log/elided_payload.h"

#include <gtest/gtest.h>

#include "proto/foxglove/image.pb.h"

namespace mimesis::tool {
namespace {

TEST(ElidedPayload, KeepsSmallFieldsAndASumOfAll) {
  foxglove::RawImage image;
  image.set_width(640);
  image.set_encoding("bgr8");
  image.set_data(std::string(100'000, 'x'));
  const std::string elided = elide(image.SerializeAsString());
  EXPECT_LT(elided.size(), 100U);
  foxglove::RawImage read;
  ASSERT_TRUE(read.ParseFromString(elided));  // for every reader a message of its type
  EXPECT_EQ(read.width(), 640U);
  EXPECT_EQ(read.encoding(), "bgr8");
  EXPECT_TRUE(read.data().empty());

  // each bit of a word counts, wherever the word ends
  for (const std::size_t from : {std::size_t{0}, std::size_t{50'001}, std::size_t{99'984}}) {
    for (std::size_t at = from; at < from + 16; ++at) {
      for (int bit = 0; bit < 8; ++bit) {
        foxglove::RawImage other = image;
        (*other.mutable_data())[at] = static_cast<char>('x' ^ (1 << bit));
        EXPECT_NE(elide(other.SerializeAsString()), elided) << at << ", " << bit;
      }
    }
  }
  EXPECT_EQ(elide(image.SerializeAsString()), elided);
}

TEST(ElidedPayload, LeavesWhatIsNoMessageWhole) {
  const std::string cut = std::string("\x0a\xff\xff\x03", 4) + "short";  // says 65535 bytes follow
  EXPECT_EQ(elide(cut), cut);
}

}  // namespace
}  // namespace mimesis::tool
