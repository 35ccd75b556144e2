#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <set>

#include "common/error.h"
#include "tools/mimesis/log/export.h"
#include "tools/mimesis/log/export_join.h"
#include "tools/mimesis/log/field_columns.h"
#include "tools/mimesis/log/field_text.h"

namespace mimesis::tool {
namespace {

/// A cell as RFC 4180 wants it: quoted if it has commas, quotes or line ends.
std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) {
    out += c;
    if (c == '"') out += c;
  }
  return out + '"';
}

/// The columns of one topic.
struct TopicTable {
  std::string topic;
  std::vector<FieldColumns> queries;
  std::map<std::pair<std::size_t, FieldColumns::Key>, std::size_t> columns;  ///< by query and key
  bool several_nodes = false;

  std::size_t width() const { return 1 + (several_nodes ? 1 : 0) + columns.size(); }
};

/// "bridge/arm.position_rad,velocity_rad_s" -> both with their topic.
std::vector<FieldQuery> csv_fields(const std::string& text,
                                   const std::vector<std::string>& topics) {
  std::vector<FieldQuery> queries;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t comma = std::min(text.find(',', from), text.size());
    const std::string part = text.substr(from, comma - from);
    from = comma + 1;
    const bool has_topic = std::ranges::any_of(topics, [&](const std::string& topic) {
      return part == topic || part.starts_with(topic + ".");
    });
    if (!queries.empty() && !has_topic) {
      if (part.empty()) throw ConfigError("--csv " + text + ": expected a field behind the comma");
      queries.push_back({queries.back().topic, part});
    } else {
      queries.push_back(parse_field_query(part, topics));
    }
  }
  return queries;
}

/// A file, or standard output.
class CsvFile {
 public:
  explicit CsvFile(const std::string& path) : path_(path) {
    if (path == "-") return;
    errno = 0;
    file_.open(path, std::ios::binary);
    if (!file_) throw ConfigError("cannot write '" + path + "': " + std::strerror(errno));
  }
  void row(std::string line, const Cells& cells) {
    for (const std::string& cell : cells) line += "," + cell;
    (path_ == "-" ? std::cout : file_) << line << '\n';
  }
  void close() {
    errno = 0;
    std::ostream& out = path_ == "-" ? std::cout : file_;
    out.flush();
    if (!out) throw ConfigError("cannot write '" + path_ + "': " + std::strerror(errno));
  }

 private:
  std::string path_;
  std::ofstream file_;
};

class CsvWriter {
 public:
  CsvWriter(const std::vector<OpenLog>& logs, const CsvOptions& options)
      : logs_(logs),
        options_(options),
        times_(resolve(options.range, span_of(logs))),
        origin_ns_(options.absolute ? 0 : span_of(logs).start_ns) {
    const auto topics = topics_of(logs);
    for (const std::string& text : options.fields) {
      for (FieldQuery& query : csv_fields(text, topics)) {
        auto table = std::ranges::find(tables_, query.topic, &TopicTable::topic);
        if (table == tables_.end()) {
          tables_.push_back({query.topic, {}, {}, false});
          table = std::prev(tables_.end());
        }
        table->queries.emplace_back(std::move(query));
      }
    }
    for (TopicTable& table : tables_) check(table);
  }

  ExportResult run() {
    find_columns();
    if (tables_.size() == 1 || options_.join) {
      write(options_.output);
    } else {
      write_each();
    }
    return std::move(result_);
  }

 private:
  /// What is wrong with the fields is said before anything is read.
  void check(TopicTable& table) {
    std::set<std::string> nodes;
    for (const OpenChannel& c : channels_of(logs_)) {
      if (c.channel->topic != table.topic) continue;
      nodes.insert(sender_of(*c.channel));
      for (FieldColumns& query : table.queries) query.check(decoder_.type(c));
    }
    table.several_nodes = nodes.size() > 1;
  }

  template <class Take>
  std::uint64_t scan(const std::string& what, bool silent, const Take& take) {
    const auto wanted = [this](const log::Channel& c) {
      return std::ranges::find(tables_, c.topic, &TopicTable::topic) != tables_.end();
    };
    return scan_logs(logs_, {wanted, times_.start, times_.end}, what, take, silent);
  }

  std::size_t index_of(const Item& item) const {
    return static_cast<std::size_t>(
        std::ranges::find(tables_, item.channel->topic, &TopicTable::topic) - tables_.begin());
  }

