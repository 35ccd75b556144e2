#include "tests/graph/scenario.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/log/indexed_reader.h"

namespace mimesis::testing {

std::vector<std::string> played(const std::string& name, std::vector<std::string> options) {
  options.insert(options.end(),
                 {"--arg", "played=true", "--arg",
                  "symbols=" MIMESIS_SOURCE_DIR "/tests/graph/symbols/" + name + ".mcap"});
  return options;
}

Scenario::Scenario(const std::string& name, std::vector<std::string> options) {
  std::string folder = (std::filesystem::temp_directory_path() / "mimesis-run-XXXXXX").string();
  MIMESIS_ASSERT(mkdtemp(folder.data()) != nullptr);
  folder_ = folder;
  log_ = folder_ + "/run.mcap";
  std::vector<std::string> arguments = {"launch", MIMESIS_SOURCE_DIR "/launch/" + name + ".yaml"};
  if (name != "replay") options.insert(options.end(), {"--arg", "log=" + log_});
  arguments.insert(arguments.end(), options.begin(), options.end());
  arguments.insert(arguments.end(), {"--graph", graph_.name()});
  process_ = std::make_unique<Process>("mimesis", arguments);
}

Scenario::~Scenario() {
  if (::testing::Test::HasFailure()) std::cerr << process_->errors();
  process_.reset();
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

nlohmann::json Scenario::result() const {
  std::istringstream lines(process_->output());
  std::string line, last;
  while (std::getline(lines, line)) last = line;
  return nlohmann::json::parse(last, nullptr, false);
}

std::vector<Scenario::Logged> Scenario::messages(const std::string& topic) const {
  std::vector<Logged> found;
  const auto source = log::open_file(log_);
  if (!source) return found;
  const auto summary = log::summarize(**source);
  if (!summary) return found;
  log::IndexedReader reader(**source, *summary, {.channel = [&](const log::Channel& channel) {
    return channel.topic == topic;
  }});
  while (const log::Message* message = reader.next()) {
    found.push_back({message->log_time, std::string(message->data)});
  }
  return found;
}

pid_t Scenario::pid(const std::string& node) const {
  for (const v1::NodeInfo& known : runtime::GraphView(graph_.name()).nodes()) {
    if (known.name() == node) return static_cast<pid_t>(known.pid());
  }
  return -1;
}

}  // namespace mimesis::testing
