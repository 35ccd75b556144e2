#include "brightness_node.h"

#include <numeric>

namespace tutorial {

void BrightnessNode::step(mimesis::runtime::Time) {
  const foxglove::RawImage* image = image_.take();  // null if there is no new one
  if (image == nullptr || image->data().empty()) return;
  const auto sum = [](double s, char byte) { return s + static_cast<unsigned char>(byte); };
  Brightness message;
  message.set_mean(std::accumulate(image->data().begin(), image->data().end(), 0.0, sum) /
                   static_cast<double>(image->data().size()));
  mean_.send(message, image_.stamp());
}

}  // namespace tutorial
