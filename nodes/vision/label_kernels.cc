#include "nodes/vision/label_kernels.h"

#include <algorithm>
#include <cstring>

#include "common/math/vector_clones.h"

#if defined(__x86_64__) && defined(__GNUC__)
#define MIMESIS_HAS_AVX2 1
#include <immintrin.h>
#endif

namespace mimesis::vision {
namespace {

#ifdef MIMESIS_HAS_AVX2

const bool kHasAvx2 = __builtin_cpu_supports("avx2");

/// Looks up eight cells, four in either number. Loads one by one: where processors guard gathers
/// against leaks these take twice as long.
inline void look_up_eight(std::uint64_t first, std::uint64_t last, const std::uint8_t* cells,
                          std::uint8_t* labels) {
  std::uint64_t eight = 0;
  for (int k = 0; k < 4; ++k) {
    eight |= static_cast<std::uint64_t>(cells[first >> 16 * k & 0xffff]) << 8 * k;
    eight |= static_cast<std::uint64_t>(cells[last >> 16 * k & 0xffff]) << (8 * k + 32);
  }
  std::memcpy(labels, &eight, 8);
}

/// Bits of `v >> shift` under `mask`, in each lane.
__attribute__((target("avx2"))) inline __m256i bits(__m256i v, int shift, int mask) {
  return _mm256_and_si256(_mm256_srli_epi32(v, shift), _mm256_set1_epi32(mask));
}

/// Returns how many pixels it has done; it reads 4 bytes behind each 8 pixels.
__attribute__((target("avx2"))) std::size_t look_up_bgr_avx2(const std::uint8_t* bgr,
                                                             std::size_t pixels,
                                                             const std::uint8_t* cells,
                                                             std::uint8_t* labels) {
  // Three bytes of a pixel to the lowest three of a lane: R << 16 | G << 8 | B.
  const __m256i spread = _mm256_setr_epi8(0, 1, 2, -1, 3, 4, 5, -1, 6, 7, 8, -1, 9, 10, 11, -1,  //
                                          0, 1, 2, -1, 3, 4, 5, -1, 6, 7, 8, -1, 9, 10, 11, -1);
  std::size_t i = 0;
  for (; i + 10 <= pixels; i += 8, bgr += 24) {
    const __m128i first = _mm_loadu_si128(reinterpret_cast<const __m128i*>(bgr)),
                  second = _mm_loadu_si128(reinterpret_cast<const __m128i*>(bgr + 12));
    const __m256i v = _mm256_shuffle_epi8(_mm256_set_m128i(second, first), spread);
    const __m256i cell = _mm256_or_si256(
        bits(v, 3, 0x1f), _mm256_or_si256(bits(v, 6, 0x1f << 5), bits(v, 9, 0x1f << 10)));
    const __m256i packed = _mm256_packus_epi32(cell, cell);
    look_up_eight(static_cast<std::uint64_t>(_mm256_extract_epi64(packed, 0)),
                  static_cast<std::uint64_t>(_mm256_extract_epi64(packed, 2)), cells, labels + i);
  }
  return i;
}

/// Entries of a table of 64 bytes, which lies in four registers of twice 16.
__attribute__((target("avx2"))) inline __m256i of_64(const __m256i* table, __m256i index) {
  __m256i out = _mm256_setzero_si256();
  for (int k = 0; k < 4; ++k) {
    // 0x70..0x7f within the k-th 16, else 0x80 or more, which the shuffle turns into 0
    const __m256i at =
        _mm256_add_epi8(_mm256_xor_si256(index, _mm256_set1_epi8(static_cast<char>(16 * k))),
                        _mm256_set1_epi8(0x70));
    out = _mm256_or_si256(out, _mm256_shuffle_epi8(table[k], at));
  }
  return out;
}

__attribute__((target("avx2"))) inline void spread(const YuyvCells::Sieve& from, __m256i* to) {
  for (int k = 0; k < 4; ++k) {
    to[k] = _mm256_broadcastsi128_si256(
        _mm_loadu_si128(reinterpret_cast<const __m128i*>(from.data() + 16 * k)));
  }
}

/// Tells which of the 32 pairs of 64 pixels may belong to a class: bit 4 q + j is pair j of the
/// q-th 16 pixels, bit 16 + 4 q + j is its pair 4 + j.
__attribute__((target("avx2"))) inline std::uint32_t sift(const __m256i* pixels, const __m256i* u,
                                                          const __m256i* v) {
  const __m256i low = _mm256_set1_epi16(0xff), six = _mm256_set1_epi8(0x3f);
  const __m256i a = _mm256_packus_epi16(_mm256_srli_epi16(pixels[0], 8),
                                        _mm256_srli_epi16(pixels[1], 8)),
                b = _mm256_packus_epi16(_mm256_srli_epi16(pixels[2], 8),
                                        _mm256_srli_epi16(pixels[3], 8));
  const __m256i all_u = _mm256_packus_epi16(_mm256_and_si256(a, low), _mm256_and_si256(b, low)),
                all_v = _mm256_packus_epi16(_mm256_srli_epi16(a, 8), _mm256_srli_epi16(b, 8));
  const __m256i both =
      _mm256_and_si256(of_64(u, _mm256_and_si256(_mm256_srli_epi16(all_u, 2), six)),
                       of_64(v, _mm256_and_si256(_mm256_srli_epi16(all_v, 2), six)));
  return ~static_cast<std::uint32_t>(
      _mm256_movemask_epi8(_mm256_cmpeq_epi8(both, _mm256_setzero_si256())));
}

__attribute__((target("avx2"))) std::size_t look_up_yuyv_avx2(const std::uint8_t* yuyv,
                                                              std::size_t pixels,
                                                              const YuyvCells& yuyv_cells,
                                                              std::uint8_t* labels) {
  // Lanes of 16 bits: U and Y << 8 of each pixel, and V.
  const __m256i blue = _mm256_setr_epi8(1, 0, 1, 2, 5, 4, 5, 6, 9, 8, 9, 10, 13, 12, 13, 14,  //
                                        1, 0, 1, 2, 5, 4, 5, 6, 9, 8, 9, 10, 13, 12, 13, 14),
                red = _mm256_setr_epi8(3, -1, 3, -1, 7, -1, 7, -1, 11, -1, 11, -1, 15, -1, 15, -1,
                                       3, -1, 3, -1, 7, -1, 7, -1, 11, -1, 11, -1, 15, -1, 15, -1);
  const __m256i of_luma = _mm256_set1_epi16(static_cast<short>(0xf000)),
                of_u = _mm256_set1_epi16(0x3f), of_v = _mm256_set1_epi16(0x3f << 6);
  const std::uint8_t* cells = yuyv_cells.cells();
  __m256i u[4], v[4], block[4];
  spread(yuyv_cells.u(), u);
  spread(yuyv_cells.v(), v);
  std::size_t i = 0;
  for (; i + 64 <= pixels; i += 64, yuyv += 128) {
    for (int q = 0; q < 4; ++q)
      block[q] = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(yuyv) + q);
    const std::uint32_t may = sift(block, u, v);
    std::memset(labels + i, 0, 64);
    if (may == 0) continue;
    for (int q = 0; q < 4; ++q) {
      const std::uint32_t here = may >> 4 * q;
      if ((here & 0x000f000f) == 0) continue;
      const __m256i luma_u = _mm256_shuffle_epi8(block[q], blue),
                    only_v = _mm256_shuffle_epi8(block[q], red);
      const __m256i cell =
          _mm256_or_si256(_mm256_and_si256(luma_u, of_luma),
                          _mm256_or_si256(_mm256_and_si256(_mm256_srli_epi16(luma_u, 2), of_u),
                                          _mm256_and_si256(_mm256_slli_epi16(only_v, 4), of_v)));
      std::uint8_t* to = labels + i + 16 * q;
      if ((here & 0xf) != 0) {
        look_up_eight(static_cast<std::uint64_t>(_mm256_extract_epi64(cell, 0)),
                      static_cast<std::uint64_t>(_mm256_extract_epi64(cell, 1)), cells, to);
      }
      if ((here & 0xf0000) != 0) {
        look_up_eight(static_cast<std::uint64_t>(_mm256_extract_epi64(cell, 2)),
                      static_cast<std::uint64_t>(_mm256_extract_epi64(cell, 3)), cells, to + 8);
      }
    }
  }
  return i;
}

#endif

// Opening is separable: three alike in each of three rows, then these alike; the largest likewise.

MIMESIS_VECTOR_CLONES void alike_in_row(const std::uint8_t* row, int width, std::uint8_t* out) {
  for (int u = 1; u + 1 < width; ++u) {
    const std::uint8_t v = row[u];
    out[u] = ((row[u - 1] ^ v) | (row[u + 1] ^ v)) != 0 ? std::uint8_t{0} : v;
  }
}

MIMESIS_VECTOR_CLONES void alike_in_column(const std::uint8_t* above, const std::uint8_t* row,
                                           const std::uint8_t* below, int width,
                                           std::uint8_t* out) {
  for (int u = 0; u < width; ++u) {
    const std::uint8_t v = row[u];
    out[u] = ((above[u] ^ v) | (below[u] ^ v)) != 0 ? std::uint8_t{0} : v;
  }
}

MIMESIS_VECTOR_CLONES void most_in_row(const std::uint8_t* row, int width, std::uint8_t* out) {
  for (int u = 1; u + 1 < width; ++u) out[u] = std::max(std::max(row[u - 1], row[u]), row[u + 1]);
}

/// Where squares of two classes would meet there is none of both.
MIMESIS_VECTOR_CLONES void most_in_column(const std::uint8_t* above, const std::uint8_t* row,
                                          const std::uint8_t* below, int width, std::uint8_t* out) {
  for (int u = 0; u < width; ++u) out[u] = std::max(std::max(above[u], row[u]), below[u]);
}

MIMESIS_VECTOR_CLONES std::uint8_t any_of(const std::uint8_t* row, int width) {
  std::uint8_t all = 0;
  for (int u = 0; u < width; ++u) all |= row[u];
  return all;
}

}  // namespace

