#include "common/runtime/run_node.h"
#include "hw/sim/drives/drives_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::hw::sim::DrivesNode>(
      argc, argv, {.name = "sim_drives", .about = "Simulated CiA 402 drives on a CAN bus"});
}
