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

__attribute__((target("avx2"))) std::size_t look_up_yuyv_avx2(const std::uint8_t* yuyv,
                                                              std::size_t pixels,
                                                              const std::uint8_t* cells,
                                                              std::uint8_t* labels) {
  // Lanes of 16 bits: U and Y << 8 of each pixel, and V.
  const __m256i blue = _mm256_setr_epi8(1, 0, 1, 2, 5, 4, 5, 6, 9, 8, 9, 10, 13, 12, 13, 14,  //
                                        1, 0, 1, 2, 5, 4, 5, 6, 9, 8, 9, 10, 13, 12, 13, 14),
                red = _mm256_setr_epi8(3, -1, 3, -1, 7, -1, 7, -1, 11, -1, 11, -1, 15, -1, 15, -1,
                                       3, -1, 3, -1, 7, -1, 7, -1, 11, -1, 11, -1, 15, -1, 15, -1);
  const __m256i of_luma = _mm256_set1_epi16(static_cast<short>(0xf000)),
                of_u = _mm256_set1_epi16(0x3f), of_v = _mm256_set1_epi16(0x3f << 6);
  std::size_t i = 0;
  for (; i + 16 <= pixels; i += 16, yuyv += 32) {
    const __m256i v = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(yuyv));
    const __m256i luma_u = _mm256_shuffle_epi8(v, blue), only_v = _mm256_shuffle_epi8(v, red);
    const __m256i cell =
        _mm256_or_si256(_mm256_and_si256(luma_u, of_luma),
                        _mm256_or_si256(_mm256_and_si256(_mm256_srli_epi16(luma_u, 2), of_u),
                                        _mm256_and_si256(_mm256_slli_epi16(only_v, 4), of_v)));
    look_up_eight(static_cast<std::uint64_t>(_mm256_extract_epi64(cell, 0)),
                  static_cast<std::uint64_t>(_mm256_extract_epi64(cell, 1)), cells, labels + i);
    look_up_eight(static_cast<std::uint64_t>(_mm256_extract_epi64(cell, 2)),
                  static_cast<std::uint64_t>(_mm256_extract_epi64(cell, 3)), cells, labels + i + 8);
  }
  return i;
}

#endif

/// Class of the middle of three rows where all nine pixels have it.
MIMESIS_VECTOR_CLONES void uniform_row(const std::uint8_t* above, const std::uint8_t* row,
                                       const std::uint8_t* below, int width, std::uint8_t* out) {
  for (int u = 1; u + 1 < width; ++u) {
    const std::uint8_t v = row[u];
    const int differs = (row[u - 1] ^ v) | (row[u + 1] ^ v) | (above[u - 1] ^ v) | (above[u] ^ v) |
                        (above[u + 1] ^ v) | (below[u - 1] ^ v) | (below[u] ^ v) |
                        (below[u + 1] ^ v);
    out[u] = differs != 0 ? std::uint8_t{0} : v;
  }
}

/// Largest of nine; where squares of two classes would meet there is none of both.
MIMESIS_VECTOR_CLONES void spread_row(const std::uint8_t* above, const std::uint8_t* row,
                                      const std::uint8_t* below, int width, std::uint8_t* out) {
  for (int u = 1; u + 1 < width; ++u) {
    std::uint8_t most = std::max(std::max(row[u - 1], row[u]), row[u + 1]);
    most = std::max(most, std::max(std::max(above[u - 1], above[u]), above[u + 1]));
    out[u] = std::max(most, std::max(std::max(below[u - 1], below[u]), below[u + 1]));
  }
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

void look_up_yuyv(const std::uint8_t* yuyv, std::size_t pixels, const std::uint8_t* cells,
                  std::uint8_t* labels) {
  std::size_t done = 0;
#ifdef MIMESIS_HAS_AVX2
  if (kHasAvx2) done = look_up_yuyv_avx2(yuyv, pixels, cells, labels);
#endif
  look_up_yuyv_scalar(yuyv + 2 * done, pixels - done, cells, labels + done);
}

void open_labels(const std::uint8_t* labels, int width, int height, std::uint8_t* uniform,
                 std::uint8_t* opened) {
  const auto pass = [width, height](const std::uint8_t* from, std::uint8_t* to, const auto& rows,
                                    const auto& pixel) {
    for (int v = 0; v < height; ++v) {
      const std::ptrdiff_t w = width;
      const std::uint8_t* row = from + v * w;
      const std::uint8_t *above = v > 0 ? row - w : row, *below = v + 1 < height ? row + w : row;
      rows(above, row, below, width, to + v * w);
      for (const int u : {0, width - 1}) {  // beyond the border: as at the border
        const int left = std::max(u - 1, 0), right = std::min(u + 1, width - 1);
        to[v * w + u] = pixel(above, row, below, left, u, right);
      }
    }
  };
  pass(labels, uniform, uniform_row,
       [](const auto* a, const auto* r, const auto* b, int left, int u, int right) {
         const std::uint8_t c = r[u];
         for (const auto* row : {a, r, b}) {
           if (row[left] != c || row[u] != c || row[right] != c) return std::uint8_t{0};
         }
         return c;
       });
  pass(uniform, opened, spread_row,
       [](const auto* a, const auto* r, const auto* b, int left, int u, int right) {
         std::uint8_t most = 0;
         for (const auto* row : {a, r, b}) most = std::max({most, row[left], row[u], row[right]});
         return most;
       });
}

}  // namespace mimesis::vision