void look_up_bgr_scalar(const std::uint8_t* bgr, std::size_t pixels, const std::uint8_t* cells,
                        std::uint8_t* labels) {
  for (std::size_t i = 0; i < pixels; ++i, bgr += 3) {
    labels[i] = cells[static_cast<std::size_t>(bgr[0] >> 3 | bgr[1] >> 3 << 5 | bgr[2] >> 3 << 10)];
  }
}

void look_up_bgr(const std::uint8_t* bgr, std::size_t pixels, const std::uint8_t* cells,
                 std::uint8_t* labels) {
  std::size_t done = 0;
#ifdef MIMESIS_HAS_AVX2
  if (kHasAvx2) done = look_up_bgr_avx2(bgr, pixels, cells, labels);
#endif
  look_up_bgr_scalar(bgr + 3 * done, pixels - done, cells, labels + done);
}

void look_up_yuyv_scalar(const std::uint8_t* yuyv, std::size_t pixels, const std::uint8_t* cells,
                         std::uint8_t* labels) {
  for (std::size_t i = 0; i + 1 < pixels; i += 2, yuyv += 4) {
    const int chroma = yuyv[1] >> 2 | yuyv[3] >> 2 << 6;
    labels[i] = cells[static_cast<std::size_t>(chroma | yuyv[0] >> 4 << 12)];
    labels[i + 1] = cells[static_cast<std::size_t>(chroma | yuyv[2] >> 4 << 12)];
  }
}

