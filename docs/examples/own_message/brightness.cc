// Publishes how bright each image is, in a message of its own.
#include <numeric>

#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "common/runtime/run_node.h"
#include "msg/brightness.pb.h"
#include "proto/foxglove/image.pb.h"

using namespace mimesis;

struct BrightnessParams {
  double rate_hz = 30.0;  ///< step rate [Hz]
  void visit(runtime::ParamVisitor& v) { v("rate_hz", rate_hz, 1.0, 1000.0); }
};

class BrightnessNode {
 public:
  using Params = BrightnessParams;
  BrightnessNode(const Params&, runtime::Bus& bus) : image_(bus, "image"), mean_(bus, "mean") {}

  void step(runtime::Time) {
    const foxglove::RawImage* image = image_.take();
    if (image == nullptr || image->data().empty()) return;
    const auto sum = [](double s, char byte) { return s + static_cast<unsigned char>(byte); };
    brightness::Brightness message;
    message.set_mean(std::accumulate(image->data().begin(), image->data().end(), 0.0, sum) /
                     static_cast<double>(image->data().size()));
    mean_.send(message, image_.stamp());  // fills the header
  }

 private:
  runtime::Latest<foxglove::RawImage> image_;
  runtime::Out<brightness::Brightness> mean_;
};

int main(int argc, char** argv) {
  return runtime::run_node<BrightnessNode>(
      argc, argv, {.name = "brightness", .about = "Publishes how bright each image is"});
}
