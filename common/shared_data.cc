#include "common/shared_data.h"

#include <cstdlib>

namespace mimesis {

std::filesystem::path shared_data(std::string_view what) {
  const char* named = std::getenv("MIMESIS_SHARED");
  const std::filesystem::path folder =
      named ? std::filesystem::path(named)
            : std::filesystem::path(MIMESIS_SOURCE_DIR).parent_path() / "shared";
  return folder / what;
}

}  // namespace mimesis
