#include "negative_node.h"

void NegativeNode::step(mimesis::runtime::Time) {
  const foxglove::RawImage* image = image_.take();  // null if there is no new one
  if (image == nullptr) return;
  foxglove::RawImage negative = *image;
  for (char& byte : *negative.mutable_data()) byte = static_cast<char>(~byte);
  negative_.send(negative, image_.stamp());
}
