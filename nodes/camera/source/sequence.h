#pragma once
#include <filesystem>
#include <memory>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "nodes/camera/source/source.h"

namespace mimesis::camera {

/// Pictures one after the other: a film or a folder.
class PictureReader {
 public:
  virtual ~PictureReader() = default;
  /// Reads the next picture into `out`; false at the end.
  virtual tl::expected<bool, Status> read(image::Image& out) = 0;
  virtual void rewind() = 0;
};

/// Shows pictures at a fixed rate: picture k is captured at start + k / rate, on the graph's clock.
/// One that cannot be read is reported and left out.
class Sequence final : public Source {
 public:
  /// @param repeat number of passes
  Sequence(std::unique_ptr<PictureReader> reader, double rate_hz, int repeat);
  std::optional<Frame> next(std::chrono::nanoseconds now) override;
  std::string news() override;

 private:
  bool advance();

  std::unique_ptr<PictureReader> reader_;
  double rate_hz_;
  int passes_left_;
  std::optional<std::chrono::nanoseconds> start_;
  std::int64_t shown_ = 0;
  bool ended_ = false;
  image::Image image_;
  std::string news_;
};

/// PNG and JPEG files of a folder, in the order of their names.
class FolderReader final : public PictureReader {
 public:
  /// @throws ConfigError if the folder cannot be read or holds no picture.
  explicit FolderReader(const std::filesystem::path& folder);
  tl::expected<bool, Status> read(image::Image& out) override;
  void rewind() override { index_ = 0; }

 private:
  std::vector<std::filesystem::path> files_;
  std::size_t index_ = 0;
};

}  // namespace mimesis::camera
