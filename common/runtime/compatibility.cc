#include "common/runtime/compatibility.h"

namespace mimesis::runtime {
namespace {

void compare(const v1::NodeInfo& publisher, const v1::NodeInfo& subscriber,
             std::vector<std::string>& lines) {
  for (const v1::TopicInfo& out : publisher.outputs()) {
    for (const v1::TopicInfo& in : subscriber.inputs()) {
      if (in.topic() != out.topic() || in.type_hash() == out.type_hash()) continue;
      std::string line = "topic " + out.topic() + ": node " + publisher.name() + " publishes " +
                         out.type() + ", node " + subscriber.name() + " expects " + in.type();
      if (in.type() == out.type()) line += " with other fields (different builds)";
      lines.push_back(line + "; its messages are ignored");
    }
  }
}

}  // namespace

std::vector<std::string> mismatches(const v1::NodeInfo& self, const v1::NodeInfo& other) {
  std::vector<std::string> lines;
  compare(self, other, lines);
  compare(other, self, lines);
  return lines;
}

}  // namespace mimesis::runtime
