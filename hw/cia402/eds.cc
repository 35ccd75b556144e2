#include "hw/cia402/eds.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <set>
#include <utility>

#include "common/error.h"

namespace mimesis::hw::cia402 {
namespace {

constexpr std::int64_t kDefType = 5, kDefStruct = 6, kVariable = 7, kArray = 8, kRecord = 9;
constexpr int kDomain = 2;

std::string small(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

std::string_view bare(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\f\v\x1A";
  const auto from = text.find_first_not_of(kBlank), to = text.find_last_not_of(kBlank);
  return from == text.npos ? std::string_view() : text.substr(from, to - from + 1);
}

/// 0x1A, 032 (octal) or 26, with a sign; nothing if it is none, or beyond 64 bits.
std::optional<std::int64_t> number_of(std::string_view text) {
  const bool minus = text.starts_with('-');
  if (minus || text.starts_with('+')) text.remove_prefix(1);
  int base = 10;
  if (text.size() > 2 && text[0] == '0' && (text[1] == 'x' || text[1] == 'X')) {
    base = 16;
    text.remove_prefix(2);
  } else if (text.size() > 1 && text[0] == '0') {
    base = 8;
  }
  if (text.empty() || text.size() > 22) return std::nullopt;
  std::int64_t sum = 0;
  for (const char c : text) {
    const int digit = c >= '0' && c <= '9'   ? c - '0'
                      : c >= 'a' && c <= 'f' ? c - 'a' + 10
                      : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                             : base;
    if (digit >= base || sum > (INT64_MAX - digit) / base) return std::nullopt;
    sum = sum * base + digit;
  }
  return minus ? -sum : sum;
}

/// A sum of numbers and $NODEID.
std::optional<std::int64_t> sum_of(std::string_view text, int node) {
  std::int64_t sum = 0;
  for (;;) {
    // A sign at the beginning belongs to its number.
    const std::size_t plus = text.find('+', text.starts_with('+') ? 1 : 0);
    const std::string_view part = bare(text.substr(0, plus));
    const auto value =
        small(part) == "$nodeid" ? std::optional<std::int64_t>(node) : number_of(part);
    if (!value || __builtin_add_overflow(sum, *value, &sum)) return std::nullopt;
    if (plus == text.npos) return sum;
    text.remove_prefix(plus + 1);
  }
}

/// Bytes and sign of the data types of numbers with up to four bytes.
struct NumberType {
  int type, bytes;
  bool has_sign;
  const char* name;
};
constexpr std::array<NumberType, 8> kNumberTypes{{{1, 1, false, "BOOLEAN"},
                                                  {2, 1, true, "INTEGER8"},
                                                  {3, 2, true, "INTEGER16"},
                                                  {4, 4, true, "INTEGER32"},
                                                  {5, 1, false, "UNSIGNED8"},
                                                  {6, 2, false, "UNSIGNED16"},
                                                  {7, 4, false, "UNSIGNED32"},
                                                  {8, 4, true, "REAL32"}}};
const NumberType* number_type(int type) {
  const auto found = std::ranges::find(kNumberTypes, type, &NumberType::type);
  return found == kNumberTypes.end() ? nullptr : &*found;
}

}  // namespace

void Eds::fail(int line, const std::string& what) const {
  throw ConfigError(fmt::format("{}:{}: {}", name_, line, printable(what)));
}

Eds::Eds(std::string_view text, std::string name, int node) : name_(std::move(name)), node_(node) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (text.find('\0') != text.npos) {
    const auto before = text.substr(0, text.find('\0'));
    fail(static_cast<int>(std::ranges::count(before, '\n')) + 1,
         "a byte 0: expected text in UTF-8 or Latin-1");
  }
  Section* current = nullptr;
  bool comments = false;
  int number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find_first_of("\r\n");
    const std::string_view line = bare(text.substr(0, end));
    ++number;
    const bool both = end != text.npos && text.substr(end, 2) == "\r\n";
    text.remove_prefix(end == text.npos ? text.size() : end + (both ? 2 : 1));
    if (line.empty() || line.starts_with(';')) continue;
    if (line.starts_with('[')) {
      const std::size_t close = line.find(']');
      if (close == line.npos) fail(number, "a section without ']'");
      const std::string key = small(bare(line.substr(1, close - 1)));
      const std::string_view behind = bare(line.substr(close + 1));
      if (!behind.empty() && !behind.starts_with(';'))
        fail(number, "behind the section there is '" + std::string(behind) + "'");
      comments = key == "comments";
      current = &sections_[key];
      if (current->line == 0) current->line = number;
      continue;
    }
    const std::size_t equals = line.find('=');
    if (comments && equals == line.npos) continue;  // text that runs on
    if (equals == line.npos || equals == 0)
      fail(number, "expected [SECTION] or KEY=VALUE, found '" + std::string(line) + "'");
    if (current == nullptr) fail(number, "a key before the first section");
    const std::string key = small(bare(line.substr(0, equals)));
    const Value value{std::string(bare(line.substr(equals + 1))), number};
    const auto [at, fresh] = current->values.emplace(key, value);
    if (!fresh && at->second.text != value.text && !comments) {
      fail(number, fmt::format("{} is '{}' here and '{}' in line {}", key, value.text,
                               at->second.text, at->second.line));
    }
  }
  if (section("deviceinfo") == nullptr && section("mandatoryobjects") == nullptr)
    fail(1, "no section [DeviceInfo] and no [MandatoryObjects]: this is no EDS or DCF");
}

