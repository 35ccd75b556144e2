#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hw/can/bus.h"

/// Frames of CANopen [CiA 301] that a master of drives needs, and back. Pure; numbers are
/// little-endian.
namespace mimesis::hw::cia402 {

inline constexpr int kLastNode = 127;  ///< node ids are 1..127

enum class Nmt : std::uint8_t {
  start = 0x01,
  stop = 0x02,
  pre_operational = 0x80,
  reset_node = 0x81,
  reset_communication = 0x82,
};

/// Network management states, as heartbeats report them.
enum class NmtState : std::uint8_t {
  boot_up = 0,
  stopped = 4,
  operational = 5,
  pre_operational = 127
};

can::Frame nmt(Nmt command, int node);  ///< node 0: all
can::Frame sync();
can::Frame heartbeat(int node, NmtState state);
/// Remote request of node guarding; the node answers as with a heartbeat, with bit 7 alternating.
can::Frame guard_request(int node);
/// Emergency: error code, error register 1001h, five bytes of the manufacturer (zero).
can::Frame emergency(int node, std::uint16_t code, std::uint8_t error_register);

struct Object {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  friend bool operator==(const Object&, const Object&) = default;
};
std::string text(Object object);  ///< "60C2:01"

/// Expedited SDO, client to server. `bytes` is 1, 2 or 4.
can::Frame sdo_upload(int node, Object object);
can::Frame sdo_download(int node, Object object, std::uint32_t value, int bytes);
can::Frame sdo_abort(int node, Object object, std::uint32_t code);

/// A response of an SDO server taken apart.
struct Sdo {
  enum class Kind : std::uint8_t { uploaded, downloaded, abort, unsupported };
  Kind kind = Kind::unsupported;
  Object object;
  std::uint32_t value = 0;  ///< data, or abort code
  int bytes = 0;            ///< bytes of data
};
Sdo parse_sdo_response(const can::Frame& frame);

std::string abort_text(std::uint32_t code);
std::string emergency_text(std::uint16_t code);

/// Process data object n = 1..4.
can::Frame rpdo(int n, int node);  ///< empty: append values
can::Frame tpdo(int n, int node);

/// Appends the low `bytes` bytes of `value`. Precondition: they fit into a classic frame.
void append(can::Frame& frame, std::uint32_t value, int bytes);
/// Unsigned number at byte `offset`; nothing if the frame is too short.
std::optional<std::uint32_t> unsigned_at(const can::Frame& frame, int offset, int bytes);
/// Two's complement number at byte `offset`; nothing if the frame is too short.
std::optional<std::int32_t> signed_at(const can::Frame& frame, int offset, int bytes);

/// Identity of a frame, from its identifier (predefined connection set).
struct Identity {
  enum class Kind : std::uint8_t {
    nmt,
    sync,
    emergency,
    tpdo,
    rpdo,
    sdo_request,
    sdo_response,
    heartbeat,
    other
  };
  Kind kind = Kind::other;
  int node = 0;
  int n = 0;  ///< number of a PDO: 1..4
};
Identity identify(const can::Frame& frame);

/// Client's side of one SDO transfer [CiA 301, 7.2.4.3], expedited or in segments as the data
/// demand. Pure: the caller sends first() and what handle() returns, and minds the time.
class SdoTransfer {
 public:
  static SdoTransfer upload(int node, Object object) { return {node, object, true, {}}; }
  static SdoTransfer download(int node, Object object, std::vector<std::uint8_t> data) {
    return {node, object, false, std::move(data)};
  }

  can::Frame first() const;
  /// Any frame of the bus. @return the next request
  std::optional<can::Frame> handle(const can::Frame& frame);

  bool done() const { return done_; }
  /// Why the finished transfer failed, in words; empty: it did not.
  const std::string& failure() const { return failure_; }
  const std::vector<std::uint8_t>& data() const { return data_; }

 private:
  SdoTransfer(int node, Object object, bool up, std::vector<std::uint8_t> data)
      : node_(node), object_(object), up_(up), data_(std::move(data)) {}
  can::Frame segment_request() const;
  std::optional<can::Frame> give_up(std::uint32_t code, const std::string& why);
  std::optional<can::Frame> on_upload(const can::Frame& frame);
  std::optional<can::Frame> on_download(const can::Frame& frame);
  std::optional<can::Frame> finish(std::string failure = {});

  int node_;
  Object object_;
  bool up_;
  std::vector<std::uint8_t> data_;
  bool segments_ = false, toggle_ = false, done_ = false;
  std::optional<std::size_t> announced_;
  std::size_t sent_ = 0;  // bytes of a download
  std::string failure_;
};

}  // namespace mimesis::hw::cia402
