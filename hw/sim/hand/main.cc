#include "common/runtime/run_node.h"
#include "hw/sim/hand/hand_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::hw::sim::HandNode>(
      argc, argv, {.name = "sim_hand", .about = "Simulated three-finger hand on Modbus TCP"});
}