void look_up_yuyv(const std::uint8_t* yuyv, std::size_t pixels, const YuyvCells& cells,
                  std::uint8_t* labels) {
  std::size_t done = 0;
#ifdef MIMESIS_HAS_AVX2
  if (kHasAvx2) done = look_up_yuyv_avx2(yuyv, pixels, cells, labels);
#endif
  look_up_yuyv_scalar(yuyv + 2 * done, pixels - done, cells.cells(), labels + done);
}

YuyvCells::YuyvCells(std::vector<std::uint8_t> cells) : cells_(std::move(cells)) {
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (cells_[i] == 0) continue;
    const auto bit = static_cast<std::uint8_t>(1u << cells_[i] % 8u);
    u_[i & 63] |= bit;
    v_[i >> 6 & 63] |= bit;
  }
}

/// Row after row, so that all but the pictures stays in the nearest cache. A row without a class is
/// `empty` and costs nothing more.
void open_labels(const std::uint8_t* labels, int width, int height,
                 std::vector<std::uint8_t>& scratch, std::uint8_t* opened) {
  const auto w = static_cast<std::size_t>(width);
  scratch.assign(8 * w, 0);
  const std::uint8_t* const empty = scratch.data() + 7 * w;
  std::uint8_t* const alike = scratch.data() + 6 * w;
  std::array<const std::uint8_t*, 3> flat{}, wide{};
  const auto slot = [](int v) { return static_cast<std::size_t>(v % 3); };
  const auto around = [&](const auto& rows, int v) {  // beyond the border: as at the border
    return std::array{rows[slot(std::max(v - 1, 0))], rows[slot(v)],
                      rows[slot(std::min(v + 1, height - 1))]};
  };
  for (int v = 0; v < height + 2; ++v) {
    if (v < height) {
      const std::uint8_t* row = labels + static_cast<std::size_t>(v) * w;
      std::uint8_t* out = scratch.data() + slot(v) * w;
      flat[slot(v)] = empty;
      if (any_of(row, width) != 0) {
        alike_in_row(row, width, out);
        out[0] = width > 1 && row[1] != row[0] ? std::uint8_t{0} : row[0];
        if (width > 1) out[w - 1] = row[w - 2] != row[w - 1] ? std::uint8_t{0} : row[w - 1];
        flat[slot(v)] = out;
      }
    }
    if (v >= 1 && v <= height) {
      const auto [above, row, below] = around(flat, v - 1);
      std::uint8_t* out = scratch.data() + (3 + slot(v - 1)) * w;
      wide[slot(v - 1)] = empty;
      if (above != empty && row != empty && below != empty) {
        alike_in_column(above, row, below, width, alike);
        most_in_row(alike, width, out);
        out[0] = std::max(alike[0], alike[width > 1 ? 1 : 0]);
        if (width > 1) out[w - 1] = std::max(alike[w - 2], alike[w - 1]);
        wide[slot(v - 1)] = out;
      }
    }
    if (v >= 2) {
      const auto [above, row, below] = around(wide, v - 2);
      std::uint8_t* out = opened + static_cast<std::size_t>(v - 2) * w;
      if (above == empty && row == empty && below == empty) {
        std::memset(out, 0, w);
      } else {
        most_in_column(above, row, below, width, out);
      }
    }
  }
}

}  // namespace mimesis::vision
