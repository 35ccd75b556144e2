// camera_film_strip OUTPUT.png [GRIP,TRANSPORT,GOAL] [COLUMNS]: moments of a demonstration side by
// side, to be looked at.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "common/image/image_file.h"
#include "nodes/camera/renderer.h"

int main(int argc, char** argv) {
  using namespace mimesis;
  if (argc < 2) {
    std::fprintf(stderr, "usage: camera_film_strip OUTPUT.png [GRIP,TRANSPORT,GOAL] [COLUMNS]\n");
    return 2;
  }
  try {
    camera::Picture picture;
    if (argc > 2) picture.script.demonstration = task::parse_demonstration(argv[2]);
    const int columns = argc > 3 ? std::atoi(argv[3]) : 4;
    if (columns < 1 || columns > 16) throw ConfigError("COLUMNS: expected 1..16");
    const int rows = columns == 1 ? 1 : 3;
    camera::Renderer renderer(picture);
    image::Image frame, sheet(640 * columns, 480 * rows);
    const int count = columns * rows;
    for (int k = 0; k < count; ++k) {
      const double phase = count == 1 ? 0.37 : 0.06 + 0.90 * k / (count - 1);
      renderer.render(picture.script.start_s + phase * picture.script.duration_s, frame);
      for (int v = 0; v < frame.height; ++v) {
        std::memcpy(sheet.at(640 * (k % columns), 480 * (k / columns) + v), frame.at(0, v),
                    3 * static_cast<std::size_t>(frame.width));
      }
    }
    const auto written = image::write_png(argv[1], sheet);
    if (!written) throw ConfigError(written.error().reason);
  } catch (const ConfigError& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
  }
  return 0;
}
