// Greets somebody, and takes another name while it runs.
#include "common/error.h"
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "common/runtime/run_node.h"
#include "proto/foxglove/log.pb.h"

using namespace mimesis;

struct GreeterParams {
  double rate_hz = 2.0;        ///< greetings a second [Hz]
  std::string name = "world";  ///< whom it greets
  int marks = 1;               ///< exclamation marks [1]
  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 0.1, 1000.0);
    v.changeable([&] {
      v("name", name);
      v("marks", marks, 0, 5);
    });
  }
};

class Greeter {
 public:
  using Params = GreeterParams;
  Greeter(const Params& params, runtime::Bus& bus) : params_(params), said_(bus, "said") {}

  /// Between two steps, with values within their ranges; a ConfigError refuses them.
  void change(const Params& params) {
    if (params.name.empty()) throw ConfigError("greeter.name: expected a name");
    params_ = params;
  }

  void step(runtime::Time now) {
    foxglove::Log line;
    line.set_message("hello " + params_.name +
                     std::string(static_cast<std::size_t>(params_.marks), '!'));
    said_.send(line, now);
  }

 private:
  Params params_;
  runtime::Out<foxglove::Log> said_;
};

int main(int argc, char** argv) {
  return runtime::run_node<Greeter>(argc, argv, {.name = "greeter", .about = "Greets somebody"});
}
