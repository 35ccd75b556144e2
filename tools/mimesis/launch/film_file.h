#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {

/// A film, which ffmpeg makes of pictures.
class FilmFile {
 public:
  /// @param format  what ffmpeg is told of its input: {"-f", "image2pipe", "-c:v", "mjpeg"}
  /// @throws ConfigError without ffmpeg
  FilmFile(std::string path, const std::vector<std::string>& format, double rate_hz);
  /// @throws ConfigError if the file cannot be written
  void take(std::string_view picture);
  /// @throws ConfigError if the film could not be made
  void finish();

 private:
  std::string path_;
  Fd in_;
  Child child_;
};

}  // namespace mimesis::launch
