// Our foxglove.* messages against the published schemas (npm @foxglove/schemas): viewers know them
// by name, number and type of their fields.
#include <fmt/format.h>
#include <google/protobuf/descriptor.pb.h>

#include <fstream>

#include "common/testing/process.h"
#include "tests/peer/foreign.h"

namespace mimesis::peer {
namespace {

using google::protobuf::DescriptorProto;
using google::protobuf::EnumDescriptorProto;
using google::protobuf::FileDescriptorSet;
/// Fields of a type, by its full name, as the wire and the readers know them.
using Types = std::map<std::string, std::string>;

void describe(const EnumDescriptorProto& type, const std::string& scope, Types& types) {
  std::map<int, std::string> values;
  for (const auto& value : type.value()) values[value.number()] += value.name() + ' ';
  std::string& text = types[scope + type.name()];
  for (const auto& [number, names] : values) text += fmt::format("{} = {}\n", names, number);
}

void describe(const DescriptorProto& type, const std::string& scope, Types& types) {
  const std::string name = scope + type.name();
  std::map<int, std::string> fields;
  for (const auto& field : type.field()) {
    fields[field.number()] =
        fmt::format("{} = {}: label {}, type {} {}{}\n", field.name(), field.number(),
                    static_cast<int>(field.label()), static_cast<int>(field.type()),
                    field.type_name(), field.proto3_optional() ? ", optional" : "");
  }
  std::string& text = types[name];
  for (const auto& [number, line] : fields) text += line;
  for (const auto& nested : type.nested_type()) describe(nested, name + ".", types);
  for (const auto& nested : type.enum_type()) describe(nested, name + ".", types);
}

/// The foxglove.* types of a set of files.
Types foxglove_types(const FileDescriptorSet& set) {
  Types types;
  for (const auto& file : set.file()) {
    if (file.package() != "foxglove") continue;
    for (const auto& type : file.message_type()) describe(type, "foxglove.", types);
    for (const auto& type : file.enum_type()) describe(type, "foxglove.", types);
  }
  return types;
}

class SchemasPeer : public Foreign {
 protected:
  void SetUp() override {
    Foreign::SetUp();
    if (IsSkipped()) return;
    if (run("command -v protoc").status != 0) GTEST_SKIP() << "protoc is not installed";
    ASSERT_EQ(run_script("foxglove_protos.js", folder_.string()).status, 0);
    published_ = compiled(folder_.string(), "foxglove");
    ASSERT_GT(published_.size(), 40u);
  }
  Types compiled(const std::string& root, const std::string& protos) {
    const std::string file = (folder_ / "set.bin").string();
    EXPECT_EQ(run(fmt::format("cd '{}' && protoc -I . --include_imports --descriptor_set_out={} "
                              "{}/*.proto",
                              root, file, protos))
                  .status,
              0);
    std::ifstream in(file, std::ios::binary);
    FileDescriptorSet set;
    EXPECT_TRUE(set.ParseFromIstream(&in));
    return foxglove_types(set);
  }
  void expect_published(const Types& types, const std::string& where) {
    for (const auto& [name, text] : types) {
      const auto it = published_.find(name);
      ASSERT_NE(it, published_.end()) << where << ": " << name << " is not published";
      EXPECT_EQ(text, it->second) << where << ": " << name;
    }
  }
  Types published_;
};

TEST_F(SchemasPeer, OurProtosAreThePublishedOnes) {
  const Types ours = compiled(MIMESIS_SOURCE_DIR, "proto/foxglove");
  EXPECT_GT(ours.size(), 30u);
  expect_published(ours, "proto/foxglove");
}

}  // namespace
}  // namespace mimesis::peer
