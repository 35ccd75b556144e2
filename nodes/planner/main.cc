#include "common/runtime/run_node.h"
#include "nodes/planner/planner_node.h"

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::planner::PlannerNode>(
      argc, argv, {.name = "planner", .about = "Plans and streams the decided task (M18 2.3)"});
}
