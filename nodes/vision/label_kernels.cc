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

/// Lowest bytes of eight 32-bit lanes.
__attribute__((target("avx2"))) inline void store_bytes(__m256i lanes, std::uint8_t* to) {
  const __m256i lowest =
      _mm256_setr_epi8(0, 4, 8, 12, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, 0, 4, 8, 12, -1,
                       -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1);
  const __m256i packed = _mm256_shuffle_epi8(lanes, lowest);
  const int low = _mm256_extract_epi32(packed, 0), high = _mm256_extract_epi32(packed, 4);
  std::memcpy(to, &low, 4);
  std::memcpy(to + 4, &high, 4);
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
    store_bytes(_mm256_i32gather_epi32(reinterpret_cast<const int*>(cells), cell, 1), labels + i);
  }
  return i;
}

__attribute__((target("avx2"))) std::size_t look_up_yuyv_avx2(const std::uint8_t* yuyv,
                                                              std::size_t pixels,
                                                              const std::uint8_t* cells,
                                                              std::uint8_t* labels) {
  // Lanes Y | U << 8 | V << 16 of four pixels from eight bytes.
  const __m256i spread = _mm256_setr_epi8(0, 1, 3, -1, 2, 1, 3, -1, 4, 5, 7, -1, 6, 5, 7, -1,  //
                                          0, 1, 3, -1, 2, 1, 3, -1, 4, 5, 7, -1, 6, 5, 7, -1);
  std::size_t i = 0;
  for (; i + 8 <= pixels; i += 8, yuyv += 16) {
    const __m128i both = _mm_loadu_si128(reinterpret_cast<const __m128i*>(yuyv));
    const __m256i v = _mm256_shuffle_epi8(_mm256_set_m128i(_mm_srli_si128(both, 8), both), spread);
    const __m256i luma = _mm256_slli_epi32(bits(v, 4, 0xf), 12);
    const __m256i cell =
        _mm256_or_si256(luma, _mm256_or_si256(bits(v, 10, 0x3f), bits(v, 12, 0x3f << 6)));
    store_bytes(_mm256_i32gather_epi32(reinterpret_cast<const int*>(cells), cell, 1), labels + i);
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
