#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hw/cia402/canopen.h"

namespace mimesis::hw::cia402 {

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
