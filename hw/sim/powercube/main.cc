#include "common/runtime/run_node.h"
#include "hw/sim/powercube/powercube_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::hw::sim::PowercubeNode>(
      argc, argv, {.name = "sim_powercube", .about = "Simulated PowerCube modules on a CAN bus"});
}
