#include "common/runtime/run_node.h"
#include "nodes/walker/walker_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::walker::WalkerNode>(
      argc, argv,
      {.name = "walker",
       .about = "Turns a wished motion into a balanced walk of a biped (thesis 3.8)"});
}
