#pragma once
#include <string>

#include "common/error.h"

namespace mimesis {

/// A document on one line, for a terminal or another program. Of strangers' words bytes that are no
/// UTF-8 are shown as U+FFFD.
template <class Json>
std::string json_text(const Json& document) {
  return printable(document.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace mimesis
