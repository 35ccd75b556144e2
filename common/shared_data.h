#pragma once
#include <filesystem>
#include <string_view>

namespace mimesis {

/// Reference data that is no part of the repository: `what` ("data/mocap") in $MIMESIS_SHARED, or
/// in the folder `shared` beside the source tree that this was built from. May be absent.
std::filesystem::path shared_data(std::string_view what);

}  // namespace mimesis
