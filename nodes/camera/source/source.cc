#include "nodes/camera/source/source.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "common/image/image.h"
#include "common/time.h"

extern char** environ;

namespace mimesis::camera {

Sequence::Sequence(std::unique_ptr<PictureReader> reader, double rate_hz, int repeat)
    : reader_(std::move(reader)), rate_hz_(rate_hz), passes_left_(repeat) {}

std::optional<Frame> Sequence::next(std::chrono::nanoseconds now) {
  if (ended_) return std::nullopt;
  if (!start_) start_ = now;
  const double due = to_seconds(now - *start_) * rate_hz_;
  const auto wanted = static_cast<std::int64_t>(std::floor(due + 1e-6)) + 1;
  bool fresh = false;
  while (shown_ < wanted && !ended_) fresh = advance() || fresh;
  if (!fresh) return std::nullopt;
  const double since = static_cast<double>(shown_ - 1) / rate_hz_;
  return Frame{&image_, *start_ + std::chrono::nanoseconds(std::llround(1e9 * since))};
}

/// One picture further; false if there was none to show.
bool Sequence::advance() {
  const auto read = reader_->read(image_);
  if (!read) {
    news_ = read.error().reason;
    ++shown_;
    return false;
  }
  if (*read) {
    ++shown_;
    return true;
  }
  if (--passes_left_ > 0 && shown_ > 0) {
    reader_->rewind();
    return advance();
  }
  ended_ = true;
  news_ = "end after " + std::to_string(shown_) + " pictures";
  return false;
}

std::string Sequence::news() { return std::exchange(news_, {}); }

FolderReader::FolderReader(const std::filesystem::path& folder) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    std::string ending = entry.path().extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (ending == ".png" || ending == ".jpg" || ending == ".jpeg") files_.push_back(entry.path());
  }
  if (error) throw ConfigError("path: '" + folder.string() + "': " + error.message());
  if (files_.empty()) {
    throw ConfigError("path: '" + folder.string() + "' holds no .png, .jpg or .jpeg file");
  }
  std::sort(files_.begin(), files_.end());
}

tl::expected<bool, Status> FolderReader::read(image::Image& out) {
  if (index_ >= files_.size()) return false;
  auto image = image::read_image(files_[index_++]);
  if (!image) return tl::unexpected(image.error());
  out = std::move(*image);
  return true;
}

namespace {

tl::unexpected<Status> fail(std::string reason) {
  return tl::unexpected(Status{std::move(reason)});
}

/// Reads up to a line's end, without it; empty at the end of the stream.
std::string read_line(std::FILE* stream) {
  constexpr std::size_t kLongest = 1024;
  std::string line;
  for (int c = std::fgetc(stream); c != EOF && c != '\n' && line.size() < kLongest;
       c = std::fgetc(stream)) {
    line += static_cast<char>(c);
  }
  return line;
}

struct Pipe {
  int read_end = -1, write_end = -1;
  Pipe() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
      throw ConfigError(std::string("path: no pipe for ffmpeg: ") + std::strerror(errno));
    }
    read_end = ends[0];
    write_end = ends[1];
  }
};

}  // namespace

tl::expected<Y4mHeader, Status> parse_y4m_header(const std::string& line) {
  std::istringstream words(line);
  std::string word;
  words >> word;
  if (word != "YUV4MPEG2") return fail("not a Y4M stream");
  Y4mHeader header;
  std::string chroma = "420";
  while (words >> word) {
    const char* value = word.c_str() + 1;
    int numerator = 0, denominator = 0;
    if (word[0] == 'W') header.width = std::atoi(value);
    if (word[0] == 'H') header.height = std::atoi(value);
    if (word[0] == 'C') chroma = value;
    if (word[0] == 'F' && std::sscanf(value, "%d:%d", &numerator, &denominator) == 2 &&
        denominator > 0) {
      header.rate_hz = static_cast<double>(numerator) / denominator;
    }
  }
  if (header.width < 2 || header.height < 2 || header.width > 8192 || header.height > 8192 ||
      header.width % 2 != 0 || header.height % 2 != 0) {
    return fail("Y4M header '" + line + "': width and height must be even, 2..8192");
  }
  if (!(header.rate_hz > 0.0)) return fail("Y4M header '" + line + "': no frame rate");
  if (chroma.rfind("420", 0) != 0 || chroma.rfind("420p1", 0) == 0) {
    return fail("Y4M colour space C" + chroma + " is not read, only 8-bit C420");
  }
  return header;
}