const Eds::Section* Eds::section(const std::string& name) const {
  const auto found = sections_.find(name);
  return found == sections_.end() ? nullptr : &found->second;
}

const Eds::Value* Eds::value(const Section& section, const std::string& key) const {
  const auto found = section.values.find(key);
  return found == section.values.end() || found->second.text.empty() ? nullptr : &found->second;
}

std::optional<std::int64_t> Eds::number(const Section& section, const std::string& key) const {
  const Value* text = value(section, key);
  if (text == nullptr) return std::nullopt;
  const auto found =
      sum_of(bare(std::string_view(text->text).substr(0, text->text.find(';'))), node_);
  if (!found) {
    fail(text->line, key +
                         ": expected a number as 0x1A, 26, 032 (octal) or $NODEID+0x180, found '" +
                         text->text + "'");
  }
  return found;
}

/// The list that names an object.
const Eds::Value* Eds::listed(std::uint16_t index) const {
  for (const char* list : {"mandatoryobjects", "optionalobjects", "manufacturerobjects"}) {
    const Section* found = section(list);
    if (found == nullptr) continue;
    for (const auto& [key, entry] : found->values) {
      if (key != "supportedobjects" && number(*found, key) == index) return &entry;
    }
  }
  return nullptr;
}

EdsObject Eds::described(const Section& section) const {
  EdsObject out;
  out.line = section.line;
  if (const Value* name = value(section, "parametername")) out.name = printable(name->text);
  out.type = static_cast<int>(number(section, "datatype").value_or(0) & 0xFFFF);
  const NumberType* type = number_type(out.type);
  out.bytes = type != nullptr ? type->bytes : 0;
  const Value* access = value(section, "accesstype");
  const std::string how = access != nullptr ? small(access->text) : "";
  constexpr std::array<std::string_view, 6> kAccess{"ro", "wo", "rw", "rwr", "rww", "const"};
  if (access != nullptr && std::ranges::count(kAccess, how) == 0)
    fail(access->line,
         "AccessType: expected ro, wo, rw, rwr, rww or const, found '" + access->text + "'");
  out.readable = how != "wo";
  out.writable = how.empty() || how.starts_with("rw") || how == "wo";
  const bool mappable = number(section, "pdomapping").value_or(0) != 0;
  out.to_drive = mappable && (how == "wo" || how == "rw" || how == "rww");
  out.to_master = mappable && (how == "ro" || how == "rw" || how == "rwr" || how == "const");
  if (type == nullptr || type->name == std::string_view("REAL32")) return out;
  for (const auto& [key, to] : {std::pair{"parametervalue", &out.value},
                                std::pair{"lowlimit", &out.low}, std::pair{"highlimit", &out.high}})
    *to = number(section, key);
  if (!out.value) out.value = number(section, "defaultvalue");
  const int bits = 8 * type->bytes;
  for (auto* each : {&out.value, &out.low, &out.high}) {
    if (!*each) continue;
    const std::int64_t span = std::int64_t{1} << bits;
    if (**each >= span || **each < -span / 2)
      fail(section.line, fmt::format("a value of {} is no {}", **each, type->name));
    // A negative number may be written as its bits: 0xFFFFFFFF.
    if (type->has_sign && **each >= span / 2) *each = **each - span;
  }
  return out;
}