  /// How many elements the repeated fields have is known when all messages were read.
  void find_columns() {
    result_.failures += scan("columns", false, [&](const Item& item) {
      TopicTable& table = tables_[index_of(item)];
      const auto* message = decoder_.decode(item);
      if (message == nullptr) {
        ++result_.failures;
        std::cerr << fmt::format("{}: the message at log time {} ns is not a valid {}\n",
                                 table.topic, item.message->log_time, item.schema->name);
        return;
      }
      for (std::size_t q = 0; q < table.queries.size(); ++q) {
        table.queries[q].visit(*message, [&](const FieldColumns::Key& key, const auto&) {
          table.columns.try_emplace({q, key});
        });
      }
    });
    for (TopicTable& table : tables_) {
      std::size_t next = table.several_nodes ? 2 : 1;
      for (auto& [key, column] : table.columns) column = next++;
    }
  }

  Cells heading(const TopicTable& table, bool with_topic) const {
    const std::string prefix = with_topic ? table.topic + "." : "";
    Cells cells{csv_cell(prefix + "publish_time_s")};
    if (table.several_nodes) cells.push_back(csv_cell(prefix + "node"));
    for (const auto& [key, column] : table.columns) {
      cells.push_back(csv_cell(prefix + table.queries[key.first].name(key.second)));
    }
    return cells;
  }

  Cells cells(TopicTable& table, const Item& item, const google::protobuf::Message& message) const {
    Cells out(table.width());
    out[0] = seconds_text(item.message->publish_time, origin_ns_);
    if (table.several_nodes) out[1] = csv_cell(sender_of(*item.channel));
    for (std::size_t q = 0; q < table.queries.size(); ++q) {
      table.queries[q].visit(message, [&](const FieldColumns::Key& key, const auto& v) {
        out[table.columns.at({q, key})] = csv_cell(field_text(v.message, v.field, v.index));
      });
    }
    return out;
  }

  /// All tables into one file, side by side.
  void write(const std::string& path) {
    CsvFile file(path);
    Cells first;
    std::vector<std::size_t> widths;
    for (const TopicTable& table : tables_) {
      const Cells columns = heading(table, tables_.size() > 1);
      first.insert(first.end(), columns.begin(), columns.end());
      widths.push_back(table.width());
    }
    file.row("log_time_s", first);
    const auto put = [&](std::uint64_t time_ns, const Cells& row) {
      file.row(seconds_text(time_ns, origin_ns_), row);
      ++result_.items;
    };
    RowJoin join(options_.join.value_or(Join::previous), widths, put);
    scan("export", true, [&](const Item& item) {
      const std::size_t index = index_of(item);
      if (const auto* message = decoder_.decode(item)) {
        join.add(index, item.message->log_time, cells(tables_[index], item, *message));
      }
    });
    join.finish();
    file.close();
    if (path != "-") result_.files.push_back(path);
  }

  void write_each() {
    if (options_.output == "-") {
      throw ConfigError("several topics: say -o FOLDER, or --join nearest, previous or outer");
    }
    std::error_code ignored;
    std::filesystem::create_directories(options_.output, ignored);
    FileNames names;
    std::vector<CsvFile> files;
    for (const TopicTable& table : tables_) {
      const auto path = std::filesystem::path(options_.output) / names.unique(table.topic, ".csv");
      files.emplace_back(path.string());
      files.back().row("log_time_s", heading(table, false));
      result_.files.push_back(path.string());
    }
    scan("export", true, [&](const Item& item) {
      const std::size_t index = index_of(item);
      const auto* message = decoder_.decode(item);
      if (message == nullptr) return;
      files[index].row(seconds_text(item.message->log_time, origin_ns_),
                       cells(tables_[index], item, *message));
      ++result_.items;
    });
    for (CsvFile& file : files) file.close();
  }

  const std::vector<OpenLog>& logs_;
  const CsvOptions& options_;
  LogTimes times_;
  std::uint64_t origin_ns_;
  LogDecoder decoder_;
  std::vector<TopicTable> tables_;
  ExportResult result_;
};

}  // namespace

ExportResult export_csv(const std::vector<OpenLog>& logs, const CsvOptions& options) {
  return CsvWriter(logs, options).run();
}

}  // namespace mimesis::tool
