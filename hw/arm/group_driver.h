#pragma once
#include <memory>
#include <vector>

#include "hw/arm/arm_driver.h"

namespace mimesis::hw::arm {

/// The joints of one robot on several buses: an ArmDriver each, its joints after those of the one
/// before. All start to follow together, and what stops one bus stops all.
class GroupDriver final : public Actuators {
 public:
  /// Precondition: at least one.
  explicit GroupDriver(std::vector<std::unique_ptr<ArmDriver>> parts);

  const Reading& read(Time now) override;
  void write(Time now, const Setpoint& setpoint) override;
  void stop() noexcept override;

  can::Counters counters() const;  ///< of all buses together

 private:
  void combine();
  bool any(Phase phase) const;
  Mode mode_of(const Reading& part, Mode asked, bool ready) const;

  std::vector<std::unique_ptr<ArmDriver>> parts_;
  std::vector<const Reading*> readings_;  // of the parts
  std::vector<Mode> modes_;               // of this cycle
  std::size_t speaker_ = 0;               // the part whose reason is ours
  std::uint64_t limited_ = 0;             // sum of the parts
  Reading reading_;
};

}  // namespace mimesis::hw::arm
