// 1000 flips and 1000 cuts over all codecs; log_test does the same with a few.
#include "common/log/test/campaign.h"

#include <gtest/gtest.h>

namespace mimesis::log {
namespace {

constexpr Compression kCodecs[] = {Compression::none, Compression::lz4, Compression::zstd};

TEST(Campaign, OneThousandFlippedBytesAreReportedOrHarmless) {
  for (const Compression codec : kCodecs) {
    flip_bytes({codec, 4096, 1000}, 300, 1 + static_cast<unsigned>(codec));
  }
  flip_bytes({Compression::none, 0, 1000}, 100, 9);
}

TEST(Campaign, OfOneThousandTruncatedLogs98PercentOfTheCompleteMessagesAreRecovered) {
  for (const Compression codec : kCodecs) {
    EXPECT_GE(truncate({codec, 64 * 1024, 40'000}, 300, 1 + static_cast<unsigned>(codec)), 0.98);
  }
  EXPECT_EQ(truncate({Compression::none, 0, 1000}, 100, 9), 1.0);
}

TEST(Campaign, ZerosAfterAPowerCutAreNoMessages) {
  for (const Compression codec : kCodecs) {
    blank_the_end({codec, 4096, 1000}, 300, 1 + static_cast<unsigned>(codec));
  }
}

}  // namespace
}  // namespace mimesis::log
