#pragma once
#include <stdexcept>
#include <string>
#include <string_view>

namespace mimesis {

/// The user's mistake: a bad file, parameter or argument. One line with place, error and expected
/// value. Thrown before the first step only; `run_node` and `mimesis` turn it into exit code 2.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Why an expected failure happened; carried by tl::expected<T, Status>.
struct Status {
  std::string reason;  ///< one line, complete
};

/// Text of other programs as it may go to a terminal: control characters but `kept`, and
/// bytes that are no UTF-8, become `\u00XX`, as in JSON.
std::string printable(std::string_view text, std::string_view kept = {});

[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);  ///< aborts

}  // namespace mimesis

/// Our own bug: armed in every build type.
#define MIMESIS_ASSERT(condition) \
  ((condition) ? void(0) : ::mimesis::assertion_failed(#condition, __FILE__, __LINE__))
