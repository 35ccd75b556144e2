// The published conformance data of the format: ../shared/mcap-conformance (416 files, see its
// README).
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "common/log/indexed_reader.h"
#include "common/log/test/conformance_json.h"
#include "common/log/writer.h"
#include "common/shared_data.h"

namespace mimesis::log {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

fs::path data_folder() { return shared_data("mcap-conformance/data"); }

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

struct Case {
  std::string name, mcap;
  json expected;
  std::set<std::string> features;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const auto& entry : fs::recursive_directory_iterator(data_folder())) {
    if (entry.path().extension() != ".mcap") continue;
    Case c{entry.path().stem().string(), read_file(entry.path()), {}, {}};
    c.expected = json::parse(read_file(fs::path(entry.path()).replace_extension(".json")));
    for (const json& f : c.expected["meta"]["variant"]["features"]) c.features.insert(f);
    all.push_back(std::move(c));
  }
  return all;
}

class Conformance : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(data_folder()))
      GTEST_SKIP() << "not here: no conformance data at " << data_folder();
  }
};

TEST_F(Conformance, StreamedReaderReads416Of416) {
  int passed = 0;
  for (const Case& c : cases()) {
    const MemorySource source(c.mcap);
    StreamReader reader(source);
    json records = json::array();
    while (const Record* r = reader.next()) records.push_back(to_json(*r));
    EXPECT_EQ(records, c.expected["records"]) << c.name;
    EXPECT_TRUE(reader.complete()) << c.name;
    for (const Damage& d : reader.damages())
      ADD_FAILURE() << c.name << ": " << d.offset << ": " << d.what;
    passed += records == c.expected["records"] && reader.damage_count() == 0;
  }
  EXPECT_EQ(passed, 416);
}

TEST_F(Conformance, IndexedReaderReads16Of16) {
  int passed = 0;
  for (const Case& c : cases()) {
    const bool eligible =
        std::ranges::all_of(std::array{"ch", "chx", "mx", "rch", "rsh"},
                            [&](const char* f) { return c.features.contains(f); });
    if (!eligible) continue;
    json schemas = json::array(), channels = json::array(), messages = json::array(), statistics;
    for (const json& r : c.expected["records"]) {
      const auto keep = [&](json& list) {
        if (std::ranges::find(list, r) == list.end()) list.push_back(r);
      };
      if (r["type"] == "Schema") keep(schemas);
      if (r["type"] == "Channel") keep(channels);
      if (r["type"] == "Message") messages.push_back(r);
      if (r["type"] == "Statistics") statistics = r;
    }
    std::stable_sort(messages.begin(), messages.end(), [](const json& a, const json& b) {
      return number(a, "log_time") < number(b, "log_time");
    });

    const MemorySource source(c.mcap);
    const auto summary = summarize(source);
    ASSERT_TRUE(summary) << c.name;
    EXPECT_TRUE(summary->from_file) << c.name;
    EXPECT_EQ(summary->counted, c.features.contains("st")) << c.name;
    json ours_schemas = json::array(), ours_channels = json::array(), ours_messages = json::array();
    for (const auto& [id, s] : summary->schemas) ours_schemas.push_back(to_json(s));
    for (const auto& [id, ch] : summary->channels) ours_channels.push_back(to_json(ch));
    IndexedReader reader(source, *summary);
    while (const Message* m = reader.next()) ours_messages.push_back(to_json(*m));
    const bool same_statistics =
        !c.features.contains("st") || to_json(summary->statistics) == statistics;
    EXPECT_EQ(ours_schemas, schemas) << c.name;
    EXPECT_EQ(ours_channels, channels) << c.name;
    EXPECT_EQ(ours_messages, messages) << c.name;
    EXPECT_TRUE(same_statistics) << c.name;
    passed += ours_schemas == schemas && ours_channels == channels && ours_messages == messages &&
              same_statistics && reader.damages().empty();
  }
  EXPECT_EQ(passed, 16);
}

std::string write(const Case& c) {
  const auto has = [&](const char* f) { return c.features.contains(f); };
  std::string out;
  MemorySink sink(out);
  Writer writer(sink, {.profile = "",
                       .library = "",
                       .compression = Compression::none,
                       .chunk_size = has("ch") ? std::size_t{1} << 20 : 0,
                       .message_index = has("mx"),
                       .chunk_index = has("chx"),
                       .statistics = has("st"),
                       .repeat_schemas = has("rsh"),
                       .repeat_channels = has("rch"),
                       .attachment_index = has("ax"),
                       .metadata_index = has("mdx"),
                       .summary_offsets = has("sum")});
  for (const json& r : c.expected["records"]) {
    const std::string type = r["type"];
    if (type == "DataEnd") break;
    if (type == "Schema") {
      EXPECT_TRUE(writer.add_schema(text(r, "name"), text(r, "encoding"), bytes(r, "data")));
    } else if (type == "Channel") {
      EXPECT_TRUE(writer.add_channel(static_cast<std::uint16_t>(number(r, "schema_id")),
                                     text(r, "topic"), text(r, "message_encoding"),
                                     field(r, "metadata")));
    } else if (type == "Message") {
      const std::string data = bytes(r, "data");
      EXPECT_TRUE(writer.write({static_cast<std::uint16_t>(number(r, "channel_id")),
                                static_cast<std::uint32_t>(number(r, "sequence")),
                                number(r, "log_time"), number(r, "publish_time"), data}));
    } else if (type == "Attachment") {
      const std::string data = bytes(r, "data");
      Attachment a{number(r, "log_time"), number(r, "create_time"), text(r, "name"),
                   text(r, "media_type"), data};
      EXPECT_TRUE(writer.attach(a));
    } else if (type == "Metadata") {
      EXPECT_TRUE(writer.add_metadata({text(r, "name"), field(r, "metadata")}));
    }
  }
  EXPECT_TRUE(writer.finish());
  return out;
}

TEST_F(Conformance, WriterWrites208Of208ByteExact) {
  int passed = 0;
  for (const Case& c : cases()) {
    if (c.features.contains("pad")) continue;
    const bool same = write(c) == c.mcap;
    EXPECT_TRUE(same) << c.name;
    passed += same;
  }
  EXPECT_EQ(passed, 208);
}

}  // namespace
}  // namespace mimesis::log
