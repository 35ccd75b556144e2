#include "common/runtime/run_node.h"
#include "difference_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<DifferenceNode>(
      argc, argv, {.name = "difference", .about = "Publishes what changes from image to image"});
}
