#include "tools/mimesis/log/replay_launch.h"
namespace mimesis::tool {
int replay_launch(const std::vector<OpenLog>&, const ReplayOptions&, const StopSignals&) { return 2; }
}
