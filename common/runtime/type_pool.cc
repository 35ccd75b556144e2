#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>

#include <map>

#include "common/runtime/raw.h"

namespace mimesis::runtime {

struct TypePool::Impl {
  struct Set {
    google::protobuf::DescriptorPool pool;
    google::protobuf::DynamicMessageFactory factory{&pool};
  };
  /// One pool per descriptor set: two builds may define a type differently.
  std::map<std::string, std::unique_ptr<Set>> sets;
};

TypePool::TypePool() : impl_(std::make_unique<Impl>()) {}
TypePool::~TypePool() = default;

std::unique_ptr<google::protobuf::Message> TypePool::make(const std::string& type,
                                                          const std::string& descriptor_set) {
  std::unique_ptr<Impl::Set>& set = impl_->sets[descriptor_set];
  if (!set) {
    set = std::make_unique<Impl::Set>();
    google::protobuf::FileDescriptorSet files;
    if (files.ParseFromString(descriptor_set)) {
      for (const auto& file : files.file()) set->pool.BuildFile(file);
    }
  }
  const google::protobuf::Descriptor* descriptor = set->pool.FindMessageTypeByName(type);
  if (descriptor == nullptr) return nullptr;
  return std::unique_ptr<google::protobuf::Message>(set->factory.GetPrototype(descriptor)->New());
}

}  // namespace mimesis::runtime
