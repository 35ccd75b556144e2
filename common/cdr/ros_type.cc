#include "common/cdr/ros_type.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <set>
#include <utility>
#include <vector>

#include "common/cdr/definition.h"
#include "common/error.h"

namespace mimesis::cdr {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FieldDescriptorProto;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr std::size_t kDeepest = 32;

/// What a schema may leave out, since every ROS has it.
const Definitions& everywhere() {
  static const Definitions kKnown = [] {
    Definitions d;
    d["builtin_interfaces/Time"] = d["builtin_interfaces/Duration"] = {
        {.name = "sec", .kind = Kind::int32}, {.name = "nanosec", .kind = Kind::uint32}};
    d["std_msgs/Header"] = {{.name = "stamp", .type = "builtin_interfaces/Time"},
                            {.name = "frame_id", .kind = Kind::string}};
    d["service_msgs/ServiceEventInfo"] = {{.name = "event_type", .kind = Kind::uint8},
                                          {.name = "stamp", .type = "builtin_interfaces/Time"},
                                          {.name = "client_gid", .kind = Kind::uint8, .count = 16},
                                          {.name = "sequence_number", .kind = Kind::int64}};
    return d;
  }();
  return kKnown;
}

FieldDescriptorProto::Type proto_type(Kind kind, bool list) {
  switch (kind) {
    case Kind::boolean:
      return FieldDescriptorProto::TYPE_BOOL;
    case Kind::uint8:
      return list ? FieldDescriptorProto::TYPE_BYTES : FieldDescriptorProto::TYPE_UINT32;
    case Kind::uint16:
    case Kind::uint32:
      return FieldDescriptorProto::TYPE_UINT32;
    case Kind::int8:
    case Kind::int16:
    case Kind::int32:
      return FieldDescriptorProto::TYPE_INT32;
    case Kind::int64:
      return FieldDescriptorProto::TYPE_INT64;
    case Kind::uint64:
      return FieldDescriptorProto::TYPE_UINT64;
    case Kind::float32:
      return FieldDescriptorProto::TYPE_FLOAT;
    case Kind::float64:
      return FieldDescriptorProto::TYPE_DOUBLE;
    case Kind::string:
    case Kind::wstring:
      return FieldDescriptorProto::TYPE_STRING;
    default:
      return FieldDescriptorProto::TYPE_MESSAGE;
  }
}

/// Messages in one file: nested names would hide each other, so "pkg/Type" is package.Type there.
class Descriptors {
 public:
  explicit Descriptors(const Definitions& types) : types_(types) {}

  google::protobuf::FileDescriptorProto file(const std::string& name) {
    file_.set_name(name + ".ros");
    file_.set_syntax("proto3");
    add(name);
    return std::move(file_);
  }
  static std::string proto_name(std::string name) {
    name.replace(name.find('/'), 1, "_");
    return name;
  }

 private:
  void add(const std::string& name) {
    const bool within = std::ranges::find(open_, name) != open_.end();
    if (within || open_.size() > kDeepest) throw ConfigError(name + ": types contain each other");
    if (!done_.insert(name).second) return;
    open_.push_back(name);
    google::protobuf::DescriptorProto message;
    message.set_name(proto_name(name));
    int number = 0;
    for (const Member& m : members(name)) {
      FieldDescriptorProto& field = *message.add_field();
      field.set_name(m.name);
      field.set_json_name(m.name);
      field.set_number(++number);
      field.set_type(proto_type(m.kind, m.list()));
      const bool repeated = m.list() && field.type() != FieldDescriptorProto::TYPE_BYTES;
      field.set_label(repeated ? FieldDescriptorProto::LABEL_REPEATED
                               : FieldDescriptorProto::LABEL_OPTIONAL);
      if (m.kind != Kind::structure) continue;
      if (!types_.contains(m.type) && !everywhere().contains(m.type)) {
        throw ConfigError(
            fmt::format("{} of field '{}' of {} is not defined", m.type, m.name, name));
      }
      field.set_type_name("." + proto_name(m.type));
      add(m.type);
    }
    open_.pop_back();
    *file_.add_message_type() = std::move(message);
  }
  const std::vector<Member>& members(const std::string& name) const {
    const auto found = types_.find(name);
    return found != types_.end() ? found->second : everywhere().at(name);
  }

  const Definitions& types_;
  std::set<std::string> done_;
  std::vector<std::string> open_;
  google::protobuf::FileDescriptorProto file_;
};

/// Bytes do not hold the type; where is told by whoever knows the field.
struct Wrong {
  std::string what, field{};
};

class Reader {
 public:
  Reader(std::string_view bytes, bool little, std::size_t most_aligned, int wide)
      : bytes_(bytes),
        swap_(little != (std::endian::native == std::endian::little)),
        most_aligned_(most_aligned),
        wide_(wide) {}