FilmReader::FilmReader(std::string path) : path_(std::move(path)) { open(); }

FilmReader::~FilmReader() { close(); }

void FilmReader::open() {
  if (!std::filesystem::is_regular_file(path_)) {
    throw ConfigError("path: '" + path_ + "' is not a file");
  }
  if (std::filesystem::path(path_).extension() == ".y4m") {
    stream_ = std::fopen(path_.c_str(), "rbe");
    if (stream_ == nullptr) throw ConfigError("path: '" + path_ + "': " + std::strerror(errno));
  } else {
    start_ffmpeg();
  }
  const auto header = parse_y4m_header(read_line(stream_));
  if (!header) {
    const std::string why = child_ > 0 ? first_complaint() : header.error().reason;
    close();
    throw ConfigError("path: '" + path_ + "': " + why);
  }
  header_ = *header;
  const auto pixels =
      static_cast<std::size_t>(header_.width) * static_cast<std::size_t>(header_.height);
  planes_.resize(pixels * 3 / 2);
}

void FilmReader::start_ffmpeg() {
  Pipe out, err;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, out.write_end, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.write_end, STDERR_FILENO);
  const char* arguments[] = {"ffmpeg",      "-nostdin", "-v",           "error",    "-i",
                             path_.c_str(), "-f",       "yuv4mpegpipe", "-pix_fmt", "yuv420p",
                             "-an",         "-",        nullptr};
  const int failed =
      posix_spawnp(&child_, "ffmpeg", &actions, nullptr, const_cast<char**>(arguments), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(out.write_end);
  ::close(err.write_end);
  stream_ = ::fdopen(out.read_end, "rb");
  complaints_ = ::fdopen(err.read_end, "rb");
  if (failed == 0) return;
  child_ = -1;
  close();
  throw ConfigError("path: '" + path_ + "' needs the program ffmpeg, which did not start: " +
                    std::strerror(failed) + " (Y4M files are read without it)");
}

std::string FilmReader::first_complaint() {
  const std::string line = read_line(complaints_);
  return line.empty() ? "ffmpeg gave no pictures" : "ffmpeg: " + line;
}

void FilmReader::close() {
  if (child_ > 0) {
    ::kill(child_, SIGTERM);
    while (::waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
    }
    child_ = -1;
  }
  if (stream_ != nullptr) std::fclose(stream_);
  if (complaints_ != nullptr) std::fclose(complaints_);
  stream_ = complaints_ = nullptr;
}

void FilmReader::rewind() {
  close();
  open();
}

tl::expected<bool, Status> FilmReader::read(image::Image& out) {
  const std::string marker = read_line(stream_);
  if (marker.empty()) return false;
  if (marker.rfind("FRAME", 0) != 0) return fail("path: '" + path_ + "': damaged Y4M stream");
  if (std::fread(planes_.data(), 1, planes_.size(), stream_) != planes_.size()) return false;
  if (out.width != header_.width || out.height != header_.height) {
    out = image::Image(header_.width, header_.height);
  }
  const cv::Mat yuv(header_.height * 3 / 2, header_.width, CV_8U, planes_.data());
  cv::Mat bgr(header_.height, header_.width, CV_8UC3, out.bgr.data());
  cv::cvtColor(yuv, bgr, cv::COLOR_YUV2BGR_I420);
  return true;
}

}  // namespace mimesis::camera
