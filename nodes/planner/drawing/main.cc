// mimesis_roadmap SOCKET: draws roadmaps for `mimesis log view`, so that it need not link this
// node. Packets (common/runtime/replay.h) in: the planner's NodeStart, answered with an empty
// SceneUpdate; then pairs of Scene and TaskStatus, each message answered, the second with the
// drawing.
#include <cstdlib>
#include <iostream>

#include "common/error.h"
#include "common/runtime/replay.h"
#include "nodes/planner/drawing/roadmap_drawing_node.h"

int main(int argc, char** argv) {
  using namespace mimesis;
  if (argc != 2) {
    std::cerr << "usage: mimesis_roadmap SOCKET (started by `mimesis log view --roadmap`)\n";
    return 2;
  }
  const int socket = std::atoi(argv[1]);
  v1::NodeStart start;
  if (!runtime::read_packet(socket, start)) return 1;
  try {
    planner::RoadmapDrawer drawer(start);
    v1::Scene scene;
    v1::TaskStatus status;
    const foxglove::SceneUpdate taken;
    if (!runtime::write_packet(socket, taken)) return 1;
    while (runtime::read_packet(socket, scene) && runtime::write_packet(socket, taken) &&
           runtime::read_packet(socket, status) &&
           runtime::write_packet(socket, drawer.draw(scene, status))) {
    }
  } catch (const ConfigError& e) {
    std::cerr << e.what() << '\n';
    return 2;
  }
  return 0;
}
