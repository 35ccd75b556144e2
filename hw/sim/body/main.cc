#include "common/runtime/run_node.h"
#include "hw/sim/body/sim_body_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::hw::sim::SimBodyNode>(
      argc, argv,
      {.name = "sim_body",
       .about = "A biped in a physics world behind CiA 402 drives on CAN buses"});
}
