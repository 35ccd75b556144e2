#include "common/log/io.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <utility>

namespace mimesis::log {
namespace {

constexpr std::size_t kFileBuffer = 64 * 1024;  // many small records become one system call
constexpr std::size_t kReadAhead = 16 * 1024;

tl::unexpected<Status> failed(std::string_view doing, const std::string& path) {
  return tl::unexpected(
      Status{fmt::format("cannot {} '{}': {}", doing, path, std::strerror(errno))});
}

std::string folder_of(const std::string& path) {
  return std::filesystem::absolute(path).parent_path().string();
}

/// A new file's name is on the disk when its folder is.
Result sync_folder(const std::string& path) {
  const std::string folder = folder_of(path);
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return failed("open", folder);
  const bool done = ::fsync(fd) == 0 || errno == EINVAL;
  const int error = errno;
  ::close(fd);
  errno = error;
  if (!done) return failed("sync", folder);
  return {};
}

class FileSink final : public Sink {
 public:
  FileSink(int fd, std::string path) : fd_(fd), path_(std::move(path)) {
    buffer_.reserve(kFileBuffer);
  }
  ~FileSink() override {
    if (fd_ >= 0) ::close(fd_);  // only after an error: `close` reports
  }
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  Result write(std::string_view bytes) override {
    if (buffer_.size() + bytes.size() > kFileBuffer) {
      if (auto done = flush(); !done) return done;
    }
    if (bytes.size() > kFileBuffer) return put(bytes);
    buffer_.append(bytes);
    return {};
  }
  Result flush() override {
    Result done = put(buffer_);
    buffer_.clear();
    return done;
  }
  Result sync() override {
    if (auto done = flush(); !done) return done;
    if (::fdatasync(fd_) != 0 && errno != EINVAL) return failed("sync", path_);  // EINVAL: a device
    return std::exchange(named_, true) ? Result{} : sync_folder(path_);
  }
  Result close() override {
    if (auto done = flush(); !done) return done;
    const int fd = fd_;
    fd_ = -1;
    if (::close(fd) != 0) return failed("close", path_);
    return {};
  }

 private:
  Result put(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return failed("write", path_);
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return {};
  }

  int fd_;
  std::string path_, buffer_;
  bool named_ = false;  // its name is on the disk
};

class FileSource final : public Source {
 public:
  FileSource(int fd, std::string path, std::uint64_t size)
      : fd_(fd), path_(std::move(path)), size_(size) {}
  ~FileSource() override { ::close(fd_); }  // nothing was written: nothing can fail that matters
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  std::uint64_t size() const override { return size_; }
  tl::expected<std::size_t, Status> read(std::uint64_t offset, char* out,
                                         std::size_t size) const override {
    std::size_t done = 0;
    while (done < size) {
      const ssize_t n = ::pread(fd_, out + done, size - done, static_cast<off_t>(offset + done));
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return failed("read", path_);
      if (n == 0) break;
      done += static_cast<std::size_t>(n);
    }
    return done;
  }

 private:
  int fd_;
  std::string path_;
  std::uint64_t size_;
};

}  // namespace

tl::expected<std::unique_ptr<Sink>, Status> create_file(const std::string& path) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0) return failed("create", path);
  struct stat info {};
  if (::fstat(fd, &info) == 0 && S_ISREG(info.st_mode)) {
    // Emptied only by the one that writes it; file systems without locks are written to as before.
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      ::close(fd);
      return tl::unexpected(Status{fmt::format(
          "cannot create '{}': another process is writing it, expected a file of its own", path)});
    }
    if (::ftruncate(fd, 0) != 0) {
      const int error = errno;
      ::close(fd);
      errno = error;
      return failed("create", path);
    }
  }
  return std::make_unique<FileSink>(fd, path);
}

tl::expected<std::unique_ptr<Source>, Status> open_file(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return failed("open", path);
  struct stat info {};
  if (::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
    ::close(fd);
    return tl::unexpected(Status{fmt::format("'{}' is not a file", path)});
  }
  return std::make_unique<FileSource>(fd, path, static_cast<std::uint64_t>(info.st_size));
}

Result MemorySink::write(std::string_view bytes) {
  bytes_.append(bytes);
  return {};
}

tl::expected<std::size_t, Status> MemorySource::read(std::uint64_t offset, char* out,
                                                     std::size_t size) const {
  if (offset >= bytes_.size()) return 0;
  const std::string_view part = bytes_.substr(static_cast<std::size_t>(offset), size);
  std::memcpy(out, part.data(), part.size());
  return part.size();
}

tl::expected<std::string_view, Status> Window::view(std::uint64_t offset, std::size_t size) {
  const std::uint64_t end = std::min(source_.size(), offset + size);
  if (offset >= end) return std::string_view{};
  const auto wanted = static_cast<std::size_t>(end - offset);
  if (offset < start_ || end > start_ + filled_) {
    // Bytes already here move to the front, the rest is read behind them.
    const bool keep = offset >= start_ && offset < start_ + filled_;
    const std::size_t kept = keep ? static_cast<std::size_t>(start_ + filled_ - offset) : 0;
    const std::size_t need = std::max(wanted, kReadAhead);
    char* bytes = buffer_.reserve(0);
    if (keep) std::memmove(bytes, bytes + (offset - start_), kept);
    bytes = buffer_.reserve(need, kept);
    start_ = offset;
    filled_ = kept;
    auto n = source_.read(offset + kept, bytes + kept, need - kept);
    if (!n) return tl::unexpected(n.error());
    filled_ += *n;
  }
  const auto at = static_cast<std::size_t>(offset - start_);
  return std::string_view(buffer_.reserve(0) + at, std::min(wanted, filled_ - at));
}

}  // namespace mimesis::log
