#pragma once
#include <google/protobuf/message.h>

#include <string>
#include <string_view>
#include <vector>

namespace mimesis::tool {

/// How fields of type bytes look: {"bytes": LENGTH}, or a string.
enum class BytesText { length, base64, hex };

/// Appends JSON text to a buffer, in the shape of message_json.h but ten times as fast: for logs.
class JsonText {
 public:
  JsonText(std::string& out, BytesText bytes) : out_(out), bytes_(bytes) {}

  void message(const google::protobuf::Message& message);
  /// Value at the end of a path; null for an element that is not there.
  void field(const google::protobuf::Message& message, const class FieldPath& path);
  void string(std::string_view text);  ///< escaped; what is no UTF-8 becomes U+FFFD
  void raw(std::string_view text) { out_ += text; }
  template <class Integer>
  void integer(Integer value);
  void bytes(std::string_view data);

 private:
  void value(const google::protobuf::Message& m, const google::protobuf::FieldDescriptor& f);
  void scalar(const google::protobuf::Message& m, const google::protobuf::FieldDescriptor& f,
              int i);
  template <class Float>
  void floating(Float value);

  std::string& out_;
  BytesText bytes_;
};

/// "blobs.0.u_px" resolved once for a type.
class FieldPath {
 public:
  /// @throws ConfigError with a suggestion if the type has no such field.
  FieldPath(const google::protobuf::Descriptor& type, const std::string& path);
  const std::string& text() const { return text_; }

 private:
  friend class JsonText;
  struct Step {
    const google::protobuf::FieldDescriptor* field;
    int index;  ///< of a repeated field, or kWhole
  };
  std::string text_;
  std::vector<Step> steps_;
};

}  // namespace mimesis::tool
