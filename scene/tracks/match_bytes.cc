#include "scene/tracks/match_bytes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "scene/program/error.h"
#include "scene/program/kernel.h"

// Products of 4 or 8 rows of `a` with 16 columns (features of `b`) at a time, in registers. A tile of columns is laid
// out so that a register holds four numbers of each of its columns: one instruction multiplies them with four numbers
// of a row and adds the four products to the column's lane, and no sum goes across lanes.
//
// The instructions take one factor as a signed byte, and AVX2's adds two products in 16 bits: numbers up to 127 are
// exact (2 * 127^2 < 2^15). Few features have a larger one; theirs are products of their own, in 32 bits.
namespace lumi {
namespace {

constexpr int kColumns = 16;                       // of one register of 512 bits, or two of 256
constexpr int kQuads = kByteDescriptorLength / 4;  // steps of a product
constexpr int kTile = 128;                         // columns that stay in the first cache: 16 KB
constexpr int kPackedBytes = kColumns * kByteDescriptorLength;
constexpr std::uint8_t kLargestFast = 127;

// The largest and the second largest of a stream of products, and where the largest stood first. Products that are not
// above 0 count for nothing, as with COLMAP.
struct TopTwo {
  std::int32_t best = 0, second = 0, at = -1;
  // In any order: of equal ones the one with the lowest index counts.
  void Take(std::int32_t value, std::int32_t index) {
    if (value > best) {
      second = best;
      best = value;
      at = index;
    } else if (value > 0) {
      if (value == best && index < at) at = index;
      second = std::max(second, value);
    }
  }
  void Take(const TopTwo& other) {
    if (other.at < 0) return;
    Take(other.best, other.at);
    second = std::max(second, std::min(other.second, best));
  }
};

// TopTwo of 16 columns.
struct alignas(64) TopTwos {
  std::int32_t best[kColumns], second[kColumns], at[kColumns];
  void Clear() {
    std::fill_n(best, kColumns, 0);
    std::fill_n(second, kColumns, 0);
    std::fill_n(at, kColumns, -1);
  }
};

// What a kernel is made of. Form: products[row][column] of kRows rows at `rows`, row after row, with 16 packed columns.
// Take: products of `count` rows come to the columns' lanes; row r's have the index first + r, and where `rising` each
// lane's is one more than the lane's before it. Indices rise from call to call.
struct PortableProducts {
  static constexpr int kRows = 4;
  LUMI_INLINE static void Take(TopTwos& top, const std::int32_t* products, int count, std::int32_t first, bool rising) {
    for (int r = 0; r < count; ++r)
      for (int l = 0; l < kColumns; ++l) {
        const std::int32_t v = products[r * kColumns + l], best = top.best[l];
        top.second[l] = std::max(top.second[l], std::min(v, best));
        top.at[l] = v > best ? first + r + (rising ? l : 0) : top.at[l];
        top.best[l] = std::max(v, best);
      }
  }
  LUMI_INLINE static void Form(const std::uint8_t* rows, const std::uint8_t* packed, std::int32_t* products) {
    for (int r = 0; r < kRows; ++r) {
      std::int32_t sum[kColumns] = {};
      for (int q = 0; q < kQuads; ++q)
        for (int l = 0; l < kColumns; ++l)
          for (int i = 0; i < 4; ++i)
            sum[l] += rows[r * kByteDescriptorLength + 4 * q + i] * packed[(q * kColumns + l) * 4 + i];
      std::copy_n(sum, kColumns, products + r * kColumns);
    }
  }
};

#if defined(__x86_64__)
#define LUMI_AVX2 __attribute__((target("avx2,fma,bmi2")))
#define LUMI_VNNI __attribute__((target("avx512f,avx512bw,avx512vl,avx512dq,avx512vnni,avx2,fma,bmi2")))

LUMI_INLINE std::int32_t FourBytes(const std::uint8_t* at) {
  std::int32_t word;
  std::memcpy(&word, at, sizeof(word));
  return word;
}

struct Avx2Products {
  static constexpr int kRows = 4;
  LUMI_AVX2 static inline void Take(TopTwos& top, const std::int32_t* products, int count, std::int32_t first,
                                    bool rising) {
    const __m256i one = _mm256_set1_epi32(1);
    for (int half = 0; half < 2; ++half) {
      auto* bests = reinterpret_cast<__m256i*>(top.best) + half;
      auto* seconds = reinterpret_cast<__m256i*>(top.second) + half;
      auto* places = reinterpret_cast<__m256i*>(top.at) + half;
      __m256i best = _mm256_load_si256(bests), second = _mm256_load_si256(seconds), at = _mm256_load_si256(places);
      __m256i index = _mm256_set1_epi32(first);
      if (rising)
        index = _mm256_add_epi32(
            index, _mm256_add_epi32(_mm256_set1_epi32(8 * half), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)));
      for (int r = 0; r < count; ++r) {
        const __m256i v = _mm256_load_si256(reinterpret_cast<const __m256i*>(products + r * kColumns) + half);
        second = _mm256_max_epi32(second, _mm256_min_epi32(v, best));
        at = _mm256_blendv_epi8(at, index, _mm256_cmpgt_epi32(v, best));
        best = _mm256_max_epi32(v, best);
        index = _mm256_add_epi32(index, one);
      }
      _mm256_store_si256(bests, best);
      _mm256_store_si256(seconds, second);
      _mm256_store_si256(places, at);
    }
  }
  LUMI_AVX2 static inline void Form(const std::uint8_t* rows, const std::uint8_t* packed, std::int32_t* products) {
    __m256i sum[kRows][2];
    for (auto& s : sum) s[0] = s[1] = _mm256_setzero_si256();
    const __m256i ones = _mm256_set1_epi16(1);
    for (int q = 0; q < kQuads; ++q) {
      const auto* columns = reinterpret_cast<const __m256i*>(packed + q * kColumns * 4);
      const __m256i left = _mm256_load_si256(columns), right = _mm256_load_si256(columns + 1);
      for (int r = 0; r < kRows; ++r) {
        const __m256i row = _mm256_set1_epi32(FourBytes(rows + r * kByteDescriptorLength + 4 * q));
        sum[r][0] = _mm256_add_epi32(sum[r][0], _mm256_madd_epi16(_mm256_maddubs_epi16(row, left), ones));
        sum[r][1] = _mm256_add_epi32(sum[r][1], _mm256_madd_epi16(_mm256_maddubs_epi16(row, right), ones));
      }
    }
    for (int r = 0; r < kRows; ++r)
      for (int half = 0; half < 2; ++half)
        _mm256_store_si256(reinterpret_cast<__m256i*>(products + r * kColumns + half * 8), sum[r][half]);
  }
};

struct VnniProducts {
  static constexpr int kRows = 8;
  LUMI_VNNI static inline void Take(TopTwos& top, const std::int32_t* products, int count, std::int32_t first,
                                    bool rising) {
    constexpr __mmask16 kAll = 0xffff;  // g++ 12 warns of its own header where there is no mask
    __m512i best = _mm512_load_si512(top.best), second = _mm512_load_si512(top.second), at = _mm512_load_si512(top.at);
    __m512i index = _mm512_set1_epi32(first);
    if (rising)
      index = _mm512_add_epi32(index, _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
    for (int r = 0; r < count; ++r) {
      const __m512i v = _mm512_load_si512(products + r * kColumns);
      second = _mm512_maskz_max_epi32(kAll, second, _mm512_maskz_min_epi32(kAll, v, best));
      at = _mm512_mask_mov_epi32(at, _mm512_cmpgt_epi32_mask(v, best), index);
      best = _mm512_maskz_max_epi32(kAll, v, best);
      index = _mm512_add_epi32(index, _mm512_set1_epi32(1));
    }
    _mm512_store_si512(top.best, best);
    _mm512_store_si512(top.second, second);
    _mm512_store_si512(top.at, at);
  }
  LUMI_VNNI static inline void Form(const std::uint8_t* rows, const std::uint8_t* packed, std::int32_t* products) {
    __m512i sum[kRows];
    for (auto& s : sum) s = _mm512_setzero_si512();
    for (int q = 0; q < kQuads; ++q) {
      const __m512i columns = _mm512_load_si512(packed + q * kColumns * 4);
      for (int r = 0; r < kRows; ++r)
        sum[r] = _mm512_dpbusd_epi32(sum[r], _mm512_set1_epi32(FourBytes(rows + r * kByteDescriptorLength + 4 * q)),
                                     columns);
    }
    for (int r = 0; r < kRows; ++r) _mm512_store_si512(products + r * kColumns, sum[r]);
  }
};
#endif

// One tile of packed columns with all rows. The body of each kernel below, which compiles it for its own processor.
template <typename Products>
LUMI_INLINE void MatchTileWith(const std::uint8_t* rows, int row_count, const std::uint8_t* packed, int groups,
                               int first_column, TopTwo* of_rows, TopTwos* of_columns) {
  constexpr int kRows = Products::kRows;
  alignas(64) std::int32_t products[kRows * kColumns];
  TopTwos of_lanes[kRows];
  for (int row = 0; row < row_count; row += kRows) {  // row_count: a multiple of kRows
    for (auto& lanes : of_lanes) lanes.Clear();
    for (int g = 0; g < groups; ++g) {
      Products::Form(rows + row * kByteDescriptorLength, packed + g * kPackedBytes, products);
      Products::Take(of_columns[g], products, kRows, row, false);
      for (int r = 0; r < kRows; ++r)
        Products::Take(of_lanes[r], products + r * kColumns, 1, first_column + g * kColumns, true);
    }
    for (int r = 0; r < kRows; ++r)
      for (int l = 0; l < kColumns; ++l)
        of_rows[row + r].Take(TopTwo{of_lanes[r].best[l], of_lanes[r].second[l], of_lanes[r].at[l]});
  }
}

using MatchTile = void (*)(const std::uint8_t*, int, const std::uint8_t*, int, int, TopTwo*, TopTwos*);

void MatchTilePortable(const std::uint8_t* rows, int row_count, const std::uint8_t* packed, int groups,
                       int first_column, TopTwo* of_rows, TopTwos* of_columns) {
  MatchTileWith<PortableProducts>(rows, row_count, packed, groups, first_column, of_rows, of_columns);
}
#if defined(__x86_64__)
LUMI_AVX2 void MatchTileAvx2(const std::uint8_t* rows, int row_count, const std::uint8_t* packed, int groups,
                             int first_column, TopTwo* of_rows, TopTwos* of_columns) {
  MatchTileWith<Avx2Products>(rows, row_count, packed, groups, first_column, of_rows, of_columns);
}
LUMI_VNNI void MatchTileVnni(const std::uint8_t* rows, int row_count, const std::uint8_t* packed, int groups,
                             int first_column, TopTwo* of_rows, TopTwos* of_columns) {
  MatchTileWith<VnniProducts>(rows, row_count, packed, groups, first_column, of_rows, of_columns);
}
#endif

MatchTile TileOf(ByteKernel kernel) {
  switch (kernel) {
#if defined(__x86_64__)
    case ByteKernel::kAvx2: return MatchTileAvx2;
    case ByteKernel::kAvx512Vnni: return MatchTileVnni;
#endif
    default: return MatchTilePortable;
  }
}

// Of one row with each of many, in 32 bits.
LUMI_KERNEL void ProductsOfRow(const std::uint8_t* row, const std::uint8_t* others, int count, std::int32_t* products) {
  for (int j = 0; j < count; ++j) {
    const std::uint8_t* other = others + static_cast<std::ptrdiff_t>(j) * kByteDescriptorLength;
    std::int32_t sum = 0;
    for (int k = 0; k < kByteDescriptorLength; ++k) sum += row[k] * other[k];
    products[j] = sum;
  }
}

const std::uint8_t* RowOf(const ByteDescriptors& d, int i) {
  return d.data() + static_cast<std::ptrdiff_t>(i) * kByteDescriptorLength;
}

// One photo's first features: the numbers that the kernels take, and the few features that they cannot.
struct FastRows {
  std::vector<std::uint8_t> numbers;  // rows of 128, the large features' as zeros, rows of zeros behind the last
  std::vector<int> large;             // features with a number beyond kLargestFast
  std::vector<char> is_large;
};

FastRows Prepare(const ByteDescriptors& d, int count, int multiple) {
  FastRows fast;
  const auto padded = static_cast<std::size_t>((count + multiple - 1) / multiple * multiple);
  fast.numbers.assign(padded * kByteDescriptorLength, 0);
  fast.is_large.assign(static_cast<std::size_t>(count), 0);
  for (int i = 0; i < count; ++i) {
    const std::uint8_t* row = RowOf(d, i);
    std::uint8_t largest = 0;
    for (int k = 0; k < kByteDescriptorLength; ++k) largest = std::max(largest, row[k]);
    if (largest > kLargestFast) {
      fast.large.push_back(i);
      fast.is_large[static_cast<std::size_t>(i)] = 1;
    } else {
      std::copy_n(row, kByteDescriptorLength,
                  fast.numbers.data() + static_cast<std::size_t>(i) * kByteDescriptorLength);
    }
  }
  return fast;
}

// 16 rows as columns: four numbers of each, then the next four.
void Pack(const std::uint8_t* rows, std::uint8_t* packed) {
  for (int q = 0; q < kQuads; ++q)
    for (int l = 0; l < kColumns; ++l)
      std::memcpy(packed + (q * kColumns + l) * 4, rows + l * kByteDescriptorLength + 4 * q, 4);
}

// COLMAP's tests, in its own arithmetic (FindBestMatchesOneWayBruteForce): angles in float.
bool Accepted(const TopTwo& top, const ByteMatchOptions& options) {
  constexpr float kUnit = 1.0f / (512.0f * 512.0f);
  if (top.at < 0) return false;
  const float nearest = std::acos(std::min(kUnit * static_cast<float>(top.best), 1.0f));
  const float second = std::acos(std::min(kUnit * static_cast<float>(top.second), 1.0f));
  return !(nearest > static_cast<float>(options.max_distance_rad)) &&
         nearest < static_cast<float>(options.max_ratio) * second;
}

}  // namespace

std::vector<ByteKernel> AvailableByteKernels() {
  std::vector<ByteKernel> kernels{ByteKernel::kPortable};
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
  if (avx2) kernels.push_back(ByteKernel::kAvx2);
  if (avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vnni"))
    kernels.push_back(ByteKernel::kAvx512Vnni);
#endif
  return kernels;
}

std::string Name(ByteKernel kernel) {
  switch (kernel) {
    case ByteKernel::kAvx2: return "AVX2";
    case ByteKernel::kAvx512Vnni: return "AVX-512 VNNI";
    default: return "portable";
  }
}

std::vector<std::pair<int, int>> MatchBytes(const ByteDescriptors& a, const ByteDescriptors& b,
                                            const ByteMatchOptions& options) {
  static const ByteKernel fastest = AvailableByteKernels().back();
  return MatchBytes(a, b, options, fastest);
}

std::vector<std::pair<int, int>> MatchBytes(const ByteDescriptors& a, const ByteDescriptors& b,
                                            const ByteMatchOptions& options, ByteKernel kernel) {
  for (const ByteDescriptors* d : {&a, &b})
    if (d->rows() > 0 && d->cols() != kByteDescriptorLength)
      throw UsageError(fmt::format("descriptors have {} numbers, {} are wanted", d->cols(), kByteDescriptorLength));
  const int count_a = static_cast<int>(std::min(options.most, a.rows()));
  const int count_b = static_cast<int>(std::min(options.most, b.rows()));
  if (count_a <= 0 || count_b <= 0) return {};
  constexpr int kMostRows = 8;  // of any kernel
  const FastRows fast_a = Prepare(a, count_a, kMostRows), fast_b = Prepare(b, count_b, kColumns);
  const int rows = static_cast<int>(fast_a.numbers.size()) / kByteDescriptorLength;
  const int columns = static_cast<int>(fast_b.numbers.size()) / kByteDescriptorLength;
  std::vector<TopTwo> of_a(static_cast<std::size_t>(rows)), of_b(static_cast<std::size_t>(columns));
  const MatchTile match_tile = TileOf(kernel);
  alignas(64) static thread_local std::array<std::uint8_t, kTile * kByteDescriptorLength> packed;
  std::array<TopTwos, kTile / kColumns> of_columns;
  for (int first = 0; first < columns; first += kTile) {
    const int groups = std::min(kTile, columns - first) / kColumns;
    for (int g = 0; g < groups; ++g) {
      Pack(fast_b.numbers.data() + static_cast<std::size_t>(first + g * kColumns) * kByteDescriptorLength,
           packed.data() + g * kPackedBytes);
      of_columns[static_cast<std::size_t>(g)].Clear();
    }
    match_tile(fast_a.numbers.data(), rows, packed.data(), groups, first, of_a.data(), of_columns.data());
    for (int g = 0; g < groups; ++g)
      for (int l = 0; l < kColumns; ++l) {
        const TopTwos& top = of_columns[static_cast<std::size_t>(g)];
        of_b[static_cast<std::size_t>(first + g * kColumns + l)] = {top.best[l], top.second[l], top.at[l]};
      }
  }
  std::vector<std::int32_t> products(static_cast<std::size_t>(std::max(count_a, count_b)));
  for (const int i : fast_a.large) {
    ProductsOfRow(RowOf(a, i), b.data(), count_b, products.data());
    for (int j = 0; j < count_b; ++j) {
      of_a[static_cast<std::size_t>(i)].Take(products[static_cast<std::size_t>(j)], j);
      of_b[static_cast<std::size_t>(j)].Take(products[static_cast<std::size_t>(j)], i);
    }
  }
  for (const int j : fast_b.large) {
    ProductsOfRow(RowOf(b, j), a.data(), count_a, products.data());
    for (int i = 0; i < count_a; ++i) {
      if (fast_a.is_large[static_cast<std::size_t>(i)]) continue;
      of_a[static_cast<std::size_t>(i)].Take(products[static_cast<std::size_t>(i)], j);
      of_b[static_cast<std::size_t>(j)].Take(products[static_cast<std::size_t>(i)], i);
    }
  }

  std::vector<std::pair<int, int>> matches;
  for (int i = 0; i < count_a; ++i) {
    const TopTwo& top = of_a[static_cast<std::size_t>(i)];
    if (!Accepted(top, options)) continue;
    const TopTwo& back = of_b[static_cast<std::size_t>(top.at)];
    if (back.at == i && Accepted(back, options)) matches.emplace_back(i, top.at);
  }
  return matches;
}

}  // namespace lumi
