// Logs of ROS 2: messages in CDR, by the definitions in the file.
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "tools/mimesis/log/cat.h"
#include "tools/mimesis/log/field_columns.h"
#include "tools/mimesis/log/message_diff.h"
#include "tools/mimesis/log/test/log_builder.h"
#include "tools/mimesis/log/test/tool_logs.h"

namespace mimesis::tool {
namespace {

using namespace std::literals;
using nlohmann::ordered_json;

/// test_msgs/msg/Pair: a float and a string.
std::string pair_bytes(float x, const std::string& text) {
  std::string bytes = "\0\1\0\0"s;
  bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
  const auto n = static_cast<std::uint32_t>(text.size() + 1);
  bytes.append(reinterpret_cast<const char*>(&n), sizeof n);
  return bytes + text + '\0';
}

class RosLog : public testlogs::ToolLogs {
 protected:
  std::string bag(const std::string& name, const std::vector<std::string>& messages,
                  const std::string& definition = "float32 x\nstring text\n") {
    LogBuilder log;
    log::Writer& writer = log.writer();
    const auto schema = writer.add_schema("test_msgs/msg/Pair", "ros2msg", definition);
    const auto channel = writer.add_channel(schema.value(), "/pair", "cdr", {});
    for (std::uint32_t i = 0; i < messages.size(); ++i) {
      EXPECT_TRUE(writer.write({channel.value(), i, i, i, messages[i]}));
    }
    return save(name, log.finish());
  }
  std::vector<ordered_json> cat(const CatOptions& options, int code = 0) {
    std::string text;
    const auto logs = open_logs(options.files);
    EXPECT_EQ(cat_messages(logs, options, [&](std::string_view part) { text += part; }), code);
    std::vector<ordered_json> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(ordered_json::parse(line));
    return lines;
  }
};

TEST_F(RosLog, IsShownByItsDefinitions) {
  CatOptions options;
  options.files = {bag("a.mcap", {pair_bytes(1.5F, "one"), pair_bytes(-2.0F, "two")})};
  const auto lines = cat(options);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0]["message"], (ordered_json{{"x", 1.5}, {"text", "one"}}));
  options.fields = {"x"};
  EXPECT_EQ(cat(options)[1]["fields"], (ordered_json{{"x", -2.0}}));
  options.fields = {"y"};
  EXPECT_THROW((void)cat(options), ConfigError);
}

TEST_F(RosLog, SaysWhatIsWrongWithAMessageOrADefinition) {
  CatOptions options;
  options.files = {bag("cut.mcap", {pair_bytes(1.5F, "one").substr(0, 10)})};
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(cat(options, 1)[0]["message"], (ordered_json{{"bytes", 10}}));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "/pair (test_msgs/msg/Pair): holds messages that are not of their type: lengths only "
            "(field text: the message ends)\n");
  options.files = {bag("none.mcap", {pair_bytes(1.5F, "one")}, "float32\n")};
  ::testing::internal::CaptureStderr();
  (void)cat(options);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "/pair (test_msgs/msg/Pair): its definition cannot be read: lengths only (line 1: "
            "'float32': expected a type and a name)\n");
}

TEST_F(RosLog, HasFieldsToPlotAndToCompare) {
  const auto logs = open_logs({bag("a.mcap", {pair_bytes(1.5F, "one")})});
  LogDecoder decoder;
  const OpenChannel channel = channels_of(logs).at(0);
  FieldColumns columns({"/pair", "x"});
  EXPECT_TRUE(columns.has_numbers(decoder.type(channel)));
  PayloadDiff diff;
  const log::Schema& schema = *channel.schema;
  const std::string a = pair_bytes(1.5F, "one"), b = pair_bytes(1.25F, "one");
  const MessageDifference found = diff.diff({a, &schema}, {b, &schema}, {});
  ASSERT_EQ(found.fields.size(), 1u);
  EXPECT_EQ(found.fields[0].path, "x");
}

}  // namespace
}  // namespace mimesis::tool
