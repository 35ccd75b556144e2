// Offers service adder/add: a sum, or the reason why there is none.
#include "adder.pb.h"
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "common/runtime/run_node.h"

using namespace mimesis;
using adder::AddAnswer, adder::AddRequest;

struct AdderParams {
  double rate_hz = 10.0;  ///< step rate [Hz]; requests are answered as they come, between two steps
  void visit(runtime::ParamVisitor& v) { v("rate_hz", rate_hz, 1.0, 1000.0); }
};

tl::expected<AddAnswer, Status> add(const AddRequest& request) {
  std::int64_t sum = 0;
  if (__builtin_add_overflow(request.a(), request.b(), &sum))
    return tl::unexpected(Status{"the sum does not fit into 64 bits"});
  AddAnswer answer;
  answer.set_sum(sum);
  return answer;
}

class Adder {
 public:
  using Params = AdderParams;
  Adder(const Params&, runtime::Bus& bus) {
    runtime::offer<AddRequest, AddAnswer>(bus, "add", add);
  }
  void step(runtime::Time) {}
};

int main(int argc, char** argv) {
  return runtime::run_node<Adder>(argc, argv, {.name = "adder", .about = "Adds two numbers"});
}
