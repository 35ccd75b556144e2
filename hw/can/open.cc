#include "common/error.h"
#include "hw/can/embedded.h"
#include "hw/can/socketcan.h"

namespace mimesis::hw::can {

std::unique_ptr<Bus> open(const std::string& address, const std::string& directory) {
  const std::size_t colon = address.find(':');
  const std::string kind = address.substr(0, colon);
  const std::string name = colon == std::string::npos ? "" : address.substr(colon + 1);
  if (kind == "embedded" && !name.empty() && name.find('/') == std::string::npos) {
    return std::make_unique<EmbeddedBus>(name, directory);
  }
  if (kind == "socketcan" && !name.empty()) return std::make_unique<SocketCan>(name);
  throw ConfigError("CAN bus '" + address + "': expected embedded:NAME or socketcan:INTERFACE");
}

}  // namespace mimesis::hw::can