  template <class T>
  T number() {
    const std::size_t align = std::min(sizeof(T), most_aligned_);
    at_ = (at_ + align - 1) / align * align;
    const std::string_view from = take(sizeof(T));
    char raw[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) raw[i] = from[swap_ ? sizeof(T) - 1 - i : i];
    T value;
    std::memcpy(&value, raw, sizeof value);
    return value;
  }
  std::string_view take(std::size_t n) {
    if (at_ > bytes_.size() || n > bytes_.size() - at_) throw Wrong{"the message ends"};
    at_ += n;
    return bytes_.substr(at_ - n, n);
  }
  std::string_view string() {
    const auto n = number<std::uint32_t>();
    const std::string_view text = take(n);
    if (n == 0) return text;  // some writers leave the final zero out
    if (text.back() != '\0') throw Wrong{"a string does not end with 0"};
    return text.substr(0, n - 1);
  }
  /// UTF-16 in 4 or 2 bytes a character, as implementations have it.
  std::string wstring() {
    const auto n = number<std::uint32_t>();
    if (n > left() / static_cast<std::size_t>(wide_)) throw Wrong{"the message ends"};
    std::string text;
    for (std::uint32_t i = 0; i < n; ++i) {
      std::uint32_t c = unit();
      if (c == 0 && i + 1 == n) break;
      if (c >= 0xD800 && c < 0xDC00 && i + 1 < n) {
        const std::uint32_t low = unit();
        ++i;
        if (low < 0xDC00 || low > 0xDFFF) throw Wrong{"a wstring is no UTF-16"};
        c = 0x10000 + ((c - 0xD800) << 10U) + (low - 0xDC00);
      }
      add_utf8(c, text);
    }
    return text;
  }
  std::size_t left() const { return at_ < bytes_.size() ? bytes_.size() - at_ : 0; }

 private:
  std::uint32_t unit() { return wide_ == 4 ? number<std::uint32_t>() : number<std::uint16_t>(); }
  static void add_utf8(std::uint32_t c, std::string& text) {
    if (c > 0x10FFFF || (c >= 0xD800 && c <= 0xDFFF)) throw Wrong{"a wstring is no UTF-16"};
    const auto byte = [&](std::uint32_t b) { text += static_cast<char>(b); };
    if (c < 0x80) return byte(c);
    if (c >= 0x10000) {
      byte(0xF0U | (c >> 18U)), byte(0x80U | ((c >> 12U) & 0x3FU));
    } else if (c >= 0x800) {
      byte(0xE0U | (c >> 12U));
    } else {
      return byte(0xC0U | (c >> 6U)), byte(0x80U | (c & 0x3FU));
    }
    byte(0x80U | ((c >> 6U) & 0x3FU)), byte(0x80U | (c & 0x3FU));
  }

  std::string_view bytes_;
  bool swap_;
  std::size_t most_aligned_, at_ = 0;
  int wide_;
};

}  // namespace

struct RosType::Impl {
  struct Field {
    const FieldDescriptor* to;
    Kind kind;
    bool sequence;
    std::uint32_t count;
  };

  std::string name;
  google::protobuf::DescriptorPool pool;
  google::protobuf::DynamicMessageFactory factory;
  const Descriptor* type = nullptr;
  std::map<const Descriptor*, std::vector<Field>> fields;
  bool has_wstring = false;

  void know(const std::string& of, const Definitions& types) {
    const Descriptor* d = pool.FindMessageTypeByName(Descriptors::proto_name(of));
    if (fields.contains(d)) return;
    const auto found = types.find(of);
    const auto& members = found != types.end() ? found->second : everywhere().at(of);
    std::vector<Field> all;
    for (std::size_t i = 0; i < members.size(); ++i) {
      all.push_back(
          {d->field(static_cast<int>(i)), members[i].kind, members[i].sequence, members[i].count});
      has_wstring = has_wstring || members[i].kind == Kind::wstring;
    }
    fields[d] = std::move(all);
    for (const Member& m : members) {
      if (m.kind == Kind::structure) know(m.type, types);
    }
  }

