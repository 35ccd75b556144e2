#pragma once
#include <cstdint>
#include <string>

namespace google::protobuf {
class Descriptor;
}

namespace mimesis::runtime {

/// FNV-1a over the descriptors of `type` and of all types it uses, by name; other types in the same
/// files do not count. Equal hashes: both ends read the bytes alike.
std::uint64_t type_hash(const google::protobuf::Descriptor& type);

/// Serialised FileDescriptorSet with the file of `type` and its imports, imports first.
std::string descriptor_set(const google::protobuf::Descriptor& type);

}  // namespace mimesis::runtime
