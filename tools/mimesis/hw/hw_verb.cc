#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "tools/mimesis/hw/hw_tools.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using Options = std::shared_ptr<HwOptions>;

CLI::App* add(CLI::App& verb, const std::string& name, const std::string& about,
              const Options& options, int& exit_code, int (*run)(const HwOptions&),
              const std::string& wait = {}) {
  CLI::App* sub = verb.add_subcommand(name, about);
  add_graph_options(*sub, *options, wait);
  sub->callback([options, &exit_code, run] {
    try {
      exit_code = run(*options);
    } catch (const VerbFailure& failure) {
      std::cerr << failure.line << '\n';
      exit_code = failure.exit_code;
    }
  });
  return sub;
}

void add_bus(CLI::App* sub, const Options& options) {
  sub->add_option("BUS", options->bus,
                  "embedded:NAME of the graph, socketcan:INTERFACE or slcan:/dev/NAME")
      ->required();
}
void add_node(CLI::App* sub, const Options& options) {
  sub->add_option("NODE", options->node, "CANopen node")->required()->check(CLI::Range(1, 127));
}

}  // namespace

void add_hw(CLI::App& program, int& exit_code) {
  CLI::App* verb =
      program.add_subcommand("hw", "Drives on their buses: finds, watches, checks, moves, asks");
  verb->require_subcommand(1);

  auto options = std::make_shared<HwOptions>();
  CLI::App* check = add(
      *verb, "check",
      "Checks a machine file: mistakes, load of each bus, what rate and how many buses fit, what "
      "drives lack by their EDS or DCF",
      options, exit_code, hw_check, "an answer");
  check->add_option("FILE", options->file, "Machine file: robot, buses, joints (docs/hardware)")
      ->required();
  check->add_flag("--drives", options->drives,
                  "Asks the drives that have an EDS who they are and what they have; reads only");
  check->footer(
      "Exit codes: 0 fits, 1 a bus is overloaded or a drive lacks what its axis does not accept, 2 "
      "a "
      "file is wrong,\n3 a drive does not answer.\nExamples:\n  mimesis hw check machine.yaml\n  "
      "mimesis hw check machine.yaml --drives");

  options = std::make_shared<HwOptions>();
  options->timeout_s = 0.5;
  CLI::App* scan = add(*verb, "scan", "Finds the CANopen nodes of a bus; reads only", options,
                       exit_code, hw_scan, "answers");
  add_bus(scan, options);
  scan->footer("Example:\n  mimesis hw scan socketcan:can0");

  options = std::make_shared<HwOptions>();
  CLI::App* monitor =
      add(*verb, "monitor",
          "Shows the axes of a bus twice a second, or its frames; listens only, without "
          "--temperature",
          options, exit_code, hw_monitor);
  add_bus(monitor, options);
  monitor->add_option("--machine", options->file,
                      "Machine file: names, and radians instead of increments");
  monitor->add_flag("--frames", options->frames,
                    "Frames as `candump -L` writes them, for canplayer");
  monitor->add_option("--count", options->count, "Ends after so many tables or frames")
      ->check(CLI::PositiveNumber);
  monitor->add_option("--bitrate", options->bitrate, "Bit rate that the load is a share of [bit/s]")
      ->check(CLI::Range(10000, 1000000))
      ->capture_default_str();
  monitor->add_option("--temperature", options->object,
                      "Object with a drive's temperature, as its maker says: is asked for twice a "
                      "second");
  monitor->add_option("--degrees", options->degrees_c, "One unit of it [°C]")
      ->capture_default_str();
  monitor->footer(
      "Examples:\n  mimesis hw monitor embedded:arm\n  mimesis hw monitor socketcan:can0 --frames "
      "> bus.log");

  options = std::make_shared<HwOptions>();
  CLI::App* sdo = add(*verb, "sdo", "Reads or writes an object of a node", options, exit_code,
                      hw_sdo, "an answer");
  add_bus(sdo, options);
  add_node(sdo, options);
  sdo->add_option("OBJECT", options->object, "Index and sub-index, hexadecimal: 6041 or 607D:02")
      ->required();
  sdo->add_option("VALUE", options->value, "Value to write; without it the object is read");
  sdo->add_option("--type", options->type,
                  "Type of the object; read without it: unsigned or text, by its length")
      ->check(CLI::IsMember({"u8", "u16", "u32", "i8", "i16", "i32", "text"}));
  sdo->add_flag(
      "--force", options->force,
      "Beside a bridge, write also what protects the drive (1016h, 1029h, 1400h:05, 6007h, "
      "6065h ...)");
  sdo->footer(
      "Exit codes: 0 done, 1 refused by the node, 2 usage, 3 no answer.\nExamples:\n  mimesis hw "
      "sdo socketcan:can0 3 6041\n"
      "  mimesis hw sdo socketcan:can0 3 6065 2000 --type u32");

  options = std::make_shared<HwOptions>();
  CLI::App* jog =
      add(*verb, "jog", "Moves one joint by an angle, without a bridge, then switches it off",
          options, exit_code, hw_jog, "the drive");
  jog->add_option("FILE", options->file, "Machine file")->required();
  jog->add_option("JOINT", options->joint, "Name of the joint")->required();
  jog->add_option("--by", options->by_rad, "Angle, in the model's direction [rad]")->required();
  jog->add_option("--speed", options->speed_rad_s, "Largest speed on the way [rad/s]")
      ->required()
      ->check(number_above_zero);
  jog->footer(
      "Start with the axis unloaded and an emergency stop at hand.\nExample:\n  mimesis hw jog "
      "machine.yaml A1 --by 0.02 --speed 0.02");

  options = std::make_shared<HwOptions>();
  options->timeout_s = 5.0;
  CLI::App* trial =
      add(*verb, "try", "Homes one joint, or tries another mode of its drive; then switches it off",
          options, exit_code, hw_try, "the drive to be enabled");
  trial->add_option("FILE", options->file, "Machine file")->required();
  trial->add_option("JOINT", options->joint, "Name of the joint")->required();
  trial
      ->add_option("KIND", options->kind,
                   "home: the drive finds its zero. position: its own profile to AMOUNT. velocity, "
                   "torque: cyclic, for a while, within the joint's range")
      ->required()
      ->check(CLI::IsMember({"home", "position", "velocity", "torque"}));
  trial->add_option("AMOUNT", options->amount, "Of position, velocity, torque [rad, rad/s, N m]");
  trial->add_option("--for", options->duration_s, "How long, of velocity and torque [s]")
      ->check(number_above_zero);
  trial->add_option("--speed", options->speed_rad_s, "Of position, and to the home switch [rad/s]")
      ->check(number_above_zero);
  trial->add_option("--method", options->method, "Homing method 6098h; 35, 37: zero is here")
      ->check(CLI::Range(-128, 127))
      ->capture_default_str();
  trial->footer(
      "Start with the axis unloaded and an emergency stop at hand.\nExamples:\n  mimesis hw try "
      "machine.yaml A1 home --method 17 --speed 0.1\n  mimesis hw try machine.yaml A1 velocity "
      "0.1 --for 0.5");
}

}  // namespace mimesis::tool
