#include "common/task/symbols.h"

#include <algorithm>
#include <vector>

namespace mimesis::task {

Demonstration parse_demonstration(std::string_view text, const std::string& where) {
  std::vector<std::string_view> words;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t comma = std::min(text.find(',', from), text.size());
    std::string_view word = text.substr(from, comma - from);
    while (word.starts_with(' ')) word.remove_prefix(1);
    while (word.ends_with(' ')) word.remove_suffix(1);
    words.push_back(word);
    from = comma + 1;
  }
  const std::string what = where + (where.empty() ? "'" : ": '") + std::string(text) + "'";
  if (words.size() != 3 && words.size() != 4) {
    throw ConfigError(what +
                      ": expected grip,transport,goal or grip,transport,goal,color, for instance "
                      "precision,above,high");
  }
  Demonstration d{.grip = parse_symbol<Grip>(words[0], what),
                  .transport = parse_symbol<Transport>(words[1], what),
                  .goal = parse_symbol<Goal>(words[2], what)};
  if (words.size() == 4) d.color = parse_symbol<Color>(words[3], what);
  return d;
}

}  // namespace mimesis::task
