#include "common/log/test/conformance_json.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

namespace mimesis::log {
namespace {

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

}  // namespace

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

}  // namespace mimesis::log
