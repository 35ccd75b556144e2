#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <memory>

#include "tools/mimesis/log/convert.h"
#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_convert(CLI::App& verb, int& exit_code) {
  CLI::App* sub =
      verb.add_subcommand("convert", "Logs of candump and LCM to MCAP, and MCAP to candump");
  struct Options {
    ConvertOptions convert;
    std::string compression = "zstd";
    bool json = false;
  };
  auto o = std::make_shared<Options>();
  sub->add_option("IN", o->convert.input,
                  "candump -l (or what candump shows), an LCM log, or MCAP; told by its content")
      ->required();
  sub->add_option("OUT", o->convert.output,
                  "MCAP file; of MCAP: log for canplayer, - for standard output")
      ->required();
  sub->add_option("--from", o->convert.from, "candump or lcm, whatever the content looks like")
      ->check(CLI::IsMember({"candump", "lcm"}));
  sub->add_flag("--force", o->convert.force, "Replace OUT if it exists");
  sub->add_option("--compression", o->compression, "Of MCAP: none, lz4 or zstd")
      ->check(CLI::IsMember({"none", "lz4", "zstd"}))
      ->capture_default_str();
  sub->add_flag("--json", o->json, "Print one JSON object at the end");
  sub->footer(
      "CAN frames become mimesis.v1.CanFrame on can/INTERFACE. LCM channels keep name and "
      "payload,\n"
      "encoding lcm. What is damaged is left out, said and counted: exit code 1. rosbag2 with\n"
      "sqlite3 (ros2 bag convert) and ROS 1 bags (mcap convert) have converters of their own; a\n"
      "rosbag2 in MCAP needs none.\n"
      "Examples: mimesis log convert candump-2026-11-21.log can.mcap\n"
      "          mimesis log convert lcmlog-2026-11-21.00 lcm.mcap");
  sub->callback([o, &exit_code] {
    o->convert.compression = *log::parse_compression(o->compression);
    exit_code = log_convert(o->convert, o->json);
  });
}

}  // namespace mimesis::tool
