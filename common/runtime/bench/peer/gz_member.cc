// member.cc over gz-transport 11.
#include <ignition/msgs/stringmsg.pb.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <ignition/transport/Node.hh>
#include <string>
#include <thread>
#include <vector>

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const int own = std::atoi(argv[2]), members = std::atoi(argv[3]);
  const auto topic = [](int i) { return "/m" + std::to_string(i) + "/x"; };
  ignition::transport::NodeOptions options;
  options.SetPartition(argv[1]);
  ignition::transport::Node node(options);
  std::vector<std::atomic<bool>> heard(static_cast<std::size_t>(members));
  std::atomic<int> missing = members - 1;
  for (int i = 0; i < members; ++i) {
    if (i == own) continue;
    std::function<void(const ignition::msgs::StringMsg&)> hear =
        [&heard, &missing, i](const ignition::msgs::StringMsg&) {
          if (heard[static_cast<std::size_t>(i)].exchange(true)) return;
          if (--missing == 0 && write(STDOUT_FILENO, "!", 1) != 1) _exit(1);
        };
    if (!node.Subscribe(topic(i), hear)) return 1;
  }
  auto out = node.Advertise<ignition::msgs::StringMsg>(topic(own));
  ignition::msgs::StringMsg message;
  message.set_data(topic(own));
  for (;;) {
    if (!out.Publish(message)) return 1;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}
