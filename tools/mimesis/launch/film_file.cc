#include "tools/mimesis/launch/film_file.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <csignal>

#include "common/error.h"
#include "tools/mimesis/launch/command.h"

namespace mimesis::launch {

FilmFile::FilmFile(std::string path, const std::vector<std::string>& format, double rate_hz)
    : path_(std::move(path)) {
  const std::string ffmpeg = find_executable("ffmpeg");
  if (ffmpeg.empty()) throw ConfigError(path_ + ": a film needs ffmpeg: apt install ffmpeg");
  std::vector<std::string> argv{ffmpeg, "-v", "error", "-y"};
  argv.insert(argv.end(), format.begin(), format.end());
  argv.insert(argv.end(),
              {"-framerate", fmt::format("{}", rate_hz), "-i", "-", "-pix_fmt", "yuv420p", path_});
  std::signal(SIGPIPE, SIG_IGN);  // ffmpeg may end
  Pipe pipe = make_pipe();
  child_ = spawn({argv, {}}, {}, {.output = STDERR_FILENO, .input = pipe.read.get()});
  in_ = std::move(pipe.write);
}

void FilmFile::take(std::string_view picture) {
  while (!picture.empty()) {
    const ssize_t n = write(in_.get(), picture.data(), picture.size());
    if (n <= 0) throw ConfigError(path_ + ": ffmpeg ended before the film did");
    picture.remove_prefix(static_cast<std::size_t>(n));
  }
}

void FilmFile::finish() {
  in_.reset();
  std::optional<Ending> ending;
  while (!(ending = child_.reap())) {
    pollfd ended{child_.pidfd.get(), POLLIN, 0};
    poll(&ended, 1, -1);
  }
  if (!ending->good()) throw ConfigError(fmt::format("{}: ffmpeg {}", path_, ending->text()));
}

}  // namespace mimesis::launch
