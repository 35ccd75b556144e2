// One of the processes that start_bench starts: hears all others, says so by a byte on standard
// output, and goes on.
#include <unistd.h>

#include <cstdlib>
#include <deque>
#include <string>

#include "common/runtime/ports.h"
#include "common/runtime/zmq_bus.h"
#include "proto/runtime.pb.h"

int main(int argc, char** argv) {
  using namespace mimesis;
  using namespace std::chrono_literals;
  if (argc != 4) return 2;  // GRAPH, own number, how many there are
  const int own = std::atoi(argv[2]), members = std::atoi(argv[3]);
  const auto name = [](int i) { return "m" + std::to_string(i); };
  runtime::BusOptions options;
  options.name = name(own);
  options.graph = argv[1];
  for (int i = 0; i < members; ++i) {
    if (i != own) options.in[name(i)] = name(i) + "/x";
  }
  runtime::ZmqBus bus(std::move(options));
  std::deque<runtime::Latest<v1::Publication>> others;
  for (int i = 0; i < members; ++i) {
    if (i != own) others.emplace_back(bus, name(i));
  }
  runtime::Out<v1::Publication> out(bus, "x");
  bus.ready();

  v1::Publication message;
  message.set_topic(name(own));
  std::vector<bool> heard(others.size());
  for (std::size_t missing = others.size();;) {
    out.send(message, Time(1));
    bus.wait(std::chrono::steady_clock::now() + 2ms);
    bus.drain();
    for (std::size_t i = 0; i < others.size(); ++i) {
      if (others[i].take() == nullptr || heard[i]) continue;
      heard[i] = true;
      if (--missing == 0 && write(STDOUT_FILENO, "!", 1) != 1) return 1;
    }
  }
}
