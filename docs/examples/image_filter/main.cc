#include "common/runtime/run_node.h"
#include "negative_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<NegativeNode>(
      argc, argv, {.name = "negative", .about = "Publishes the negative of each image"});
}
