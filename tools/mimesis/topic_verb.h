#pragma once

namespace CLI {
class App;
}  // namespace CLI

namespace mimesis::tool {

/// `topic pub`.
void add_pub(CLI::App& topic, int& exit_code);

}  // namespace mimesis::tool
