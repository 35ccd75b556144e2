#pragma once
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "proto/foxglove/image.pb.h"

struct NegativeParams {
  double rate_hz = 30.0;  ///< step rate [Hz]
  void visit(mimesis::runtime::ParamVisitor& v) { v("rate_hz", rate_hz, 1.0, 1000.0); }
};

/// Publishes the negative of every image.
class NegativeNode {
 public:
  using Params = NegativeParams;
  NegativeNode(const Params&, mimesis::runtime::Bus& bus)
      : image_(bus, "image"), negative_(bus, "negative") {}
  void step(mimesis::runtime::Time now);

 private:
  mimesis::runtime::Latest<foxglove::RawImage> image_;
  mimesis::runtime::Out<foxglove::RawImage> negative_;
};
