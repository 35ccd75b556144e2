#pragma once
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "common/image/image.h"

namespace mimesis::camera {

struct Frame {
  const image::Image* image;       ///< valid until the next call
  std::chrono::nanoseconds stamp;  ///< capture, on the graph's clock
};

class Source {
 public:
  virtual ~Source() = default;
  /// Newest frame captured up to `now` (graph time) that was not returned before. Does not wait.
  virtual std::optional<Frame> next(std::chrono::nanoseconds now) = 0;
  /// News since the last call, one line, empty if nothing: lost, back, at its end,
  /// unreadable.
  virtual std::string news() = 0;
  /// What was opened since the last call, for people; empty if nothing.
  virtual std::string opened() { return {}; }
};

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

/// Contents of the first line of a Y4M stream.
struct Y4mHeader {
  int width = 0, height = 0;
  double rate_hz = 0.0;
};
/// "YUV4MPEG2 W640 H480 F30:1 ..."; only 4:2:0 with 8 bits is read.
tl::expected<Y4mHeader, Status> parse_y4m_header(const std::string& line);

/// A film: Y4M files are read directly, all others by a child process `ffmpeg` that writes Y4M into
/// a pipe (its libraries are GPL in Debian, so they are not linked).
class FilmReader final : public PictureReader {
 public:
  /// @throws ConfigError if the file is missing or no film, or if ffmpeg is needed and not
  /// installed.
  explicit FilmReader(std::string path);
  ~FilmReader() override;
  FilmReader(const FilmReader&) = delete;
  FilmReader& operator=(const FilmReader&) = delete;

  double rate_hz() const { return header_.rate_hz; }
  tl::expected<bool, Status> read(image::Image& out) override;
  void rewind() override;

 private:
  void open();
  void start_ffmpeg();
  void close();
  std::string first_complaint();

  std::string path_;
  std::FILE* stream_ = nullptr;
  std::FILE* complaints_ = nullptr;  ///< ffmpeg's standard error
  int child_ = -1;
  Y4mHeader header_;
  std::vector<std::uint8_t> planes_;
};

}  // namespace mimesis::camera
