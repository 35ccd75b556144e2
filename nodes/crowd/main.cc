#include "common/runtime/run_node.h"
#include "nodes/crowd/crowd_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::crowd::CrowdNode>(
      argc, argv,
      {.name = "crowd",
       .about = "Coordinates walkers, with guarantees of contraction theory (thesis 4.4)"});
}
