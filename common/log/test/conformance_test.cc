// The published conformance data of the format: ../shared/mcap-conformance (416 files, see its
// README).
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/log/indexed_reader.h"
#include "common/log/records.h"
#include "common/log/writer.h"
#include "common/shared_data.h"

namespace mimesis::log {
namespace {

/// A record in the notation of the conformance suite: {"type", "fields": [[name, value], ...]},
/// numbers as decimal strings, bytes as lists of them, fields sorted by name.
nlohmann::json to_json(const Record& record);

/// Value of one field of such a record.
const nlohmann::json& field(const nlohmann::json& record, const std::string& name);
std::uint64_t number(const nlohmann::json& record, const std::string& name);
std::string text(const nlohmann::json& record, const std::string& name);
std::string bytes(const nlohmann::json& record, const std::string& name);

using nlohmann::json;

json value(std::uint64_t v) { return std::to_string(v); }
json value(Opcode v) { return std::to_string(static_cast<int>(v)); }
json value(const std::map<std::string, std::string>& v) { return json(v); }
json value(const std::map<std::uint16_t, std::uint64_t>& v) {
  json object = json::object();
  for (const auto& [key, number] : v) object[std::to_string(key)] = value(number);
  return object;
}
json byte_list(std::string_view v) {
  json list = json::array();
  for (const char c : v) list.push_back(std::to_string(static_cast<unsigned char>(c)));
  return list;
}

json record(const char* type, std::vector<std::pair<std::string, json>> fields) {
  std::ranges::sort(fields, {}, &std::pair<std::string, json>::first);
  json list = json::array();
  for (auto& [name, v] : fields) list.push_back(json::array({name, v}));
  return {{"type", type}, {"fields", list}};
}

struct ToJson {
  json operator()(const Header& r) const {
    return record("Header", {{"profile", r.profile}, {"library", r.library}});
  }
  json operator()(const Schema& r) const {
    return record("Schema", {{"id", value(r.id)},
                             {"name", r.name},
                             {"encoding", r.encoding},
                             {"data", byte_list(r.data)}});
  }
  json operator()(const Channel& r) const {
    return record("Channel", {{"id", value(r.id)},
                              {"schema_id", value(r.schema_id)},
                              {"topic", r.topic},
                              {"message_encoding", r.message_encoding},
                              {"metadata", value(r.metadata)}});
  }
  json operator()(const Message& r) const {
    return record("Message", {{"channel_id", value(r.channel_id)},
                              {"sequence", value(r.sequence)},
                              {"log_time", value(r.log_time)},
                              {"publish_time", value(r.publish_time)},
                              {"data", byte_list(r.data)}});
  }
  json operator()(const Attachment& r) const {
    return record("Attachment", {{"log_time", value(r.log_time)},
                                 {"create_time", value(r.create_time)},
                                 {"name", r.name},
                                 {"media_type", r.media_type},
                                 {"data", byte_list(r.data)}});
  }
  json operator()(const Metadata& r) const {
    return record("Metadata", {{"name", r.name}, {"metadata", value(r.metadata)}});
  }
  json operator()(const DataEnd& r) const {
    return record("DataEnd", {{"data_section_crc", value(r.data_section_crc)}});
  }
  json operator()(const Statistics& r) const {
    return record("Statistics", {{"message_count", value(r.message_count)},
                                 {"schema_count", value(r.schema_count)},
                                 {"channel_count", value(r.channel_count)},
                                 {"attachment_count", value(r.attachment_count)},
                                 {"metadata_count", value(r.metadata_count)},
                                 {"chunk_count", value(r.chunk_count)},
                                 {"message_start_time", value(r.message_start_time)},
                                 {"message_end_time", value(r.message_end_time)},
                                 {"channel_message_counts", value(r.channel_message_counts)}});
  }
  json operator()(const MetadataIndex& r) const {
    return record("MetadataIndex",
                  {{"offset", value(r.offset)}, {"length", value(r.length)}, {"name", r.name}});
  }
  json operator()(const AttachmentIndex& r) const {
    return record("AttachmentIndex", {{"offset", value(r.offset)},
                                      {"length", value(r.length)},
                                      {"log_time", value(r.log_time)},
                                      {"create_time", value(r.create_time)},
                                      {"data_size", value(r.data_size)},
                                      {"name", r.name},
                                      {"media_type", r.media_type}});
  }
  json operator()(const ChunkIndex& r) const {
    return record("ChunkIndex", {{"message_start_time", value(r.message_start_time)},
                                 {"message_end_time", value(r.message_end_time)},
                                 {"chunk_start_offset", value(r.chunk_start_offset)},
                                 {"chunk_length", value(r.chunk_length)},
                                 {"message_index_offsets", value(r.message_index_offsets)},
                                 {"message_index_length", value(r.message_index_length)},
                                 {"compression", r.compression},
                                 {"compressed_size", value(r.compressed_size)},
                                 {"uncompressed_size", value(r.uncompressed_size)}});
  }
  json operator()(const SummaryOffset& r) const {
    return record("SummaryOffset", {{"group_opcode", value(r.group_opcode)},
                                    {"group_start", value(r.group_start)},
                                    {"group_length", value(r.group_length)}});
  }
  json operator()(const Footer& r) const {
    return record("Footer", {{"summary_start", value(r.summary_start)},
                             {"summary_offset_start", value(r.summary_offset_start)},
                             {"summary_crc", value(r.summary_crc)}});
  }
};

json to_json(const Record& r) { return std::visit(ToJson{}, r); }

const json& field(const json& r, const std::string& name) {
  for (const json& pair : r.at("fields")) {
    if (pair.at(0) == name) return pair.at(1);
  }
  throw std::out_of_range(name);
}

std::uint64_t number(const json& r, const std::string& name) {
  return std::stoull(field(r, name).get<std::string>());
}

std::string text(const json& r, const std::string& name) {
  return field(r, name).get<std::string>();
}

std::string bytes(const json& r, const std::string& name) {
  std::string out;
  for (const json& b : field(r, name))
    out.push_back(static_cast<char>(std::stoi(b.get<std::string>())));
  return out;
}

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
