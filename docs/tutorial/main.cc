#include "brightness_node.h"
#include "common/runtime/run_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<tutorial::BrightnessNode>(
      argc, argv, {.name = "brightness", .about = "Publishes how bright each image is"});
}