/// An element of an array that is written in one section, its values in another.
std::optional<EdsObject> Eds::compact(const Section& whole, Object object) const {
  const std::int64_t count = number(whole, "compactsubobj").value_or(0);
  if (object.sub > count) return std::nullopt;
  EdsObject out = described(whole);
  if (object.sub == 0) {
    out.type = 5;
    out.bytes = 1;
    out.writable = out.to_drive = out.to_master = false;
    out.value = count;
    return out;
  }
  const Section* values = section(fmt::format("{:04x}value", object.index));
  if (values != nullptr) {
    // Sub-indices are written in decimal or with 0x.
    for (const auto& [key, text] : values->values) {
      if (key != "nrofentries" && number_of(key) == object.sub && out.bytes > 0)
        out.value = number(*values, key);
    }
  }
  return out;
}

/// PDOs that DeviceInfo tells alone: CompactPDO has a bit per sub-index.
std::optional<EdsObject> Eds::compact_pdo(Object object) const {
  const Section* device = section("deviceinfo");
  if (device == nullptr || (object.index & 0xF000) != 0x1000) return std::nullopt;
  const std::int64_t mask = number(*device, "compactpdo").value_or(0);
  const bool to_drive = object.index >= 0x1400 && object.index < 0x1800,
             to_master = object.index >= 0x1800 && object.index < 0x1C00;
  if (mask == 0 || (!to_drive && !to_master)) return std::nullopt;
  const bool mapping = (object.index & 0x0200) != 0;
  const std::int64_t count = number(*device, to_drive ? "nrofrxpdo" : "nroftxpdo").value_or(0);
  if ((object.index & 0x1FF) >= count) return std::nullopt;
  if (!mapping && object.sub > 0 && (object.sub > 7 || (mask >> object.sub & 1) == 0))
    return std::nullopt;
  EdsObject out{.readable = true, .writable = mapping || object.sub > 0, .line = device->line};
  const bool word = !mapping && (object.sub == 3 || object.sub == 5);
  const bool byte = object.sub == 0 || (!mapping && !word && object.sub != 1);
  out.bytes = byte ? 1 : word ? 2 : 4;
  out.type = byte ? 5 : word ? 6 : 7;
  return out;
}

std::optional<EdsObject> Eds::find(Object object) const {
  const std::string index = fmt::format("{:04x}", object.index);
  // Sub-indices are hexadecimal; some write two digits.
  for (const char* form : {"{}sub{:x}", "{}sub{:02x}"}) {
    if (const Section* own = section(fmt::format(fmt::runtime(form), index, object.sub)))
      return described(*own);
  }
  const Section* whole = section(index);
  if (whole == nullptr) {
    if (const Value* list = listed(object.index))
      fail(list->line, fmt::format("lists {}, but there is no section [{}]", list->text, index));
    return compact_pdo(object);
  }
  const std::int64_t kind = number(*whole, "objecttype").value_or(kVariable);
  if (kind == kArray || kind == kRecord) {
    if (number(*whole, "compactsubobj").value_or(0) > 0) return compact(*whole, object);
    return std::nullopt;
  }
  const bool one = kind == kVariable || kind == kDomain || kind == kDefType || kind == kDefStruct;
  if (!one) fail(whole->line, fmt::format("ObjectType: {} is none of CiA 306", kind));
  if (object.sub > 0) return std::nullopt;
  return described(*whole);
}

std::string Eds::device(const std::string& key) const {
  const Section* info = section("deviceinfo");
  const Value* found = info != nullptr ? value(*info, small(key)) : nullptr;
  return found != nullptr ? printable(found->text) : "";
}

std::optional<std::uint32_t> Eds::identity(int sub) const {
  constexpr std::array<const char*, 3> kKeys{"vendornumber", "productnumber", "revisionnumber"};
  const auto object = find({0x1018, static_cast<std::uint8_t>(sub)});
  std::int64_t out = object ? object->value.value_or(0) : 0;
  const Section* info = section("deviceinfo");
  if (out == 0 && info != nullptr)
    out = number(*info, kKeys.at(static_cast<std::size_t>(sub - 1))).value_or(0);
  if (out == 0) return std::nullopt;  // makers leave it out so
  return static_cast<std::uint32_t>(out);
}

