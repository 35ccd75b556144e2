#pragma once
#include <string>

#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "proto/foxglove/image.pb.h"

struct DifferenceParams {
  double rate_hz = 30.0;  ///< step rate [Hz]
  int gain = 4;           ///< makes small differences visible [1]
  void visit(mimesis::runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 1.0, 1000.0);
    v("gain", gain, 1, 255);
  }
};

/// Publishes by how much each image differs from the one before.
class DifferenceNode {
 public:
  using Params = DifferenceParams;
  DifferenceNode(const Params& params, mimesis::runtime::Bus& bus)
      : gain_(params.gain), image_(bus, "image"), difference_(bus, "difference") {}
  void step(mimesis::runtime::Time now);

 private:
  int gain_;
  std::string last_;
  mimesis::runtime::Latest<foxglove::RawImage> image_;
  mimesis::runtime::Out<foxglove::RawImage> difference_;
};
