// Prints every line that it hears.
#include "common/runtime/log.h"
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "common/runtime/run_node.h"
#include "proto/foxglove/log.pb.h"

using namespace mimesis;

struct ListenerParams {
  double rate_hz = 50.0;  ///< looks for new lines [Hz]
  void visit(runtime::ParamVisitor& v) { v("rate_hz", rate_hz, 1.0, 1000.0); }
};

class Listener {
 public:
  using Params = ListenerParams;
  Listener(const Params&, runtime::Bus& bus) : said_(bus, "said") {}

  void step(runtime::Time) {
    while (const auto line = said_.pop()) runtime::info("I heard '{}'", line->message());
  }

 private:
  runtime::Queue<foxglove::Log, 10> said_;  // the launch file says which topic
};

int main(int argc, char** argv) {
  return runtime::run_node<Listener>(argc, argv,
                                     {.name = "listener", .about = "Prints what it hears"});
}