namespace {

using Lack = EdsFinding::Kind;

/// The value of a step as a number of the object's type.
std::int64_t value_as(const EdsObject& object, std::uint32_t value) {
  const NumberType* type = number_type(object.type);
  if (type == nullptr || !type->has_sign) return value;
  return type->bytes == 1   ? static_cast<std::int8_t>(value)
         : type->bytes == 2 ? static_cast<std::int16_t>(value)
                            : static_cast<std::int32_t>(value);
}

bool writes(const SetupStep& step) {
  return step.kind == SetupStep::Kind::write || step.kind == SetupStep::Kind::write_checked;
}

/// Why the description does not fit the step; empty if it does.
std::string misfit(const std::optional<EdsObject>& object, const SetupStep& step) {
  if (!object) return "the drive lacks it";
  if (object->type != 0 && object->bytes != step.bytes) {
    const NumberType* type = number_type(object->type);
    return fmt::format("line {}: is {}, expected {} bytes", object->line,
                       type != nullptr ? type->name : fmt::format("of type {:#x}", object->type),
                       step.bytes);
  }
  // What cannot be written may be as wanted already.
  const std::uint32_t wanted = step.value & step.mask;
  const auto is = [&](std::int64_t value) {
    const auto bits = static_cast<std::uint32_t>(value) & step.mask;
    return step.kind == SetupStep::Kind::expect_least ? bits >= wanted : bits == wanted;
  };
  if (writes(step) && !object->writable) {
    if (!object->value)
      return fmt::format("line {}: is read-only, and its value is not said", object->line);
    if (is(*object->value)) return {};
    return fmt::format("line {}: is read-only with {}, expected {}", object->line, *object->value,
                       value_as(*object, step.value));
  }
  if (writes(step)) {
    const std::int64_t value = value_as(*object, step.value);
    const bool limits = object->low && object->high && *object->low < *object->high;
    if (limits && (value < *object->low || value > *object->high))
      return fmt::format("line {}: takes {} to {}, the bridge writes {}", object->line,
                         *object->low, *object->high, value);
  }
  return {};
}

class Comparison {
 public:
  Comparison(const Eds& eds, const std::vector<SetupStep>& steps) : eds_(eds), steps_(steps) {}

  std::vector<EdsFinding> all() {
    if (!eds_.find(object::kControlword) && !eds_.find(object::kStatusword))
      return {{Lack::unusable, "is no drive of CiA 402: it lacks 6040:00 and 6041:00", ""}};
    for (const SetupStep& step : steps_) {
      if (step.pdo >= 0) continue;
      const auto object = eds_.find(step.object);
      // A default of 0 says nothing: 1000h and 6502h are often left out.
      const bool expects = step.kind == SetupStep::Kind::expect && object && object->value &&
                           *object->value != 0 && step.object != object::kModeDisplay;
      std::string why = misfit(object, step);
      if (why.empty() && expects &&
          (static_cast<std::uint32_t>(*object->value) & step.mask) != step.value) {
        why = fmt::format("line {}: is {:#x}, expected {:#x}", object->line, *object->value,
                          step.value);
        add(Lack::unusable, step, why);
      } else if (!why.empty()) {
        judge(step, object.has_value(), why);
      }
    }
    const auto missing = [&](Object each) { return !eds_.find(each).has_value(); };
    const bool guarded = std::ranges::count(steps_, object::kGuardTime, &SetupStep::object) > 0;
    if (!guarded && missing(object::kMasterHeartbeat) && missing(object::kRpdo1Deadline)) {
      out_.push_back({Lack::unusable,
                      "nothing stops it when the bridge is lost: it lacks 1016:01 and 1400:05",
                      ""});
    }
    pdos();
    return std::move(out_);
  }

 private:
  void add(Lack kind, const SetupStep& step, const std::string& why, std::string word = {}) {
    if (!told_.insert({step.object.index, step.object.sub}).second) return;
    out_.push_back(
        {kind, fmt::format("{} ({}): {}", text(step.object), step.meaning, why), std::move(word)});
  }

  /// As the set-up of a drive does with the same answer on the bus.
  void judge(const SetupStep& step, bool there, const std::string& why) {
    if (there) return add(Lack::unusable, step, why);
    const bool small_loss = step.without != nullptr && *step.without == '\0';
    if (step.without != nullptr) {
      return small_loss ? void() : add(Lack::warning, step, why + ": " + step.without);
    }
    if (step.lost != nullptr)
      return add(Lack::accept, step, why + ": " + step.lost, lack_of(step.object));
    add(Lack::unusable, step, why);
  }

