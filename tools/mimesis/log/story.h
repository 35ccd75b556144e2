#pragma once
#include <algorithm>
#include <cctype>
#include <map>
#include <string>

#include "proto/cognition.pb.h"
#include "proto/player.pb.h"
#include "tools/mimesis/log/field_columns.h"

// What a run's messages say to people: what was seen, decided, planned, and what stopped the arm.
namespace mimesis::tool {

/// "precision" of GRIP_PRECISION, "-" if unspecified.
inline std::string word(std::string name, std::size_t prefix) {
  name = name.substr(std::min(prefix, name.size()));
  std::ranges::transform(name, name.begin(),
                         [](unsigned char c) { return c == '_' ? ' ' : std::tolower(c); });
  return name == "unspecified" ? "-" : name;
}

/// "full, below, high" of a decision, an observation or a plan.
template <class Symbols>
std::string words(const Symbols& s) {
  constexpr std::size_t kGrip = 5, kTransport = 10, kGoal = 5;  // lengths of the prefixes
  return word(v1::Grip_Name(s.grip()), kGrip) + ", " +
         word(v1::Transport_Name(s.transport()), kTransport) + ", " +
         word(v1::Goal_Name(s.goal()), kGoal);
}

/// "PF->F5g 4.54 + STSg->F5g 0.81" of what carried a field; inputs near 0 are left out.
std::string carried_by(const v1::FieldReason& reason);

/// Tells a log from front to back, one line for each change.
class Story {
 public:
  /// Some message of the channel may be told.
  static bool follows(const log::Channel& channel);
  /// What the message tells; `kind` is unspecified if that is nothing new. Without its position.
  v1::PlayerMark tell(const Item& item);

 private:
  v1::PlayerMark tell(const std::string& topic, const google::protobuf::Message& message);
  /// The text, if the topic's last one was another.
  bool changed(const std::string& topic, const std::string& text);

  LogDecoder decoder_;
  std::map<std::string, std::string> last_;  ///< text by topic
};

}  // namespace mimesis::tool
