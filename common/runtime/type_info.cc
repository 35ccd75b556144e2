#include "common/runtime/type_info.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <map>
#include <set>
#include <string_view>

namespace mimesis::runtime {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;

void collect(const Descriptor& type, std::map<std::string, std::string>& parts) {
  google::protobuf::DescriptorProto proto;
  type.CopyTo(&proto);
  if (!parts.emplace(type.full_name(), proto.SerializeAsString()).second) return;
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor* field = type.field(i);
    if (field->message_type() != nullptr) collect(*field->message_type(), parts);
    if (field->enum_type() != nullptr) {
      google::protobuf::EnumDescriptorProto values;
      field->enum_type()->CopyTo(&values);
      parts.emplace(field->enum_type()->full_name(), values.SerializeAsString());
    }
  }
}

void collect(const FileDescriptor& file, std::set<std::string>& seen,
             google::protobuf::FileDescriptorSet& set) {
  if (!seen.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) collect(*file.dependency(i), seen, set);
  file.CopyTo(set.add_file());
}

}  // namespace

std::uint64_t type_hash(const Descriptor& type) {
  std::map<std::string, std::string> parts;
  collect(type, parts);
  std::uint64_t hash = 0xcbf29ce484222325U;
  const auto add = [&](std::string_view bytes) {
    for (const char c : bytes) {
      hash ^= static_cast<unsigned char>(c);
      hash *= 0x100000001b3U;
    }
  };
  add(type.full_name());
  for (const auto& [name, bytes] : parts) {
    add(name);
    add(bytes);
  }
  return hash;
}

std::string descriptor_set(const Descriptor& type) {
  google::protobuf::FileDescriptorSet set;
  std::set<std::string> seen;
  collect(*type.file(), seen, set);
  return set.SerializeAsString();
}

}  // namespace mimesis::runtime
