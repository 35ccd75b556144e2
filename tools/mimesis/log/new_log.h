#pragma once
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "common/log/stream_reader.h"
#include "common/log/writer.h"
#include "tools/mimesis/log/open_log.h"

// The sink of the verbs that write logs: filter, recover, convert, restore.
namespace mimesis::tool {

/// Where a verb that rewrites logs puts its result.
struct OutputOptions {
  std::string path;
  bool force = false;  ///< replace the file if it exists
  log::Compression compression = log::Compression::zstd;
  int zstd_level = log::kZstdLevel;
  std::size_t chunk_size = 1024 * 1024;  ///< [bytes]
};

/// @throws ConfigError if the output exists and is not to be replaced, is a folder or one of
/// `inputs`.
void check_output(const OutputOptions& options, const std::vector<std::string>& inputs);

/// Thrown when a log cannot be written.
struct NotWritten : VerbEnd {
  std::string reason;
};

/// A log that is made from others. It stands under PATH.part until it is complete and is removed if
/// that never happens: however the program ends, PATH is the old file or the whole new one. Schemas
/// and channels are added when a message needs them; equal ones of several logs are one. All that
/// writes throws NotWritten when it cannot.
class NewLog {
 public:
  /// @throws ConfigError as `check_output`, or if the file cannot be created.
  NewLog(const OutputOptions& options, const std::vector<std::string>& inputs,
         const std::string& profile = "");
  /// Has the profile that all `inputs` share.
  NewLog(const OutputOptions& options, const std::vector<OpenLog>& inputs);
  ~NewLog();
  NewLog(const NewLog&) = delete;
  NewLog& operator=(const NewLog&) = delete;

  /// Id in this log of a channel of another one; `schema` null: none.
  std::uint16_t channel(const log::Channel& channel, const log::Schema* schema);
  /// `message.channel_id`: of this log.
  void write(const log::Message& message);
  /// Message and channel of another log that stays in memory.
  void copy(const Item& item);
  /// Both: each content once, however many logs hold it.
  void attach(const log::Attachment& attachment);
  void add_metadata(const log::Metadata& metadata);

  /// Tells the damages of an input and counts those that cost messages.
  void count_damages(const OpenLog& log);
  /// Hands every selected message to `take`, with a bar named `what`, and counts the damages of the
  /// logs. `offsets_ns` are added to the times of the logs.
  /// @throws VerbEnd on a signal; ConfigError if the messages are so far out of order that memory
  /// would not be bounded.
  void read(const std::string& what, const std::vector<OpenLog>& logs,
            const log::Selection& selection, const std::function<void(const Item&)>& take,
            const std::vector<std::int64_t>& offsets_ns = {});
  /// Hands every record of a file to `take`, with a bar named `what`. @throws VerbEnd on a signal
  void read(const std::string& what, const log::Source& source, log::StreamReader& reader,
            const std::function<void(const log::Record&)>& take);
  /// Each content once. An attachment that cannot be read is reported and counted as damage.
  void copy_attachments(const std::vector<OpenLog>& logs);
  /// Like `copy_attachments`. Several logs become one: "mimesis.nodes" are united, and entries
  /// about the place of a part among others are left out. `losses` replaces "mimesis.counts".
  void copy_metadata(const std::vector<OpenLog>& logs, const std::optional<LossCounts>& losses);

  /// Closes the log, reads it back whole if `verify`, and gives it its name. Last call.
  void finish(bool verify = false);
  /// Finishes, prints the contents of the log (standard error; with `json` one object on standard
  /// output, `more` behind the usual members) and gives the exit code: 1 after damage.
  int conclude(bool json, const nlohmann::ordered_json& more = nlohmann::ordered_json::object());

  const log::Statistics& statistics() const { return writer_->statistics(); }
  /// Names of schemas that differ between the inputs: they are kept apart.
  const std::set<std::string>& conflicts() const { return conflicts_; }
  nlohmann::ordered_json json() const;  ///< contents of the new log
  std::string line() const;             ///< contents in one line, for people

 private:
  /// Value of `result`. @throws NotWritten
  template <class T>
  T written(tl::expected<T, Status> result) const;
  void read_back() const;

  OutputOptions options_;
  std::string written_to_;  ///< PATH.part, or PATH if that is a device
  bool finished_ = false;
  std::unique_ptr<log::Sink> sink_;
  std::unique_ptr<log::Writer> writer_;
  std::map<std::tuple<std::string, std::string, std::string>, std::uint16_t> schemas_;
  std::set<std::string> schema_names_, conflicts_;
  using ChannelKey =
      std::tuple<std::uint16_t, std::string, std::string, std::map<std::string, std::string>>;
  std::map<ChannelKey, std::uint16_t> channels_;
  std::map<const log::Channel*, std::uint16_t> known_;  ///< ids of the channels of `copy`
  std::set<std::tuple<std::string, std::string, std::uint64_t, std::uint64_t, std::size_t,
                      std::uint32_t>>
      attachments_;
  std::set<std::pair<std::string, std::map<std::string, std::string>>> metadata_;
  std::uint32_t digest_ = 0;   ///< CRC-32 of all messages in their order
  std::uint64_t damages_ = 0;  ///< damages of the inputs that cost messages; each was reported
};

}  // namespace mimesis::tool
