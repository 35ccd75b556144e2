#include "common/runtime/run_node.h"
#include "nodes/cognition/cognition_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::cognition::CognitionNode>(
      argc, argv,
      {.name = "cognition", .about = "Decides goal and means with neural fields (thesis 2.2.2)"});
}
