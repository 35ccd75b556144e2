#include "common/runtime/run_node.h"
#include "hw/bridge/bridge_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::hw::bridge::BridgeNode>(
      argc, argv, {.name = "bridge", .about = "Joins the graph to arm (CAN) and hand (Modbus)"});
}
