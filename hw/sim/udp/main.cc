#include "common/runtime/run_node.h"
#include "hw/sim/udp/udp_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::hw::sim::UdpNode>(
      argc, argv,
      {.name = "sim_udp", .about = "Simulated controller of joints behind a UDP socket"});
}
