#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/mimesis/log/loss_counts.h"
#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// How reading one or several logs went.
struct Pass {
  log::Result done;           ///< a failure to write
  bool interrupted = false;   ///< by a signal
  std::uint64_t damages = 0;  ///< of the inputs, that cost messages; each was told
};

/// Hands every selected message to `take`, in the order of log time: progress bar, signals, damage.
/// `offsets_ns` are added to the times of the logs.
/// @throws ConfigError if the messages are so far out of order that memory would not be bounded.
Pass each_message(const std::string& what, const std::vector<OpenLog>& logs,
                  const log::Selection& selection,
                  const std::function<log::Result(const log::MergedReader::Item&)>& take,
                  const std::vector<std::int64_t>& offsets_ns = {});

/// Each content once. What cannot be read is told and counted in `pass.damages`.
void copy_attachments(const std::vector<OpenLog>& logs, NewLog& out, Pass& pass);
/// The same for metadata. Several logs become one: "mimesis.nodes" are united, and what tells the
/// place of a part among others is left out. `losses` replaces "mimesis.counts", if the logs have
/// counts.
void copy_metadata(const std::vector<OpenLog>& logs, NewLog& out, Pass& pass,
                   const std::optional<LossCounts>& losses);

/// Most unpacked bytes that a reader in the order of log time holds at once.
std::uint64_t overlap_bytes(const log::Summary& summary);

/// Unpacked bytes of the chunks that a selection touches.
std::uint64_t payload_bytes(const std::vector<OpenLog>& logs, const log::Selection& selection);

/// Profile that all logs share, or "".
std::string common_profile(const std::vector<OpenLog>& logs);
std::vector<std::string> paths_of(const std::vector<OpenLog>& logs);

/// Damages of one input that cost messages: told on standard error. A log that only lacks its
/// footer (killed recorder) lost nothing that ever was in the file.
std::uint64_t report_losses(const OpenLog& log, const std::vector<log::Damage>& damages,
                            std::uint64_t count);

/// Completes `out` if the pass went well, says what it holds (standard error; with `json` one
/// object on standard output, `more` behind the usual members) and gives the exit code: 1 after
/// damage.
int conclude(NewLog& out, Pass& pass, bool json,
             const nlohmann::ordered_json& more = nlohmann::ordered_json::object());

}  // namespace mimesis::tool
