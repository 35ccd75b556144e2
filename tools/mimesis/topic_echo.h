#pragma once
#include <string>

namespace mimesis::tool {

struct EchoOptions {
  std::string topic;
  std::string field;  ///< empty: the whole message
  bool once = false;
  int count = 0;  ///< 0: without end
  bool reliable = false;
  double timeout_s = 0.0;  ///< of the wait for each message [s]; 0: none
};

/// Prints messages; the exit code.
int echo_topic(const std::string& graph, const EchoOptions& options, bool json);

struct HzOptions {
  std::string topic;
  int window = 1000;       ///< messages
  int reports = 0;         ///< 0: without end
  double timeout_s = 0.0;  ///< as above
};

/// Prints the rate of a topic once a second; the exit code.
int topic_rate(const std::string& graph, const HzOptions& options, bool json);

}  // namespace mimesis::tool
