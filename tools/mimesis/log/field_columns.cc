#include "tools/mimesis/log/field_columns.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <iostream>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/field_text.h"

namespace mimesis::tool {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr std::string_view kEachText = "[*]";

/// "a.b[2].c[*]" -> a, b, 2, c, *
std::vector<std::string> parts_of(const std::string& path) {
  std::vector<std::string> parts;
  if (path.empty()) return parts;
  std::string part;
  bool after_bracket = false;
  const auto close = [&] {
    if (part.empty()) throw ConfigError("'" + path + "' is no field: expected as in a.b[2].c[*]");
    parts.push_back(std::move(part));
    part.clear();
  };
  for (const char c : path) {
    if (c == ']') {
      close();
      after_bracket = true;
    } else if (c == '.' || c == '[') {
      if (!after_bracket) close();
      after_bracket = false;
    } else {
      part += c;
    }
  }
  if (!after_bracket) close();
  return parts;
}

bool holds_message(const FieldDescriptor& f) {
  return f.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
}

}  // namespace

LogType::LogType(const log::Schema& schema, runtime::TypePool& pool) {
  if (cdr::RosType::reads(schema.encoding)) {
    ros_ = cdr::RosType::parse(schema.name, schema.encoding, schema.data);
    message_ = ros_->make();
    return;
  }
  message_ = pool.make(schema.name, schema.data);
  if (message_ == nullptr) throw ConfigError("its descriptor set does not define this type");
}

std::string LogType::read(std::string_view bytes) const {
  if (ros_ != nullptr) return ros_->read(bytes, *message_);
  return parse(bytes, *message_) ? "" : "no valid Protobuf of this type";
}

const LogDecoder::Known& LogDecoder::known(const log::Schema& schema) {
  const auto [it, first] = known_.try_emplace(&schema);
  if (!first || !LogType::reads(schema)) return it->second;
  try {
    it->second.type = std::make_unique<LogType>(schema, types_);
  } catch (const ConfigError& e) {
    it->second.trouble = e.what();
  }
  return it->second;
}

const LogType* LogDecoder::type(const log::Schema& schema) { return known(schema).type.get(); }
std::string LogDecoder::trouble(const log::Schema& schema) { return known(schema).trouble; }

const Descriptor& LogDecoder::type(const OpenChannel& channel) {
  const log::Schema* schema = channel.schema;
  if (schema != nullptr && LogType::reads(*schema, channel.channel->message_encoding)) {
    if (const LogType* known = type(*schema)) return *known->message().GetDescriptor();
    throw ConfigError(
        fmt::format("{} ({}): {}", channel.channel->topic, schema->name, trouble(*schema)));
  }
  throw ConfigError(fmt::format(
      "{}: messages are '{}', not Protobuf or ROS with a schema: they have no fields to choose",
      channel.channel->topic, channel.channel->message_encoding));
}

const Message* LogDecoder::decode(const Item& item) {
  const bool reads =
      item.schema != nullptr && LogType::reads(*item.schema, item.channel->message_encoding);
  const LogType* type = reads ? this->type(*item.schema) : nullptr;
  return type != nullptr && type->read(item.message->data).empty() ? &type->message() : nullptr;
}

const Message* LogDecoder::decode_or_tell(const Item& item) {
  const Message* message = decode(item);
  if (message == nullptr) {
    const LogType* type = item.schema == nullptr ? nullptr : this->type(*item.schema);
    std::cerr << fmt::format("{}: the message at log time {} ns is not a valid {}{}\n",
                             item.channel->topic, item.message->log_time, item.schema->name,
                             type == nullptr ? "" : ": " + type->read(item.message->data));
  }
  return message;
}

FieldQuery parse_field_query(const std::string& text, const std::vector<std::string>& topics) {
  const std::string* best = nullptr;
  for (const std::string& topic : topics) {
    const bool fits = text == topic || text.starts_with(topic + ".");
    if (fits && (best == nullptr || topic.size() > best->size())) best = &topic;
  }
  if (best != nullptr) {
    return {*best, text.size() == best->size() ? "" : text.substr(best->size() + 1)};
  }
  const std::size_t slash = text.rfind('/');
  const std::string topic = text.substr(0, text.find('.', slash == std::string::npos ? 0 : slash));
  throw ConfigError("no topic '" + topic + "' in the log" + runtime::did_you_mean(topic, topics));
}

