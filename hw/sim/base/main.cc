#include "common/runtime/run_node.h"
#include "hw/sim/base/base_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::hw::sim::SimBaseNode>(
      argc, argv,
      {.name = "sim_base", .about = "Simulated wheeled bases that take part in a crowd"});
}
