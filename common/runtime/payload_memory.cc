#include "common/runtime/payload_memory.h"

#include <endian.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>

namespace mimesis::runtime {
namespace {

constexpr std::uint64_t kMagic = 0x6d696d65'73697301;  // "mimesis", version of the layout
constexpr std::size_t kPage = 4096;
constexpr const char* kName = "mimesis-payloads";

/// First page of the memory; the slots follow.
struct Head {
  std::atomic<std::uint64_t> magic;
  std::array<std::atomic<std::uint64_t>, PayloadMemory::kSlots> generations;  ///< 0: is written
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free && sizeof(Head) <= kPage);

using Words = std::array<std::uint64_t, 5>;

}  // namespace

std::string encode(const PayloadPlace& place) {
  Words words{place.fd, place.slot, place.generation, place.offset, place.size};
  for (std::uint64_t& w : words) w = htole64(w);
  return {reinterpret_cast<const char*>(words.data()), sizeof words};
}

std::optional<PayloadPlace> decode_place(std::string_view bytes) {
  Words words{};
  if (bytes.size() != sizeof words) return std::nullopt;
  std::memcpy(words.data(), bytes.data(), sizeof words);
  for (std::uint64_t& w : words) w = le64toh(w);
  const PayloadPlace place{words[0], words[1], words[2], words[3], words[4]};
  if (place.slot >= PayloadMemory::kSlots || place.generation == 0) return std::nullopt;
  return place;
}

PayloadMemory::~PayloadMemory() {
  if (base_ != nullptr) munmap(base_, mapped_);
  if (fd_ >= 0) close(fd_);
}

bool PayloadMemory::reserve(std::size_t payload_bytes) {
  if (payload_bytes <= capacity_) return true;
  if (fd_ < 0) {
    fd_ = memfd_create(kName, MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (fd_ < 0 || fcntl(fd_, F_ADD_SEALS, F_SEAL_SHRINK) != 0) return false;
  }
  // Room for a little more: pictures that are compressed differ in size.
  const std::size_t capacity = (payload_bytes + payload_bytes / 4 + kPage - 1) / kPage * kPage;
  const std::size_t bytes = kPage + kSlots * capacity;
  // Reserved at once: memory that is missing later would be a SIGBUS.
  if (posix_fallocate(fd_, 0, static_cast<off_t>(bytes)) != 0) return false;
  void* base = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0);
  if (base == MAP_FAILED) return false;
  auto* head = static_cast<Head*>(base);
  for (auto& generation : head->generations) generation.store(0, std::memory_order_relaxed);
  std::atomic_thread_fence(std::memory_order_seq_cst);
  head->magic.store(kMagic, std::memory_order_relaxed);
  if (base_ != nullptr) munmap(base_, mapped_);
  base_ = static_cast<char*>(base);
  mapped_ = bytes;
  capacity_ = capacity;
  return true;
}

std::optional<PayloadPlace> PayloadMemory::write(std::string_view payload) {
  if (!reserve(payload.size())) return std::nullopt;
  const std::uint64_t slot = ++generation_ % kSlots;
  const std::uint64_t offset = kPage + slot * capacity_;
  auto& generation = reinterpret_cast<Head*>(base_)->generations[slot];
  generation.store(0, std::memory_order_relaxed);
  std::atomic_thread_fence(std::memory_order_seq_cst);  // before the bytes change
  std::memcpy(base_ + offset, payload.data(), payload.size());
  generation.store(generation_, std::memory_order_release);
  return PayloadPlace{static_cast<std::uint64_t>(fd_), slot, generation_, offset, payload.size()};
}

std::shared_ptr<MappedPayloads> MappedPayloads::open(int pid, std::uint64_t fd) {
  const std::string path = fmt::format("/proc/{}/fd/{}", pid, fd);
  // Nothing else is opened: a device could do something then.
  std::array<char, 64> target{};
  const std::string expected = fmt::format("/memfd:{} (deleted)", kName);
  if (readlink(path.c_str(), target.data(), target.size() - 1) < 0) return nullptr;
  if (expected != target.data()) {
    errno = EPERM;
    return nullptr;
  }
  const int opened = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (opened < 0) return nullptr;
  std::shared_ptr<MappedPayloads> payloads(new MappedPayloads(opened));
  const int seals = fcntl(opened, F_GET_SEALS);
  const bool sealed = seals >= 0 && (seals & F_SEAL_SHRINK) != 0;
  if (sealed && payloads->map() &&
      reinterpret_cast<const Head*>(payloads->base_)->magic.load(std::memory_order_relaxed) ==
          kMagic)
    return payloads;
  errno = EPERM;  // it lives, but gives nothing that can be mapped: ENOENT would wait for ever
  return nullptr;
}

MappedPayloads::~MappedPayloads() {
  if (base_ != nullptr) munmap(const_cast<char*>(base_), mapped_);
  close(fd_);
}

bool MappedPayloads::map() {
  struct stat status {};
  if (fstat(fd_, &status) != 0) return false;
  const auto bytes = static_cast<std::size_t>(status.st_size);
  if (bytes < kPage || bytes <= mapped_) return false;
  void* base = mmap(nullptr, bytes, PROT_READ, MAP_SHARED, fd_, 0);
  if (base == MAP_FAILED) return false;
  if (base_ != nullptr) munmap(const_cast<char*>(base_), mapped_);
  base_ = static_cast<const char*>(base);
  mapped_ = bytes;
  return true;
}

bool MappedPayloads::read(const PayloadPlace& place, std::string& payload) {
  const auto within = [&] {
    return place.offset >= kPage && place.offset <= mapped_ && place.size <= mapped_ - place.offset;
  };
  if (!within() && (!map() || !within())) return false;
  const auto& generation = reinterpret_cast<const Head*>(base_)->generations[place.slot];
  if (generation.load(std::memory_order_acquire) != place.generation) return false;
  payload.assign(base_ + place.offset, place.size);
  std::atomic_thread_fence(std::memory_order_acquire);  // after the bytes are read
  return generation.load(std::memory_order_relaxed) == place.generation;
}

}  // namespace mimesis::runtime
