#pragma once
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "hw/cia402/canopen.h"

/// Descriptions of drives for tests, written from CiA 306.
namespace mimesis::hw::cia402::eds_text {

/// A variable, or an element of a record.
struct Entry {
  Object object;
  int type;  // of CiA 301
  std::string access = "rw";
  bool pdo = false;
  std::string value{};
  std::string more{};
};
inline constexpr int kI8 = 2, kI16 = 3, kI32 = 4, kU8 = 5, kU16 = 6, kU32 = 7;

/// All that the bridge sets up for cyclic positions.
inline std::vector<Entry> whole_drive() {
  std::vector<Entry> out{{{0x1000, 0}, kU32, "ro", false, "0x00020192"},
                         {{0x1016, 0}, kU8, "ro", false, "1"},
                         {{0x1016, 1}, kU32},
                         {{0x1017, 0}, kU16},
                         {{0x1018, 0}, kU8, "ro", false, "4"},
                         {{0x1018, 1}, kU32, "ro", false, "0x000000FB"},
                         {{0x1018, 2}, kU32, "ro", false, "0x65520000"},
                         {{0x1018, 3}, kU32, "ro"},
                         {{0x1029, 1}, kU8},
                         {{0x1400, 1}, kU32, "rw", false, "$NODEID+0x200"},
                         {{0x1400, 2}, kU8},
                         {{0x1400, 5}, kU16},
                         {{0x6007, 0}, kI16},
                         {{0x6040, 0}, kU16, "rww", true},
                         {{0x6041, 0}, kU16, "ro", true},
                         {{0x605A, 0}, kI16},
                         {{0x6060, 0}, kI8, "rww", true},
                         {{0x6061, 0}, kI8, "ro", true},
                         {{0x6062, 0}, kI32, "ro", true},
                         {{0x6064, 0}, kI32, "ro", true},
                         {{0x6065, 0}, kU32},
                         {{0x606C, 0}, kI32, "ro", true},
                         {{0x6077, 0}, kI16, "ro", true},
                         {{0x607A, 0}, kI32, "rw", true},
                         {{0x607D, 1}, kI32},
                         {{0x607D, 2}, kI32},
                         {{0x607F, 0}, kU32},
                         {{0x6085, 0}, kU32},
                         {{0x60C2, 1}, kU8},
                         {{0x60C2, 2}, kI8},
                         {{0x6502, 0}, kU32, "ro", false, "0x000003ED"}};
  for (const int pdo : {0, 1}) {
    const auto communication = static_cast<std::uint16_t>(0x1800 + pdo),
               mapping = static_cast<std::uint16_t>(0x1A00 + pdo);
    out.push_back({{communication, 1}, kU32});
    out.push_back({{communication, 2}, kU8});
    out.push_back({{mapping, 0}, kU8});
    for (std::uint8_t i = 1; i <= 8; ++i) out.push_back({{mapping, i}, kU32});
  }
  out.push_back({{0x1600, 0}, kU8});
  for (std::uint8_t i = 1; i <= 8; ++i) out.push_back({{0x1600, i}, kU32});
  return out;
}

inline std::string text_of(const std::vector<Entry>& entries) {
  std::string out =
      "[FileInfo]\nEDSVersion=4.0\n[DeviceInfo]\nProductName=Drive\nVendorNumber=0xFB\n"
      "ProductNumber=0x65520000\nRevisionNumber=0x01610000\n";
  std::uint16_t before = 0;
  char line[128];
  for (const Entry& e : entries) {
    const bool record = std::ranges::count_if(entries,
                                              [&](const Entry& other) {
                                                return other.object.index == e.object.index;
                                              }) > 1 ||
                        e.object.sub > 0;
    if (record && e.object.index != before) {
      std::snprintf(line, sizeof line, "[%04X]\nObjectType=0x9\nSubNumber=9\n", e.object.index);
      out += line;
    }
    before = e.object.index;
    std::snprintf(line, sizeof line, record ? "[%04Xsub%X]\n" : "[%04X]\n", e.object.index,
                  e.object.sub);
    out += line;
    std::snprintf(line, sizeof line, "ObjectType=0x7\nDataType=0x%04X\nPDOMapping=%d\n", e.type,
                  e.pdo ? 1 : 0);
    out += line + ("AccessType=" + e.access + "\nDefaultValue=" + e.value + "\n" + e.more);
  }
  return out;
}

}  // namespace mimesis::hw::cia402::eds_text
