#include "common/runtime/run_node.h"
#include "common/runtime/test/counter_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::runtime::CounterNode>(
      argc, argv,
      {.name = "counter", .about = "Publishes a hash of all it has received (for tests)"});
}
