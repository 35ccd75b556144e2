// Any bytes as a message of a viewer's client: the first one chooses text or binary. What is
// refused is refused in a line, and every answer can be sent.
//   cmake --preset fuzz && ninja -C build-fuzz view_fuzz && build-fuzz/bin/view_fuzz -runs=1000000
//   -rss_limit_mb=512
#include <cstdint>
#include <string_view>

#include "common/error.h"
#include "tools/mimesis/view/protocol.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace mimesis;
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto request = data[0] % 2 == 0 ? view::parse_text(bytes) : view::parse_binary(bytes);
  if (!request) {
    MIMESIS_ASSERT(!request.error().empty() && request.error().size() < 2000);
    view::status(view::Level::error, request.error());
  } else if (const auto* set = std::get_if<view::SetParameters>(&*request)) {
    view::parameter_values(set->parameters, set->request);
  }
  return 0;
}
