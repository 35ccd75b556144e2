#include "nodes/camera/teacher_script.h"

#include <cstdio>
#include <vector>

#include "common/error.h"

namespace mimesis::camera {
namespace {

constexpr double kHeadroomPrecision = 0.185;  // fist and fingers above the carried object [m]
constexpr double kHeadroomFull = 0.135;

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> words(1);
  for (const char c : text) {
    if (c == ',') {
      words.emplace_back();
    } else if (c != ' ') {
      words.back() += c;
    }
  }
  return words;
}

/// True for `first`, false for `second`.
bool choose(const std::string& text, const std::string& word, const char* what, const char* first,
            const char* second) {
  if (word == first) return true;
  if (word == second) return false;
  throw ConfigError("teacher: '" + text + "': " + what + " '" + word + "' is neither '" + first +
                    "' nor '" + second + "'");
}

}  // namespace

Lesson parse_lesson(const std::string& text) {
  const std::vector<std::string> words = split(text);
  if (words.size() != 3) {
    throw ConfigError("teacher: '" + text +
                      "': expected grip,transport,goal, for instance precision,above,high");
  }
  Lesson lesson;
  lesson.grip = choose(text, words[0], "grip", "precision", "full") ? Grip::precision : Grip::full;
  lesson.transport =
      choose(text, words[1], "transport", "above", "below") ? Transport::above : Transport::below;
  lesson.goal = choose(text, words[2], "goal", "high", "low") ? Goal::high : Goal::low;
  return lesson;
}

void check_passable(const Lesson& lesson, const TeacherTable& table) {
  if (table.bridge_removed || lesson.transport == Transport::above) return;
  const double needed = lesson.grip == Grip::precision ? kHeadroomPrecision : kHeadroomFull;
  if (table.bridge_height_m >= needed) return;
  char line[160];
  std::snprintf(
      line, sizeof line,
      "bridge_height_m: %g is too low for a hand in %s grip below the bridge, at least %g",
      table.bridge_height_m, lesson.grip == Grip::precision ? "precision" : "full", needed);
  throw ConfigError(line);
}

}  // namespace mimesis::camera
