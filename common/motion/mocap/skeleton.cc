#include "common/motion/mocap/skeleton.h"

#include <algorithm>

namespace mimesis::mocap {

int Skeleton::find(std::string_view name) const {
  const auto found = std::find_if(joints.begin(), joints.end(),
                                  [name](const Joint& joint) { return joint.name == name; });
  return found == joints.end() ? -1 : static_cast<int>(found - joints.begin());
}

std::string one_line(std::string text) {
  for (char& c : text) {
    if ((c >= 0 && c < ' ') || c == '\x7f') c = '?';
  }
  return text;
}

}  // namespace mimesis::mocap
