#include "tools/mimesis/log/provenance.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <gnu/libc-version.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <array>
#include <ctime>
#include <nlohmann/json.hpp>
#if defined(__x86_64__)
#include <sys/platform/x86.h>
#endif

#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

std::string libm_variant() {
#if defined(__x86_64__)
  const bool fma = CPU_FEATURE_ACTIVE(FMA), avx2 = CPU_FEATURE_ACTIVE(AVX2);
  return std::string(fma ? ", FMA" : ", no FMA") + (avx2 ? " AVX2" : ", no AVX2");
#else
  return "";
#endif
}

std::string compiler_name() {
#if defined(__clang__)
  return "clang " __clang_version__;
#else
  return "g++ " __VERSION__;
#endif
}

std::string host_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

std::string lines_of(const nlohmann::json& array) {
  std::string text;
  for (const auto& line : array) text += line.get<std::string>() + '\n';
  return text;
}

std::optional<log::Metadata> launch_metadata(const std::string& text) {
  try {
    const auto json = nlohmann::json::parse(text);
    return log::Metadata{"mimesis.launch",
                         {{"file", json.at("file").get<std::string>()},
                          {"graph", json.at("graph").get<std::string>()},
                          {"clock", json.at("clock").get<std::string>()},
                          {"args", lines_of(json.at("args"))},
                          {"sets", lines_of(json.at("sets"))}}};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

}  // namespace

std::string arithmetic() {
  utsname machine{};
  uname(&machine);
  return fmt::format("{}{}, glibc {}, {}", machine.machine, libm_variant(), gnu_get_libc_version(),
                     compiler_name());
}

Provenance provenance(const std::string& graph, const std::vector<std::string>& command,
                      std::uint64_t started_ns, const std::string& launch_json) {
  std::string line;
  for (const std::string& word : command) line += (line.empty() ? "" : " ") + shell_word(word);
  const auto seconds = static_cast<std::time_t>(started_ns / 1'000'000'000);
  Provenance from{.run = {"mimesis.run",
                          {{"version", MIMESIS_VERSION},
                           {"host", host_name()},
                           {"graph", graph},
                           {"command", line},
                           {"started", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(seconds))},
                           {"started_ns", std::to_string(started_ns)},
                           {"arithmetic", arithmetic()}}},
                  .launch = launch_metadata(launch_json)};
  if (!from.launch) return from;
  from.launch_files = {from.launch->metadata.at("file")};
  const auto json = nlohmann::json::parse(launch_json);
  for (const auto& file : json.value("included", nlohmann::json::array())) {
    if (file.is_string()) from.launch_files.push_back(file);
  }
  return from;
}

log::Metadata losses_metadata(const LossCounts& counts, const std::string& name) {
  const auto text = [](const LossCount& count) {
    return fmt::format("received={} lost={}", count.received, count.lost);
  };
  log::Metadata metadata{name, {}};
  LossCount total;
  for (const auto& [key, count] : counts) {
    metadata.metadata[key] = text(count);
    total.received += count.received;
    total.lost += count.lost;
  }
  metadata.metadata["total"] = text(total);
  return metadata;
}

}  // namespace mimesis::tool
