// References to messages that a node computes again: as the demo records its images.
#include "tools/mimesis/log/reference.h"

#include <gtest/gtest.h>

#include "proto/foxglove/image.pb.h"

namespace mimesis::tool {
namespace {

TEST(Reference, KeepsSmallFieldsAndASumOfAll) {
  foxglove::RawImage image;
  image.set_width(640);
  image.set_encoding("bgr8");
  image.set_data(std::string(100'000, 'x'));
  const std::string reference = reference_to(image.SerializeAsString());
  EXPECT_LT(reference.size(), 100U);
  foxglove::RawImage read;
  ASSERT_TRUE(read.ParseFromString(reference));  // for every reader a message of its type
  EXPECT_EQ(read.width(), 640U);
  EXPECT_EQ(read.encoding(), "bgr8");
  EXPECT_TRUE(read.data().empty());

  for (const std::size_t at : {std::size_t{0}, std::size_t{50'001}, std::size_t{99'999}}) {
    foxglove::RawImage other = image;
    (*other.mutable_data())[at] = 'y';
    EXPECT_NE(reference_to(other.SerializeAsString()), reference) << at;
  }
  EXPECT_EQ(reference_to(image.SerializeAsString()), reference);
}

TEST(Reference, LeavesWhatIsNoMessageWhole) {
  const std::string cut = std::string("\x0a\xff\xff\x03", 4) + "short";  // says 65535 bytes follow
  EXPECT_EQ(reference_to(cut), cut);
}

}  // namespace
}  // namespace mimesis::tool
