// Any bytes as a motion file: the four readers must survive them, within bounds. The first byte
// chooses the reader; an AMC comes behind its ASF and a zero byte.
//   cmake --preset fuzz && ninja -C build-fuzz mocap_fuzz
//   mkdir CORPUS && (printf '\0'; cat WALK.bvh) >CORPUS/bvh     (\1: ASF and AMC, \2: C3D)
//   build-fuzz/bin/mocap_fuzz -rss_limit_mb=512 CORPUS
#include <algorithm>
#include <cstdint>

#include "common/error.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/markers.h"

namespace {

using namespace mimesis::mocap;

bool is_one_line(const std::string& message) {
  return !message.empty() &&
         std::all_of(message.begin(), message.end(), [](char c) { return c != '\n' && c != '\r'; });
}

void check(const Clip& clip) {
  MIMESIS_ASSERT(clip.frames() > 0 && clip.rate_hz > 0.0);
  MIMESIS_ASSERT(clip.rotation_rad.allFinite());
  MIMESIS_ASSERT(clip.root_position_W_m.cols() == clip.frames());
  for (std::size_t j = 1; j < clip.skeleton.joints.size(); ++j) {
    MIMESIS_ASSERT(clip.skeleton.joints[j].parent >= 0 &&
                   clip.skeleton.joints[j].parent < static_cast<int>(j));
  }
}

void read(int kind, std::string_view text) {
  if (kind == 0) {
    check(parse_bvh(text, "fuzz"));
  } else if (kind == 1) {
    const std::size_t cut = text.find('\0');
    const AcclaimSkeleton asf = parse_asf(text.substr(0, cut), "fuzz");
    if (cut != text.npos) check(parse_amc(text.substr(cut + 1), "fuzz", asf));
  } else {
    const Markers markers = parse_c3d(std::as_bytes(std::span(text)), "fuzz");
    MIMESIS_ASSERT(markers.frames() > 0 && markers.rate_hz > 0.0);
    MIMESIS_ASSERT(markers.position_m.rows() == 3 * static_cast<long>(markers.labels.size()));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  try {
    read(data[0] % 3, {reinterpret_cast<const char*>(data) + 1, size - 1});
  } catch (const mimesis::ConfigError& error) {
    MIMESIS_ASSERT(is_one_line(error.what()));
  }
  return 0;
}
