#include <gtest/gtest.h>

#include "common/testing/loopback.h"
#include "difference_node.h"

using namespace std::chrono_literals;

TEST(Difference, IsThatOfTheLastTwoImages) {
  mimesis::testing::Loopback bus;  // a bus in memory
  DifferenceNode node({.gain = 2}, bus);
  foxglove::RawImage image;
  image.set_data("\x0a\x14\xff", 3);
  bus.send("image", image, 1s);
  node.step(1s);
  EXPECT_FALSE(bus.take<foxglove::RawImage>("difference").has_value()) << "there was one image";

  image.set_data("\x0d\x14\x01", 3);
  bus.send("image", image, 2s);
  node.step(2s);
  const auto difference = bus.take<foxglove::RawImage>("difference");
  ASSERT_TRUE(difference.has_value());
  EXPECT_EQ(difference->data(), std::string("\x06\x00\xff", 3));
  EXPECT_EQ(difference->timestamp().seconds(), 2);
}
