#include "difference_node.h"

#include <algorithm>
#include <cstdlib>

void DifferenceNode::step(mimesis::runtime::Time) {
  const foxglove::RawImage* image = image_.take();
  if (image == nullptr) return;
  if (image->data().size() == last_.size()) {
    foxglove::RawImage difference = *image;
    std::ranges::transform(
        image->data(), last_, difference.mutable_data()->begin(), [&](char a, char b) {
          const int change =
              std::abs(static_cast<unsigned char>(a) - static_cast<unsigned char>(b));
          return static_cast<char>(std::min(gain_ * change, 255));
        });
    difference_.send(difference, image_.stamp());
  }
  last_ = image->data();
}
