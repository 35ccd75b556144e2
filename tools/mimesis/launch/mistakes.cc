#include "tools/mimesis/launch/mistakes.h"

#include <algorithm>
#include <utility>

namespace mimesis::launch {

void Mistakes::add(const runtime::Place& place, const std::string& what) {
  all_.push_back({place.line, place.column, to_string(place) + ": " + what});
}

void Mistakes::add_line(const runtime::Place& near, const std::string& line) {
  all_.push_back({near.line, near.column, line});
}

std::vector<std::string> Mistakes::lines() const {
  std::vector<Mistake> sorted = all_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Mistake& a, const Mistake& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  std::vector<std::string> lines;
  for (const Mistake& m : sorted) {
    if (std::find(lines.begin(), lines.end(), m.text) == lines.end()) lines.push_back(m.text);
  }
  return lines;
}

}  // namespace mimesis::launch
