#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hw/cia402/canopen.h"
#include "hw/cia402/setup.h"

namespace mimesis::hw::cia402 {

/// An object as an EDS or DCF describes it.
struct EdsObject {
  std::string name{};
  int type = 0;   ///< number of its data type [CiA 301, table 44]; 0: not said
  int bytes = 0;  ///< of that type; 0: of no number with 1, 2 or 4
  bool readable = false, writable = false;
  bool to_drive = false, to_master = false;  ///< may be in RPDOs, in TPDOs
  std::optional<std::int64_t> value{};       ///< of a DCF, else the default
  std::optional<std::int64_t> low{}, high{};
  int line = 0;  ///< of its section
};

/// Description of a CANopen device [CiA 306-1]: EDS, or DCF, which has the values of one device,
/// too. Read as makers write it: any line ends, comments, hexadecimal, octal and decimal numbers,
/// $NODEID on either side of +, CompactSubObj with values, CompactPDO, text that is no UTF-8.
/// Sections and keys count in any case. What is not asked for need not make sense.
class Eds {
 public:
  /// @param name  of the file, in front of messages
  /// @param node  for $NODEID
  /// @throws ConfigError "FILE:LINE: ..." for what is no section and no key, and for a section or
  ///   key that is there twice with two meanings
  Eds(std::string_view text, std::string name, int node);

  /// Nothing if the device lacks it. @throws ConfigError "FILE:LINE: ..." for a description that
  /// makes no sense, an object that is listed and has no section
  std::optional<EdsObject> find(Object object) const;
  /// Text of DeviceInfo: "ProductName"; empty if it is not there.
  std::string device(const std::string& key) const;
  /// Vendor, product or revision (sub 1 to 3 of 1018h), of the object or else of DeviceInfo.
  std::optional<std::uint32_t> identity(int sub) const;
  const std::string& name() const { return name_; }

 private:
  struct Value {
    std::string text;
    int line = 0;
  };
  struct Section {
    int line = 0;
    std::map<std::string, Value> values;  ///< by the key in small letters
  };
  const Section* section(const std::string& name) const;
  const Value* value(const Section& section, const std::string& key) const;
  std::optional<std::int64_t> number(const Section& section, const std::string& key) const;
  EdsObject described(const Section& section) const;
  std::optional<EdsObject> compact(const Section& whole, Object object) const;
  std::optional<EdsObject> compact_pdo(Object object) const;
  const Value* listed(std::uint16_t index) const;
  [[noreturn]] void fail(int line, const std::string& what) const;

  std::string name_;
  int node_;
  std::map<std::string, Section> sections_;  ///< by their names in small letters
};

/// What a drive lacks of what the bridge sets up, by its description.
struct EdsFinding {
  enum class Kind : std::uint8_t {
    unusable,  ///< it will not be enabled
    accept,    ///< it will not, unless its axis accepts it: `word`
    warning,   ///< it will, and something is lost
  };
  Kind kind = Kind::unusable;
  std::string text;  ///< "6007:00 (quick stop when ..): the drive lacks it"
  std::string word;  ///< of Axis::accept: "no_6007"
};

/// Compares a drive's description with the steps of its set-up: objects, their size, access and
/// range, and what PDOs can carry. Objects whose description is not said are not judged.
/// @throws ConfigError as Eds::find
std::vector<EdsFinding> lacks_of(const Eds& eds, const std::vector<SetupStep>& steps);

}  // namespace mimesis::hw::cia402
