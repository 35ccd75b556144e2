#include "common/runtime/run_node.h"
#include "nodes/vision/vision_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::vision::VisionNode>(
      argc, argv,
      {.name = "vision",
       .about = "Recognises the teacher's action in images of the table (M18 2.2.1)"});
}
