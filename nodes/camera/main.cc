#include "common/runtime/run_node.h"
#include "nodes/camera/camera_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::camera::CameraNode>(
      argc, argv,
      {.name = "camera", .about = "Images of the teacher's table: rendered, live or recorded"});
}