FieldColumns::FieldColumns(FieldQuery query)
    : query_(std::move(query)), parts_(parts_of(query_.path)) {}

const std::vector<FieldColumns::Leaf>& FieldColumns::leaves(const Descriptor& type) {
  const auto [it, first] = by_type_.try_emplace(&type);
  if (first) {
    std::vector<Step> steps;
    find(type, 0, steps, it->second);
  }
  return it->second;
}

void FieldColumns::find(const Descriptor& type, std::size_t part, std::vector<Step>& steps,
                        std::vector<Leaf>& out) {
  if (part < parts_.size()) {
    return add_field(field_named(type, parts_[part], query_.topic + ": "), part + 1, steps, out);
  }
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& f = *type.field(i);
    const bool recursive = holds_message(f) && std::ranges::any_of(steps, [&](const Step& step) {
                             return step.field->containing_type() == f.message_type();
                           });
    if (f.type() != FieldDescriptor::TYPE_BYTES && !recursive && f.message_type() != &type) {
      add_field(f, part, steps, out);
    }
  }
}

void FieldColumns::add_field(const FieldDescriptor& field, std::size_t part,
                             std::vector<Step>& steps, std::vector<Leaf>& out) {
  Step step{&field, kWholeField};
  if (field.is_repeated()) {
    step.index = kEach;
    if (part < parts_.size()) {
      const auto index = runtime::to_int(parts_[part]);
      if (index && *index >= 0) step.index = *index;
      if (step.index != kEach || parts_[part] == "*") ++part;
    }
  }
  steps.push_back(step);
  if (holds_message(field)) {
    find(*field.message_type(), part, steps, out);
  } else if (part < parts_.size()) {
    throw ConfigError(query_.topic + "." + query_.path + ": " + field.name() + " of " +
                      field.containing_type()->full_name() + " has no '" + parts_[part] + "'");
  } else {
    std::string name;
    for (const Step& s : steps) {
      name += (name.empty() ? "" : ".") + s.field->name();
      if (s.index == kEach) name += kEachText;
      if (s.index >= 0) name += "[" + std::to_string(s.index) + "]";
    }
    const auto [it, first] = leaf_ids_.try_emplace(name, leaf_names_.size());
    if (first) leaf_names_.push_back(name);
    out.push_back({it->second, steps});
  }
  steps.pop_back();
}

void FieldColumns::visit(const Message& message,
                         const std::function<void(const Key&, const Value&)>& take) {
  Key key;
  for (const Leaf& leaf : leaves(*message.GetDescriptor())) {
    key.leaf = leaf.id;
    visit(message, leaf, 0, key, take);
  }
}

void FieldColumns::visit(const Message& m, const Leaf& leaf, std::size_t at, Key& key,
                         const std::function<void(const Key&, const Value&)>& take) const {
  const Step& step = leaf.steps[at];
  const FieldDescriptor& f = *step.field;
  const auto& r = *m.GetReflection();
  const auto below = [&](int index) {
    if (!holds_message(f)) return take(key, {m, f, index});
    visit(index == kWholeField ? r.GetMessage(m, &f) : r.GetRepeatedMessage(m, &f, index), leaf,
          at + 1, key, take);
  };
  if (step.index == kWholeField) {
    if (!f.has_presence() || r.HasField(m, &f)) below(kWholeField);
  } else if (step.index != kEach) {
    if (step.index < r.FieldSize(m, &f)) below(step.index);
  } else {
    for (int i = 0; i < r.FieldSize(m, &f); ++i) {
      key.indexes.push_back(i);
      below(i);
      key.indexes.pop_back();
    }
  }
}

bool FieldColumns::has_numbers(const Descriptor& type) {
  return std::ranges::any_of(leaves(type),
                             [](const Leaf& leaf) { return is_number(*leaf.steps.back().field); });
}

std::string FieldColumns::name(const Key& key) const {
  std::string name = leaf_names_.at(key.leaf);
  std::size_t at = 0;
  for (const int index : key.indexes) {
    at = name.find(kEachText, at);
    name.replace(at, kEachText.size(), "[" + std::to_string(index) + "]");
  }
  return name;
}

}  // namespace mimesis::tool
