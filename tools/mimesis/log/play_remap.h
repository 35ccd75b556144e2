#pragma once
#include <string>
#include <vector>

namespace mimesis::tool {

/// New names for topics. OLD:=NEW renames one topic, OLD/:=NEW/ all below a prefix ("/" alone: the
/// root). A whole name goes before a prefix, a longer prefix before a shorter one.
class PlayRemap {
 public:
  PlayRemap() = default;
  /// @throws ConfigError unless every rule has one of the two forms and no OLD comes twice.
  explicit PlayRemap(const std::vector<std::string>& rules);

  std::string operator()(const std::string& topic) const;
  /// The rules that concern none of these topics: spelt wrong, most likely.
  std::vector<std::string> unused(const std::vector<std::string>& topics) const;

 private:
  struct Rule {
    std::string text, from, to;  ///< of a prefix: with the slash; "" is the root
    bool prefix = false;
  };
  const Rule* rule_for(const std::string& topic) const;

  std::vector<Rule> rules_;
};

}  // namespace mimesis::tool
