#pragma once

// Internal header of levelset: public headers must not include it. Numbers of four searches at
// once, for vector instructions. Each lane has the bits that scalar code gives.

#include <cmath>
#include <cstdint>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "levelset/vdb.h"

/// Compiles a function for AVX2, too, and takes that version on machines that have it. Both give
/// the same bits, because AVX2 does not contain fused operations. Functions on lanes that it calls
/// must be LEVELSET_INLINE. Sanitized builds have one version, since the selection runs before the
/// sanitizers start.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define LEVELSET_AVX2_CLONE __attribute__((target_clones("avx2", "default")))
#else
#define LEVELSET_AVX2_CLONE
#endif
#define LEVELSET_INLINE __attribute__((always_inline)) inline

#if defined(__GNUC__) && !defined(__clang__)
// Vectors of 32 bytes have another calling convention with AVX. They are arguments of inlined
// functions only.
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

namespace levelset::eikonal {

constexpr int kLanes = 4;
using FloatLanes = float __attribute__((vector_size(16)));
using IntLanes = std::int32_t __attribute__((vector_size(16)));
using DoubleLanes = double __attribute__((vector_size(32)));
using LongLanes = std::int64_t __attribute__((vector_size(32)));

LEVELSET_INLINE double squareRoot(double x) {
  return std::sqrt(x);
}
LEVELSET_INLINE DoubleLanes squareRoot(const DoubleLanes& x) {
#if defined(__SSE2__)
  const __m128d low = _mm_sqrt_pd(__m128d{x[0], x[1]}), high = _mm_sqrt_pd(__m128d{x[2], x[3]});
  return DoubleLanes{low[0], low[1], high[0], high[1]};
#else
  return DoubleLanes{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
#endif
}

/// Returns `a` where the condition holds, else `b`.
template <typename T>
LEVELSET_INLINE T select(bool condition, const T& a, const T& b) {
  return condition ? a : b;
}
LEVELSET_INLINE DoubleLanes select(const LongLanes& condition, const DoubleLanes& a,
                                   const DoubleLanes& b) {
  return condition ? a : b;
}

/// Returns 1 with the sign of x.
LEVELSET_INLINE double signOf(double x) {
  return std::copysign(1.0, x);
}
LEVELSET_INLINE DoubleLanes signOf(const DoubleLanes& x) {
  const DoubleLanes zero = {-0.0, -0.0, -0.0, -0.0}, one = {1, 1, 1, 1};
  return reinterpret_cast<DoubleLanes>(
      (reinterpret_cast<LongLanes>(x) & reinterpret_cast<LongLanes>(zero)) |
      reinterpret_cast<LongLanes>(one));
}

LEVELSET_INLINE DoubleLanes toDouble(const FloatLanes& x) {
  return __builtin_convertvector(x, DoubleLanes);
}

/// Rounds down.
/// @pre the result fits into an int
LEVELSET_INLINE IntLanes floorOf(const DoubleLanes& x) {
  const IntLanes whole = __builtin_convertvector(x, IntLanes);
  const LongLanes isAbove = __builtin_convertvector(whole, DoubleLanes) > x;
  return whole + __builtin_convertvector(isAbove, IntLanes);
}

/// Swaps lanes and components: afterwards, rows[i][j] is the former rows[j][i].
LEVELSET_INLINE void transpose(FloatLanes (&rows)[4]) {
  const FloatLanes a = __builtin_shufflevector(rows[0], rows[1], 0, 4, 1, 5),
                   b = __builtin_shufflevector(rows[0], rows[1], 2, 6, 3, 7),
                   c = __builtin_shufflevector(rows[2], rows[3], 0, 4, 1, 5),
                   d = __builtin_shufflevector(rows[2], rows[3], 2, 6, 3, 7);
  rows[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  rows[1] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  rows[2] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  rows[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

/// Vector with components of type double, or of one number for each lane.
template <typename T>
struct Triple {
  T x, y, z;
};

template <typename T>
LEVELSET_INLINE T dot(const Triple<T>& a, const Triple<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <typename T>
LEVELSET_INLINE Triple<T> operator*(const Triple<T>& a, const T& s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <typename T>
LEVELSET_INLINE Triple<T> operator/(const Triple<T>& a, const T& s) {
  return {a.x / s, a.y / s, a.z / s};
}
template <typename T>
LEVELSET_INLINE Triple<T> operator+(const Triple<T>& a, const Triple<T>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <typename T>
LEVELSET_INLINE Triple<T> operator-(const Triple<T>& a, const Triple<T>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

LEVELSET_INLINE Triple<double> tripleOf(const openvdb::Vec3d& v) {
  return {v.x(), v.y(), v.z()};
}
LEVELSET_INLINE openvdb::Vec3d vectorOf(const Triple<double>& v) {
  return {v.x, v.y, v.z};
}
/// Returns the vector of one lane.
LEVELSET_INLINE openvdb::Vec3d vectorOf(const Triple<DoubleLanes>& v, int lane) {
  return {v.x[lane], v.y[lane], v.z[lane]};
}

LEVELSET_INLINE void setLane(Triple<DoubleLanes>& lanes, int lane, const openvdb::Vec3d& v) {
  lanes.x[lane] = v.x();
  lanes.y[lane] = v.y();
  lanes.z[lane] = v.z();
}

/// Value, gradient and second derivatives of a field, see Jet, as a number or one for each lane.
template <typename T>
struct JetOf {
  T value;
  Triple<T> gradient;
  T xx, yy, zz, xy, xz, yz;

  LEVELSET_INLINE Triple<T> hessianTimes(const Triple<T>& v) const {
    return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z};
  }
};

}  // namespace levelset::eikonal
