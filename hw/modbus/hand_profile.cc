#include "hw/modbus/hand_profile.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/error.h"

namespace mimesis::hw::modbus {
namespace {

constexpr int kBits = 16;

unsigned at(const HandRegisters& registers, int address) {
  const auto found = registers.find(address);
  return found == registers.end() ? 0u : found->second;
}

bool holds(const RegisterTest& test, const HandRegisters& registers) {
  if (!registers.contains(test.address)) return false;
  return ((at(registers, test.address) & test.mask) == test.value) != test.differs;
}

bool any(const std::vector<RegisterTest>& tests, const HandRegisters& registers) {
  return std::ranges::any_of(tests, [&](const RegisterTest& t) { return holds(t, registers); });
}

const RegisterTest* first(const std::vector<RegisterTest>& tests, const HandRegisters& registers) {
  const auto found =
      std::ranges::find_if(tests, [&](const RegisterTest& t) { return holds(t, registers); });
  return found == tests.end() ? nullptr : &*found;
}

std::string words(const RegisterTest& test, const HandRegisters& registers) {
  return fmt::format("{} (register {} is 0x{:04X})", test.says, test.address,
                     at(registers, test.address));
}

void set(HandRegisters& registers, const RegisterBits& bits, unsigned mask, unsigned value) {
  std::uint16_t& word = registers[bits.address];
  word = static_cast<std::uint16_t>((word & ~mask) | (value & mask));
}

void set(HandRegisters& registers, const std::vector<RegisterBits>& all) {
  for (const RegisterBits& bits : all) set(registers, bits, bits.mask, bits.value);
}

void set(HandRegisters& registers, const std::vector<RegisterNumber>& all, double fraction) {
  for (const RegisterNumber& n : all) {
    const double x = std::clamp(fraction, 0.0, 1.0);
    const auto whole = std::lround(n.at_0 + (n.at_1 - n.at_0) * x);
    set(registers, n, n.number, static_cast<unsigned>(whole) << std::countr_zero(n.number));
  }
}

int number_in(const RegisterNumber& n, const HandRegisters& registers) {
  const unsigned word = (at(registers, n.address) & n.number) >> std::countr_zero(n.number);
  return n.number == 0xFFFF ? static_cast<std::int16_t>(word) : static_cast<int>(word);
}

/// What the picture says. @return what is wrong with it; empty: nothing
std::string read_picture(RegisterBits& bits, bool numbers) {
  int places = 0;
  for (const char c : bits.bits) {
    if (c == ' ') continue;
    if (c != '0' && c != '1' && c != '.' && !(numbers && c == 'n'))
      return fmt::format("'{}', expected 0, 1{} and . for any", c, numbers ? ", n" : "");
    if (++places > kBits) break;
    const auto bit = static_cast<std::uint16_t>(1u << (kBits - places));
    if (c == '0' || c == '1') bits.mask |= bit;
    if (c == '1') bits.value |= bit;
    if (c == 'n') bits.number |= bit;
  }
  if (places != kBits) return fmt::format("{} places, expected 16", places);
  const unsigned run = numbers ? bits.number >> std::countr_zero(bits.number) : 0u;
  if (numbers && (run == 0 || !std::has_single_bit(run + 1u)))
    return "expected n in places beside each other";
  if (!numbers && bits.mask == 0) return "expected at least one 0 or 1";
  return {};
}

bool covers(const std::vector<RegisterBlock>& blocks, int address) {
  return std::ranges::any_of(blocks, [&](const RegisterBlock& b) {
    return address >= b.address && address < b.address + b.count;
  });
}

}  // namespace

void HandProfile::visit(runtime::ParamVisitor& v) {
  v("name", name);
  v("unit", unit, 0, 255);
  v("baud_bit_s", baud_bit_s, 1'200, 1'000'000);
  v("parity", parity, {"none", "even", "odd"});
  v("timeout_s", timeout_s, 0.01, 2.0);
  runtime::list(v, "identify", identify);
  runtime::list(v, "read", read);
  runtime::list(v, "write", write);
  v.group("set", [&](runtime::ParamVisitor& g) {
    runtime::list(g, "always", always);
    runtime::list(g, "activate", activate);
    runtime::list(g, "basic", basic);
    runtime::list(g, "pinch", pinch);
    runtime::list(g, "closure", closure);
    runtime::list(g, "force", force);
    runtime::list(g, "go", go);
    runtime::list(g, "stand", stand);
  });
  v.group("is", [&](runtime::ParamVisitor& g) {
    runtime::list(g, "ready", ready);
    runtime::list(g, "basic", is_basic);
    runtime::list(g, "pinch", is_pinch);
    runtime::list(g, "moving", moving);
    runtime::list(g, "object", object);
    runtime::list(g, "closure", closed);
    runtime::list(g, "fault", faults);
  });
  v.group("identity", [&](runtime::ParamVisitor& g) {
    runtime::list(g, "contradicts", contradicts);
    runtime::list(g, "proves", proves);
    g("unproven", unproven);
  });
}

void HandProfile::check() {
  std::vector<RegisterBlock> seen = read;
  seen.insert(seen.end(), identify.begin(), identify.end());
  const auto every = [](const char* key, auto& items, const std::vector<RegisterBlock>& blocks,
                        const char* way, bool numbers) {
    for (std::size_t i = 0; i < items.size(); ++i) {
      const std::string where = fmt::format("{}[{}].", key, i);
      if (const std::string why = read_picture(items[i], numbers); !why.empty())
        throw ConfigError(where + "bits: " + why);
      if (!covers(blocks, items[i].address))
        throw ConfigError(
            fmt::format("{}register: {} is in no block of {}", where, items[i].address, way));
    }
  };
  const auto out = [&](const char* key, auto& items) {
    every(key, items, write, "write",
          std::is_same_v<decltype(items), std::vector<RegisterNumber>&>);
  };
  const auto in = [&](const char* key, auto& items) {
    every(key, items, seen, "read", std::is_same_v<decltype(items), std::vector<RegisterNumber>&>);
  };
  if (name.empty()) throw ConfigError("name: expected what this hand is called");
  out("set.always", always);
  out("set.activate", activate);
  out("set.basic", basic);
  out("set.pinch", pinch);
  out("set.closure", closure);
  out("set.force", force);
  out("set.go", go);
  out("set.stand", stand);
  in("is.ready", ready);
  in("is.basic", is_basic);
  in("is.pinch", is_pinch);
  in("is.moving", moving);
  in("is.object", object);
  in("is.closure", closed);
  in("is.fault", faults);
  in("identity.contradicts", contradicts);
  in("identity.proves", proves);
  if (closure.empty()) throw ConfigError("set.closure: expected where the closure is written");
  for (const RegisterNumber& n : closed) {
    if (n.at_0 == n.at_1) throw ConfigError("is.closure: at_0 and at_1 are equal");
  }
  if (closed.empty()) throw ConfigError("is.closure: expected where the closure is read");
  if (contradicts.empty() && proves.empty())
    throw ConfigError("identity: expected tests that tell this hand from another device");
}

HandProfile load_hand_profile(const std::string& file) {
  HandProfile hand;
  runtime::load_params(file, [&](runtime::ParamVisitor& v) { hand.visit(v); });
  try {
    hand.check();
  } catch (const ConfigError& e) {
    throw ConfigError(file + ": " + e.what());
  }
  return hand;
}

bool is_ready(const HandProfile& hand, const HandRegisters& registers) {
  return hand.ready.empty() || any(hand.ready, registers);
}

HandRegisters to_registers(const HandProfile& hand, const HandSetpoint& setpoint,
                           const HandRegisters& last) {
  HandRegisters registers;
  for (const RegisterBlock& block : hand.write) {
    for (int i = 0; i < block.count; ++i) registers[block.address + i] = 0;
  }
  const RegisterTest* fault = first(hand.faults, last);
  set(registers, hand.always);
  if (fault == nullptr || !fault->again) set(registers, hand.activate);
  set(registers, setpoint.mode == HandMode::pinch ? hand.pinch : hand.basic);
  set(registers, hand.closure, setpoint.closure);
  set(registers, hand.force, setpoint.force);
  set(registers, setpoint.move && is_ready(hand, last) ? hand.go : hand.stand);
  return registers;
}

HandReading to_reading(const HandProfile& hand, const HandRegisters& registers, HandMode asked) {
  constexpr double kBeyond = 0.05;  // of the range; more is no closure
  HandReading reading;
  const bool one_mode = hand.is_basic.empty() && hand.is_pinch.empty();
  reading.mode = one_mode                        ? asked
                 : any(hand.is_pinch, registers) ? HandMode::pinch
                 : any(hand.is_basic, registers) ? HandMode::basic
                                                 : HandMode::other;
  double way = 0.0, range = 0.0;
  for (const RegisterNumber& n : hand.closed) {
    const int value = number_in(n, registers);
    const double fraction = (value - n.at_0) / (n.at_1 - n.at_0);
    if (fraction < -kBeyond || fraction > 1.0 + kBeyond)
      reading.fault = fmt::format("register {} is {}, expected {:g} (open) to {:g} (closed)",
                                  n.address, value, n.at_0, n.at_1);
    way += std::abs(value - n.at_0) * (fraction < 0.0 ? 0.0 : 1.0);
    range += std::abs(n.at_1 - n.at_0);
  }
  reading.closure = std::min(way / range, 1.0);
  reading.moving = any(hand.moving, registers);
  reading.object_detected = any(hand.object, registers);
  if (const RegisterTest* fault = first(hand.faults, registers); fault != nullptr)
    reading.fault = fault->differs ? words(*fault, registers) : fault->says;
  reading.active = is_ready(hand, registers) && reading.fault.empty();
  return reading;
}

std::string contradiction(const HandProfile& hand, const HandRegisters& registers) {
  const RegisterTest* test = first(hand.contradicts, registers);
  return test == nullptr ? "" : words(*test, registers);
}

bool proves(const HandProfile& hand, const HandRegisters& registers) {
  return hand.proves.empty() || any(hand.proves, registers);
}

}  // namespace mimesis::hw::modbus
