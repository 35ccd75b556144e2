#include "common/runtime/ports.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <cmath>
#include <string>

namespace mimesis::runtime {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

std::string indexed(const std::string& name, const FieldDescriptor* field, int i) {
  return field->is_repeated() ? name + "[" + std::to_string(i) + "]" : name;
}

/// Path and value of the first field that is NaN or infinite, empty if there is none.
std::string first_not_finite(const Message& m, const std::string& prefix) {
  std::vector<const FieldDescriptor*> fields;
  const Reflection* r = m.GetReflection();
  r->ListFields(m, &fields);
  for (const FieldDescriptor* f : fields) {
    const int n = f->is_repeated() ? r->FieldSize(m, f) : 1;
    const auto path = [&](int i) { return indexed(prefix + f->name(), f, i); };
    for (int i = 0; i < n; ++i) {
      double value = 0.0;
      switch (f->cpp_type()) {
        case FieldDescriptor::CPPTYPE_DOUBLE:
          value = f->is_repeated() ? r->GetRepeatedDouble(m, f, i) : r->GetDouble(m, f);
          break;
        case FieldDescriptor::CPPTYPE_FLOAT:
          value = f->is_repeated() ? r->GetRepeatedFloat(m, f, i) : r->GetFloat(m, f);
          break;
        case FieldDescriptor::CPPTYPE_MESSAGE: {
          std::string inner = first_not_finite(
              f->is_repeated() ? r->GetRepeatedMessage(m, f, i) : r->GetMessage(m, f),
              path(i) + ".");
          if (!inner.empty()) return inner;
          continue;
        }
        default:
          i = n;
          continue;
      }
      if (!std::isfinite(value)) return path(i) + " is " + std::to_string(value);
    }
  }
  return {};
}

}  // namespace

struct InPort::Impl {
  std::unique_ptr<InChannel> channel;
  std::unique_ptr<Message> newest, scratch;
  bool any = false;
};

InPort::InPort(Bus& bus, std::string_view port, const Message& prototype, const InOptions& options)
    : impl_(std::make_unique<Impl>()) {
  impl_->channel = bus.subscribe(port, prototype, options);
  impl_->newest.reset(prototype.New());
  impl_->scratch.reset(prototype.New());
}

InPort::~InPort() = default;

bool InPort::next(Message& out) {
  while (auto received = impl_->channel->pop()) {
    if (!out.ParseFromString(received->payload)) {
      impl_->channel->reject(*received, "is not a valid " + out.GetTypeName());
      continue;
    }
    if (const std::string bad = first_not_finite(out, ""); !bad.empty()) {
      impl_->channel->reject(*received, "field " + bad);
      continue;
    }
    if (received->stamp < Time::zero()) {
      impl_->channel->reject(*received, "its stamp is " + std::to_string(received->stamp.count()) +
                                            " ns, expected 0 to 2^63 - 1");
      continue;
    }
    newest_stamp_ = received->stamp;
    newest_source_ = received->source;
    ++valid_;
    return true;
  }
  return false;
}

const Message* InPort::newest() {
  while (next(*impl_->scratch)) {
    impl_->newest.swap(impl_->scratch);
    impl_->any = true;
    unseen_ = true;
  }
  return impl_->any ? impl_->newest.get() : nullptr;
}

}  // namespace mimesis::runtime
