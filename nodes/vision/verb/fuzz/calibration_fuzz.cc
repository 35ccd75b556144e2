// Any bytes as a calibration of others: it becomes a rig that its own reader takes, or is refused
// in a line with the file's name.
//   cmake --preset fuzz && ninja -C build-fuzz calibration_fuzz && build-fuzz/bin/calibration_fuzz
//   -rss_limit_mb=2048 CORPUS
#include <array>
#include <cstdint>
#include <string>

#include "common/error.h"
#include "common/model/rig_file.h"
#include "nodes/vision/verb/foreign_calibration.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace mimesis;
  if (size == 0) return 0;
  tool::ImportOptions options{.date = "2026-11-30", .lens = "equidistant", .unit_m = 0.001};
  if (data[0] % 2 == 0) options.width_px = 640, options.height_px = 480;
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::size_t half = data[0] % 4 < 2 ? text.size() : text.size() / 2;  // one file or two
  const std::array<tool::ForeignFile, 2> files{
      {{"fuzz1", text.substr(0, half)}, {"fuzz2", text.substr(half)}}};
  try {
    const tool::Imported imported =
        import_calibration(std::span(files).first(half == text.size() ? 1 : 2), options);
    model::parse_rig(model::rig_text(imported.rig), "rig");
  } catch (const ConfigError& e) {
    const std::string line = e.what();
    MIMESIS_ASSERT(line.find("fuzz") != std::string::npos && line.find('\n') == std::string::npos);
  }
  return 0;
}
