// Publishes a line of text twice a second.
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "common/runtime/run_node.h"
#include "proto/foxglove/log.pb.h"

using namespace mimesis;

struct TalkerParams {
  double rate_hz = 2.0;        ///< lines a second [Hz]
  std::string text = "hello";  ///< what it says
  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 0.1, 1000.0);
    v("text", text);
  }
};

class Talker {
 public:
  using Params = TalkerParams;
  Talker(const Params& params, runtime::Bus& bus) : text_(params.text), said_(bus, "said") {}

  void step(runtime::Time now) {  // called rate_hz times a second
    foxglove::Log line;
    line.set_message(text_ + " " + std::to_string(++count_));
    said_.send(line, now);
  }

 private:
  std::string text_;
  int count_ = 0;
  runtime::Out<foxglove::Log> said_;  // topic talker/said
};

int main(int argc, char** argv) {
  return runtime::run_node<Talker>(argc, argv,
                                   {.name = "talker", .about = "Says a text again and again"});
}
