#include "nodes/camera/source/sequence.h"

#include <algorithm>
#include <cmath>

#include "common/image/image_file.h"

namespace mimesis::camera {

Sequence::Sequence(std::unique_ptr<PictureReader> reader, double rate_hz, int repeat)
    : reader_(std::move(reader)), rate_hz_(rate_hz), passes_left_(repeat) {}

std::optional<Frame> Sequence::next(std::chrono::nanoseconds now) {
  if (ended_) return std::nullopt;
  if (!start_) start_ = now;
  const double due = std::chrono::duration<double>(now - *start_).count() * rate_hz_;
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

}  // namespace mimesis::camera