  void structure(Reader& from, Message& into) const {
    const std::vector<Field>& all = fields.at(into.GetDescriptor());
    if (all.empty()) from.take(std::min<std::size_t>(1, from.left()));  // a byte that stands for it
    for (const Field& f : all) {
      try {
        field(from, f, into);
      } catch (Wrong& wrong) {
        const std::string inner = wrong.field.empty() ? "" : "." + wrong.field;
        throw Wrong{wrong.what, f.to->name() + inner};
      }
    }
  }
  void field(Reader& from, const Field& f, Message& into) const {
    const Reflection& r = *into.GetReflection();
    const bool list = f.sequence || f.count > 0;
    if (!list) return one(from, f, into, r, false);
    const std::uint32_t n = f.sequence ? from.number<std::uint32_t>() : f.count;
    if (f.sequence && f.count > 0 && n > f.count) {
      throw Wrong{fmt::format("{} elements, at most {}", n, f.count)};
    }
    if (f.kind == Kind::uint8) return r.SetString(&into, f.to, std::string(from.take(n)));
    if (n > from.left()) throw Wrong{"the message ends"};  // an element takes a byte at least
    for (std::uint32_t i = 0; i < n; ++i) one(from, f, into, r, true);
  }
  void one(Reader& from, const Field& f, Message& into, const Reflection& r, bool add) const {
    const auto put = [&](auto value, auto set, auto append) {
      add ? (r.*append)(&into, f.to, value) : (r.*set)(&into, f.to, value);
    };
    const auto i32 = [&](std::int32_t v) { put(v, &Reflection::SetInt32, &Reflection::AddInt32); };
    const auto u32 = [&](std::uint32_t v) {
      put(v, &Reflection::SetUInt32, &Reflection::AddUInt32);
    };
    const auto text = [&](std::string v) {
      add ? r.AddString(&into, f.to, std::move(v)) : r.SetString(&into, f.to, std::move(v));
    };
    switch (f.kind) {
      case Kind::boolean: {
        const auto v = from.number<std::uint8_t>();
        if (v > 1) throw Wrong{fmt::format("{} is no bool", v)};
        return put(v == 1, &Reflection::SetBool, &Reflection::AddBool);
      }
      case Kind::uint8:
        return u32(from.number<std::uint8_t>());
      case Kind::int8:
        return i32(from.number<std::int8_t>());
      case Kind::int16:
        return i32(from.number<std::int16_t>());
      case Kind::uint16:
        return u32(from.number<std::uint16_t>());
      case Kind::int32:
        return i32(from.number<std::int32_t>());
      case Kind::uint32:
        return u32(from.number<std::uint32_t>());
      case Kind::int64:
        return put(from.number<std::int64_t>(), &Reflection::SetInt64, &Reflection::AddInt64);
      case Kind::uint64:
        return put(from.number<std::uint64_t>(), &Reflection::SetUInt64, &Reflection::AddUInt64);
      case Kind::float32:
        return put(from.number<float>(), &Reflection::SetFloat, &Reflection::AddFloat);
      case Kind::float64:
        return put(from.number<double>(), &Reflection::SetDouble, &Reflection::AddDouble);
      case Kind::string:
        return text(std::string(from.string()));
      case Kind::wstring:
        return text(from.wstring());
      case Kind::structure:
        return structure(from, *(add ? r.AddMessage(&into, f.to) : r.MutableMessage(&into, f.to)));
    }
  }

  std::string read(std::string_view bytes, Message& into, int wide) const {
    into.Clear();
    if (bytes.size() < 4) return "shorter than the 4 bytes of CDR's header";
    const auto kind = static_cast<unsigned>(static_cast<unsigned char>(bytes[1]));
    const bool first = kind <= 1, second = kind == 6 || kind == 7;
    if (bytes[0] != 0 || !(first || second)) {
      return fmt::format(
          "its header says {:02x}{:02x}: expected plain CDR, 0000, 0001, 0006 or 0007",
          static_cast<unsigned char>(bytes[0]), kind);
    }
    Reader from(bytes.substr(4), kind % 2 == 1, first ? 8 : 4, wide);
    try {
      structure(from, into);
    } catch (const Wrong& wrong) {
      return fmt::format("field {}: {}", wrong.field, wrong.what);
    }
    // Messages are padded to whole words.
    return from.left() < 4 ? "" : fmt::format("{} bytes more than the type has", from.left());
  }
};

std::shared_ptr<const RosType> RosType::parse(const std::string& name, std::string_view encoding,
                                              std::string_view text) {
  auto impl = std::make_unique<Impl>();
  impl->name = short_name(name);
  if (impl->name.find('/') == std::string::npos) {
    throw ConfigError("'" + name + "': expected package/msg/Type");
  }
  const Definitions types = encoding == "ros2idl" ? parse_idl(text) : parse_msg(impl->name, text);
  if (!types.contains(impl->name)) throw ConfigError(name + " is not defined");
  class Silent : public google::protobuf::DescriptorPool::ErrorCollector {
   public:
    void AddError(const std::string&, const std::string& element, const Message*, ErrorLocation,
                  const std::string& message) override {
      if (first.empty()) first = element + ": " + message;
    }
    std::string first;
  } errors;
  const auto file = Descriptors(types).file(impl->name);
  if (impl->pool.BuildFileCollectingErrors(file, &errors) == nullptr)
    throw ConfigError(errors.first);
  impl->type = impl->pool.FindMessageTypeByName(Descriptors::proto_name(impl->name));
  impl->know(impl->name, types);
  return std::shared_ptr<const RosType>(new RosType(std::move(impl)));
}

RosType::RosType(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RosType::~RosType() = default;

std::unique_ptr<Message> RosType::make() const {
  return std::unique_ptr<Message>(impl_->factory.GetPrototype(impl_->type)->New());
}

std::string RosType::read(std::string_view bytes, Message& into) const {
  std::string why = impl_->read(bytes, into, 4);
  if (why.empty() || !impl_->has_wstring) return why;
  return impl_->read(bytes, into, 2).empty() ? "" : why;
}

}  // namespace mimesis::cdr
