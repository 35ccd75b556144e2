#pragma once
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include "nodes/camera/source/sequence.h"

namespace mimesis::camera {

/// What the first line of a Y4M stream says.
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
