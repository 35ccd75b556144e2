#include "common/runtime/run_node.h"
#include "nodes/walker/walker_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::walker::WalkerNode>(
      argc, argv,
      {.name = "walker",
       .about = "Makes a wished motion one that a biped can walk without falling (thesis 3.8)"});
}
