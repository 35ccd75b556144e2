#include "tools/mimesis/log/check.h"

#include <fmt/format.h>
#include <google/protobuf/stubs/logging.h>

#include <array>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "tools/mimesis/log/check_structure.h"
#include "tools/mimesis/log/human.h"
#include "tools/mimesis/progress.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;

struct BySeverity {
  std::array<std::uint64_t, 3> counts{};
  std::uint64_t& operator[](Severity s) { return counts[static_cast<std::size_t>(s)]; }
};

BySeverity count(const std::vector<CheckedLog>& logs) {
  BySeverity n;
  for (const CheckedLog& log : logs) {
    for (const Finding& f : log.findings.list()) ++n[f.severity];
  }
  return n;
}

ordered_json to_json(const std::vector<CheckedLog>& logs) {
  ordered_json files = ordered_json::array();
  for (const CheckedLog& log : logs) {
    ordered_json findings = ordered_json::array();
    for (const Finding& f : log.findings.list()) {
      findings.push_back({{"severity", word(f.severity)},
                          {"kind", f.kind},
                          {"offset", f.offset ? ordered_json(*f.offset) : ordered_json(nullptr)},
                          {"what", f.what}});
    }
    files.push_back({{"file", log.path},
                     {"size", log.size},
                     {"messages", log.messages},
                     {"findings", std::move(findings)}});
  }
  BySeverity n = count(logs);
  return {{"files", std::move(files)},
          {"errors", n[Severity::error]},
          {"warnings", n[Severity::warning]},
          {"infos", n[Severity::info]}};
}

void print(const std::vector<CheckedLog>& logs) {
  for (const CheckedLog& log : logs) {
    for (const Finding& f : log.findings.list()) {
      std::cout << fmt::format("{}: {}: {}{}\n", word(f.severity), log.path,
                               f.offset ? fmt::format("byte {}: ", *f.offset) : "", f.what);
    }
  }
}

}  // namespace

CheckedLog check_log(const std::string& path, const log::Source& source, Sequences& sequences) {
  const google::protobuf::LogSilencer silence;  // what is wrong with a schema is told here
  CheckedLog checked;
  checked.path = path;
  checked.size = source.size();
  Progress progress("check", 2 * source.size());
  MessageCheck messages(source, sequences, checked.findings);
  while (messages.next()) progress.at(messages.offset());
  messages.conclude();
  if (messages.is_log()) {
    check_structure(source, checked.findings,
                    [&](std::uint64_t done) { progress.at(source.size() + done); });
  }
  checked.findings.sort();
  checked.messages = messages.messages();
  checked.start_ns = messages.statistics().message_start_time;
  checked.end_ns = messages.statistics().message_end_time;
  checked.split = messages.split();
  return checked;
}

void check_parts(std::vector<CheckedLog>& logs) {
  const auto name = [](const std::string& path) {
    return std::filesystem::path(path).filename().string();
  };
  for (std::size_t i = 1; i < logs.size(); ++i) {
    CheckedLog& log = logs[i];
    const CheckedLog& before = logs[i - 1];
    if (log.messages > 0 && before.messages > 0 && log.start_ns < before.end_ns) {
      log.findings.add(Severity::warning, "parts", std::nullopt,
                       fmt::format("begins at {}, before {} ends at {}", human_time(log.start_ns),
                                   before.path, human_time(before.end_ns)));
    }
    const auto previous = log.split.find("previous");
    if (previous != log.split.end() && previous->second != name(before.path)) {
      log.findings.add(Severity::warning, "parts", std::nullopt,
                       fmt::format("follows '{}' by its metadata, not '{}'", previous->second,
                                   name(before.path)));
    }
  }
}

int log_check(const std::vector<std::string>& paths, bool json) {
  std::vector<CheckedLog> logs;
  Sequences sequences;
  for (const std::string& path : paths) {
    const auto source = log::open_file(path);
    if (!source) {
      std::cerr << source.error().reason << '\n';
      return std::filesystem::exists(path) ? 1 : 3;
    }
    logs.push_back(check_log(path, **source, sequences));
  }
  check_parts(logs);
  if (json) {
    std::cout << to_json(logs).dump(-1, ' ', false, ordered_json::error_handler_t::replace) << '\n';
  } else {
    print(logs);
  }
  std::uint64_t messages = 0;
  for (const CheckedLog& log : logs) messages += log.messages;
  BySeverity n = count(logs);
  std::cerr << fmt::format("{} messages in {}: {} errors, {} warnings, {} remarks\n", messages,
                           logs.size() == 1 ? logs[0].path : fmt::format("{} files", logs.size()),
                           n[Severity::error], n[Severity::warning], n[Severity::info]);
  return n[Severity::error] == 0 ? 0 : 1;
}

}  // namespace mimesis::tool