  /// A PDO with an object that cannot be mapped keeps its maker's mapping, which then has to carry
  /// what moves the drive and what shows its state, as on the bus.
  void pdos() {
    const PdoMaps wanted = maps_of(steps_);
    PdoMaps used;
    std::array<std::string, 4> why;
    for (std::size_t pdo = 0; pdo < wanted.size(); ++pdo) {
      if (wanted[pdo].empty()) continue;
      const Object mapping{static_cast<std::uint16_t>(kPdoObjects[pdo] + 0x200), 0};
      const auto count = eds_.find(mapping);
      if (!count) {
        why[pdo] = "the drive lacks " + text(mapping);
        continue;
      }
      if (!count->writable)
        why[pdo] = fmt::format("line {}: its PDO cannot be changed", count->line);
      for (const Mapped& m : wanted[pdo]) {
        if (why[pdo].empty() && !unmappable(m, pdo).empty())
          why[pdo] = text(m.object) + " cannot be mapped";
      }
      used[pdo] = why[pdo].empty() ? wanted[pdo] : mapping_of(mapping.index, *count);
    }
    for (const Mapped& m : used[0]) {
      if (m.object != object::kMode && !carries(wanted[0], m))
        out_.push_back({Lack::unusable,
                        "RPDO1 carries " + text(m.object) + ", which the bridge cannot give", ""});
    }
    for (std::size_t pdo = 0; pdo < wanted.size(); ++pdo) {
      const auto missed = [&](const Mapped& m) {
        const bool elsewhere =
            (pdo == 1 && carries(used[2], m)) || (pdo == 2 && carries(used[1], m));
        return !carries(used[pdo], m) && !elsewhere;
      };
      // One that cannot be mapped keeps the others out: it alone is told.
      const bool own = std::ranges::any_of(wanted[pdo], [&](const Mapped& m) {
        return needed(m) && missed(m) && !unmappable(m, pdo).empty();
      });
      for (const Mapped& m : wanted[pdo]) {
        const std::string reason = unmappable(m, pdo);
        if (!missed(m) || (own && reason.empty())) continue;
        out_.push_back(
            {needed(m) ? Lack::unusable : Lack::warning,
             fmt::format("{} (in {}): {}", text(m.object), pdo == 0 ? "an RPDO" : "a TPDO",
                         reason.empty() ? why[pdo] : reason),
             ""});
      }
    }
  }

  /// Velocity, torque and demand are shown if they can be.
  static bool needed(const Mapped& m) {
    return m.object != object::kVelocity && m.object != object::kTorque &&
           m.object != object::kDemand;
  }

  static bool carries(const std::vector<Mapped>& map, const Mapped& m) {
    return std::ranges::any_of(
        map, [&](const Mapped& each) { return each.object == m.object && each.bytes == m.bytes; });
  }

  std::vector<Mapped> mapping_of(std::uint16_t index, const EdsObject& count) const {
    std::vector<Mapped> out;
    for (std::int64_t sub = 1; sub <= std::min<std::int64_t>(count.value.value_or(0), 8); ++sub) {
      const auto entry = eds_.find({index, static_cast<std::uint8_t>(sub)});
      if (entry && entry->value) out.push_back(mapped(static_cast<std::uint32_t>(*entry->value)));
    }
    return out;
  }

  std::string unmappable(const Mapped& m, std::size_t pdo) const {
    const auto object = eds_.find(m.object);
    const std::string why = misfit(object, {.kind = SetupStep::Kind::expect,
                                            .object = m.object,
                                            .value = 0,
                                            .bytes = m.bytes,
                                            .meaning = ""});
    if (!why.empty()) return why;
    const bool fits = pdo == 0 ? object->to_drive : object->to_master;
    return fits ? "" : fmt::format("line {}: cannot be mapped", object->line);
  }

  const Eds& eds_;
  const std::vector<SetupStep>& steps_;
  std::vector<EdsFinding> out_;
  std::set<std::pair<std::uint16_t, std::uint8_t>> told_;
};

}  // namespace

std::vector<EdsFinding> lacks_of(const Eds& eds, const std::vector<SetupStep>& steps) {
  return Comparison(eds, steps).all();
}

}  // namespace mimesis::hw::cia402
