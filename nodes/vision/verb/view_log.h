#pragma once
#include <string>
#include <vector>

#include "common/image/image.h"
#include "proto/foxglove/image.pb.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

struct ViewLogOptions {
  std::vector<std::string> logs;
  std::string image = "camera/image", annotations = "vision/annotations";  ///< topics
  std::string film, frames;  ///< file, or folder of PNG files; one of them
  double rate_hz = 30.0;     ///< pictures a second of film
  TimeRange range;
};

/// Draws circles, lines and texts over a picture.
void draw(const foxglove::ImageAnnotations& annotations, image::Image& image);

/// Writes the pictures of a log with the annotations of the same stamp. Returns the exit code.
/// @throws ConfigError, VerbEnd
int view_log(const ViewLogOptions& options);

}  // namespace mimesis::tool
