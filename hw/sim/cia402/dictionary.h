#pragma once
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace mimesis::hw::sim {

/// Index and sub-index of an object in one number: 0x607D'02 is 607Dh:02.
using Address = std::uint32_t;

enum class Type : std::uint8_t { i8, i16, i32, u8, u16, u32, text };
enum class Access : std::uint8_t { ro, rw, wo };
/// PDOs that may carry an object.
enum class Carried : std::uint8_t { no, rpdo, tpdo };

/// SDO abort codes [CiA 301, table 22].
namespace abort_code {
inline constexpr std::uint32_t kToggle = 0x05030000, kTimeout = 0x05040000, kCommand = 0x05040001,
                               kWriteOnly = 0x06010001, kReadOnly = 0x06010002,
                               kNoObject = 0x06020000, kNotMappable = 0x06040041,
                               kPdoLength = 0x06040042, kIncompatible = 0x06040043,
                               kLength = 0x06070010, kNoSub = 0x06090011, kRange = 0x06090030,
                               kTooHigh = 0x06090031, kTooLow = 0x06090032, kState = 0x08000022;
}

/// One row of an object dictionary.
struct Entry {
  Address address = 0;
  Type type = Type::u32;
  Access access = Access::ro;
  Carried carried = Carried::no;
  std::int64_t value = 0;
  std::int64_t low = std::numeric_limits<std::int64_t>::min();  ///< of what may be written
  std::int64_t high = std::numeric_limits<std::int64_t>::max();
  std::vector<std::int64_t> choices{};  ///< of what may be written; empty: all within the limits
  std::string text{};
  std::int64_t power_on = 0;  ///< value after a reset; set by Dictionary::add
};

int bytes_of(Type type);  ///< 1, 2, 4; 0 of a text

/// Object dictionary of a simulated device, which answers with abort codes; 0 is no refusal.
class Dictionary {
 public:
  void add(Entry entry);
  void add(std::initializer_list<Entry> entries) {
    for (const Entry& entry : entries) add(entry);
  }
  void remove(Address address);  ///< a drive that lacks an object

  const Entry* find(Address address) const;
  /// Value of a number; 0 if the object is not there, as a drive acts that lacks it.
  std::int64_t value(Address address) const;
  /// From inside the device: no access type, no limits. Nothing if the object is not there.
  void set(Address address, std::int64_t value);
  /// Values after a reset of the objects first..last.
  void reset(Address first, Address last);

  std::uint32_t read(Address address, std::vector<std::uint8_t>& data) const;
  /// Refusal of a write, which changes nothing yet. `value` becomes the number.
  std::uint32_t refuse_write(Address address, std::span<const std::uint8_t> data,
                             std::int64_t& value) const;
  /// Precondition: refuse_write() has allowed it.
  void write(Address address, std::span<const std::uint8_t> data, std::int64_t value);

 private:
  Entry* entry(Address address);

  std::vector<Entry> entries_;  // by address
};

/// Little-endian number of `data`, which is as long as the type.
std::int64_t decode(Type type, std::span<const std::uint8_t> data);
/// Appends a number little-endian.
void encode(std::int64_t value, int bytes, std::vector<std::uint8_t>& data);

}  // namespace mimesis::hw::sim
