// `mimesis log clean`: removes the logs of old runs.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <nlohmann/json.hpp>

#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/log_folder.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

struct CleanOptions {
  LogLimit limit;
  bool dry_run = false, json = false;
};

int log_clean(CleanOptions options) {
  const std::vector<RunFolder> runs = run_folders();
  if (options.limit.runs == SIZE_MAX && options.limit.bytes == UINT64_MAX)
    options.limit.bytes = kLogLimit;
  auto removed = nlohmann::ordered_json::array();
  std::size_t count = runs.size();
  std::uint64_t bytes = 0;
  for (const RunFolder& run : runs) bytes += run.bytes;
  bool failed = false;
  for (const RunFolder& run : beyond(runs, options.limit)) {
    const std::string failure = options.dry_run ? "" : remove_run(run);
    if (!failure.empty()) {
      std::cerr << failure << '\n';
      failed = true;
      continue;
    }
    removed.push_back({{"run", run.name}, {"bytes", run.bytes}});
    --count;
    bytes -= run.bytes;
    if (options.json) continue;
    std::cout << fmt::format("{} {} ({})\n", options.dry_run ? "would remove" : "removed", run.name,
                             bytes_text(run.bytes));
  }
  const std::string folder = log_root().string();
  if (options.json) {
    print_json({{"folder", folder},
                {"removed", removed},
                {"runs", count},
                {"bytes", bytes},
                {"dry_run", options.dry_run}});
  } else {
    std::cout << fmt::format("{}: {} runs, {}\n", folder, count, bytes_text(bytes));
  }
  return failed ? 1 : 0;
}

}  // namespace

void add_clean(CLI::App& log, int& exit_code) {
  CLI::App* clean = log.add_subcommand("clean", "Removes the logs of old runs, oldest first");
  auto o = std::make_shared<CleanOptions>();
  clean->add_option("--keep", o->limit.runs, "Number of runs that stay");
  clean
      ->add_option_function<std::string>(
          "--max-size", [o](const std::string& text) { o->limit.bytes = *to_bytes(text); },
          "Size of all logs that stay, such as 500MB (without both options: " +
              bytes_text(kLogLimit) + ")")
      ->check([](const std::string& text) {
        return to_bytes(text) ? "" : "expected a size such as 500MB or 2GiB, found '" + text + "'";
      });
  clean->add_flag("--dry-run", o->dry_run, "Say what would go; remove nothing");
  clean->add_flag("--json", o->json, "Print one JSON object");
  clean->footer(
      "Never removed: a run that goes on, and one that was given a name (mimesis launch --name).\n"
      "Examples:\n  mimesis log clean --keep 10\n  mimesis log clean --max-size 1GB --dry-run");
  on_run(*clean, exit_code, [o] { return log_clean(*o); });
}

}  // namespace mimesis::tool
