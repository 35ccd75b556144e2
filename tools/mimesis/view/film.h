#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tools/mimesis/view/server.h"

namespace mimesis::view {

struct FilmOptions {
  std::vector<std::string> logs;
  std::string film, png;               ///< files to write; one of them
  double from_s = 0.0;                 ///< of the log: where the film begins, or the picture's time
  std::optional<double> to_s;          ///< its end; empty: that of the log
  double rate_hz = 25.0, speed = 1.0;  ///< pictures a second of film; seconds of log in it
  std::string camera;                  ///< x,y,z of the eye and of what it looks at [m]; empty: all
  int width_px = 1280, height_px = 720;
  std::string browser;  ///< program; empty: a known one
};

/// Draws a log's scene in a browser without a window, picture by picture: what a film shows does
/// not depend on how long that takes. @throws ConfigError if there is no browser, no ffmpeg, or
/// nothing to draw
void make_film(const FilmOptions& options, ServerOptions server);

}  // namespace mimesis::view
