#include "common/log/salvage.h"

#include <set>

#include "common/log/wire.h"

namespace mimesis::log {

Salvage salvage(std::string_view records, const Chunk& head,
                const std::map<std::uint16_t, Channel>& known) {
  std::set<std::uint16_t> defined;
  const auto possible = [&](Opcode opcode, std::string_view content) {
    Schema schema;
    Channel channel;
    Message message;
    switch (opcode) {
      case Opcode::schema:
        return decode(content, schema) && schema.id != 0;
      case Opcode::channel:
        if (!decode(content, channel)) return false;
        defined.insert(channel.id);
        return true;
      case Opcode::message:
        return decode(content, message) && message.log_time >= head.message_start_time &&
               message.log_time <= head.message_end_time &&
               (known.contains(message.channel_id) || defined.contains(message.channel_id));
      default:
        return false;
    }
  };
  Salvage saved;
  Decoder d(records);
  while (d.left() > 0) {
    const auto opcode = d.integer<Opcode>();
    const std::string_view content = d.raw(d.integer<std::uint64_t>());
    if (!d.ok() || !possible(opcode, content)) break;
    saved.bytes = records.size() - d.left();
    saved.messages += opcode == Opcode::message;
  }
  return saved;
}

std::size_t without_zeros(std::string_view bytes) { return bytes.find_last_not_of('\0') + 1; }

}  // namespace mimesis::log
