#include "common/runtime/run_node.h"
#include "hw/sim/world/world_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::world::WorldNode>(
      argc, argv,
      {.name = "world", .about = "Simulated table and object; judges a trial [M18 2.1.1]"});
}
