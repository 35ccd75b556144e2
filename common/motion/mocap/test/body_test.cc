#include "common/motion/mocap/body.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <new>

namespace mimesis::mocap {
namespace {

TEST(Body, WhatIsNotSetIsTheOriginWhateverTheMemoryWas) {
  alignas(Body) std::byte memory[sizeof(Body)];
  std::memset(memory, 0xFF, sizeof memory);  // as doubles: NaN
  const auto* body = new (memory) Body;
  for (const Eigen::Vector3d& offset : body->offset_m) EXPECT_EQ(offset.norm(), 0.0);
  for (const Side side : {kLeft, kRight}) {
    EXPECT_EQ(body->toe_m[side].norm(), 0.0);
    EXPECT_EQ(body->heel_m[side].norm(), 0.0);
    EXPECT_EQ(body->hand_m[side].norm(), 0.0);
  }
  EXPECT_EQ(body->head_top_m.norm(), 0.0);
  std::destroy_at(body);
  EXPECT_EQ(standard_body().offset_m[kRoot].norm(), 0.0);
}

}  // namespace
}  // namespace mimesis::mocap
