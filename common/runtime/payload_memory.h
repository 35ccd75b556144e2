#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace mimesis::runtime {

/// Payloads from this size on go through the publisher's memory, if all who take them can map it
/// [bytes].
constexpr std::size_t kMappedPayload = std::size_t{32} << 10U;

/// Where a payload lies in the memory of its publisher; on the wire five little-endian words.
struct PayloadPlace {
  std::uint64_t fd = 0;                ///< of the publisher's process
  std::uint64_t slot = 0;              ///< less than PayloadMemory::kSlots
  std::uint64_t generation = 0;        ///< of the slot, while it holds this payload; from 1
  std::uint64_t offset = 0, size = 0;  ///< [bytes]
};
std::string encode(const PayloadPlace& place);
/// Empty if `bytes` is no result of `encode`.
std::optional<PayloadPlace> decode_place(std::string_view bytes);

/// The last payloads of one topic in anonymous memory (memfd), which processes of the same user map
/// through /proc: it needs no file, ends with the processes that use it, and cannot shrink under
/// them. One writes and waits for nobody; who reads an overwritten payload notices.
class PayloadMemory {
 public:
  static constexpr std::size_t kSlots = 3;  ///< one is written, one is read, one is on its way

  PayloadMemory() = default;
  ~PayloadMemory();
  PayloadMemory(const PayloadMemory&) = delete;
  PayloadMemory& operator=(const PayloadMemory&) = delete;

  /// Replaces the oldest payload; larger ones than all before move the slots. Empty: the system
  /// gives no memory.
  std::optional<PayloadPlace> write(std::string_view payload);

 private:
  bool reserve(std::size_t payload_bytes);

  int fd_ = -1;
  char* base_ = nullptr;
  std::size_t mapped_ = 0, capacity_ = 0;  ///< of all, of a slot [bytes]
  std::uint64_t generation_ = 0;
};

/// A publisher's PayloadMemory, mapped for reading.
class MappedPayloads {
 public:
  /// Null if that process has ended (errno ENOENT), has no such memory there, or hides it.
  static std::shared_ptr<MappedPayloads> open(int pid, std::uint64_t fd);
  ~MappedPayloads();
  MappedPayloads(const MappedPayloads&) = delete;
  MappedPayloads& operator=(const MappedPayloads&) = delete;

  /// False if the payload was overwritten, before or meanwhile.
  bool read(const PayloadPlace& place, std::string& payload);

 private:
  explicit MappedPayloads(int fd) : fd_(fd) {}
  bool map();

  int fd_;
  const char* base_ = nullptr;
  std::size_t mapped_ = 0;
};

}  // namespace mimesis::runtime
