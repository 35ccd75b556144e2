#pragma once
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "msg/brightness.pb.h"
#include "proto/foxglove/image.pb.h"

namespace tutorial {

struct BrightnessParams {
  double rate_hz = 30.0;  ///< step rate [Hz]
  void visit(mimesis::runtime::ParamVisitor& v) { v("rate_hz", rate_hz, 1.0, 1000.0); }
};

/// Publishes the mean of every image's bytes.
class BrightnessNode {
 public:
  using Params = BrightnessParams;
  BrightnessNode(const Params&, mimesis::runtime::Bus& bus)
      : image_(bus, "image"), mean_(bus, "mean") {}
  void step(mimesis::runtime::Time now);

 private:
  mimesis::runtime::Latest<foxglove::RawImage> image_;
  mimesis::runtime::Out<Brightness> mean_;
};

}  // namespace tutorial
