#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

/// The radial functions φ of RBF maps [Brodersen07 table 8.1], with proven bounds.
namespace levelset::rbf {

/// φ takes r in mean particle spacings, and that of a compact kernel in support radii, so that a
/// map does not depend on the unit of length. For homogeneous kernels (r, r³) the map does not
/// depend on the spacing either, apart from the scale of the relaxation λ of the fit. The same
/// holds for r² log r, which is homogeneous up to a polynomial that the side conditions on the
/// weights cancel.
enum class RbfKernel : std::uint8_t {
  Biharmonic,   ///< r: conditionally negative definite of order 1, least bending energy
  Triharmonic,  ///< r³: conditionally positive definite of order 2
  ThinPlate,    ///< r² log r: conditionally positive definite of order 2
  Sum,          ///< r³ + r² log r: conditionally positive definite of order 2
  /// Multi-order Laplacian, τ = 0.02 and δ = 5 [Dinh02], divided by its value at 0: positive
  /// definite and local.
  Laplacian,
  Gaussian,  ///< exp(−r²): positive definite and local
  /// (1 − r)⁴ (4r + 1) for r < 1 and 0 beyond, of class C² and positive definite in space
  /// [Wendland05 ch. 9]. The matrix of many particles is sparse.
  Wendland
};

/// Kernels as structs of static functions, so that loops are compiled for each kernel.
///   kSign                 +1 if Σ a_i a_j φ(|p_i − p_j|) ≥ 0 for all a orthogonal to the linear
///                         polynomials, −1 if ≤ 0
///   value(r), slope(r)    φ(r) and φ′(r)
///   sixth(d)              ≥ |d⁶φ/dt⁶| / 6! along any straight line at distance d or more;
///                         decreases with d
///   slopeBound(lo, hi)    ≥ |φ′| for r in [lo, hi]
///   bendBound(lo, hi)     ≥ the norm of the Hessian of φ(|x|) for |x| in [lo, hi]; may be infinite
///   farBound(d)           ≥ |φ| for r ≥ d; infinite if φ grows
/// r^(2k+1) and r^(2k) log r have the sign (−1)^(k+1) at order k + 1 in any dimension [Wendland05
/// ch. 8]. So linear polynomials, order 2, suffice for all seven kernels.
namespace kernels {

/// sixth() follows from Gegenbauer polynomials. Along a line, |x − p| = r √(1 − 2ct + t²) is their
/// generating function, with the step t in units of r and the cosine c. Its coefficient at t⁶ is
/// (P₄ − P₆)(c)/11, which is largest at c = 0.
struct Biharmonic {
  static constexpr double kSign = -1;
  static double value(double r) { return r; }
  static double slope(double) { return 1; }
  static double sixth(double d) {
    const double squared = d * d;
    return (0.375 + 0.3125) / 11 / (squared * squared * d);
  }
  static double slopeBound(double, double) { return 1; }
  static double bendBound(double lo, double) { return 1 / lo; }
  static double farBound(double) { return HUGE_VAL; }
};

/// sixth(): the coefficient of (1 − 2ct + t²)^(3/2) at t⁶ is (1 − c²)²(7c² − 1)/16, of largest
/// magnitude at c = 0.
struct Triharmonic {
  static constexpr double kSign = 1;
  static double value(double r) { return r * r * r; }
  static double slope(double r) { return 3 * r * r; }
  static double sixth(double d) { return 0.0625 / (d * d * d); }
  static double slopeBound(double, double hi) { return 3 * hi * hi; }
  static double bendBound(double, double hi) { return 6 * hi; }
  static double farBound(double) { return HUGE_VAL; }
};

/// sixth(): with log(1 − 2ct + t²) = −Σ 2 T_n(c) tⁿ/n and q = 1 − 2ct + t², the coefficient of
/// q log(q)/2 at t⁶ is T₆/30 − T₄/20, with Chebyshev polynomials T_n. bendBound(): the Hessian has
/// the eigenvalues 2 log r + 1 (twice) and 2 log r + 3.
struct ThinPlate {
  static constexpr double kSign = 1;
  static double value(double r) { return r > 0 ? r * r * std::log(r) : 0; }
  static double slope(double r) { return r > 0 ? r * (2 * std::log(r) + 1) : 0; }
  static double sixth(double d) {
    const double squared = d * d;
    return 1 / (12 * squared * squared);
  }
  static double slopeBound(double, double hi) {
    // −r (2 log r + 1) is largest where 2 log r = −3.
    return std::max(2 * std::exp(-1.5), slope(hi));
  }
  static double bendBound(double lo, double hi) {
    return std::max(std::abs(2 * std::log(lo) + 1), std::abs(2 * std::log(hi) + 3));
  }
  static double farBound(double) { return HUGE_VAL; }
};

struct Sum {
  static constexpr double kSign = 1;
  static double value(double r) { return Triharmonic::value(r) + ThinPlate::value(r); }
  static double slope(double r) { return Triharmonic::slope(r) + ThinPlate::slope(r); }
  static double sixth(double d) { return Triharmonic::sixth(d) + ThinPlate::sixth(d); }
  static double slopeBound(double lo, double hi) {
    return Triharmonic::slopeBound(lo, hi) + ThinPlate::slopeBound(lo, hi);
  }
  static double bendBound(double lo, double hi) {
    return Triharmonic::bendBound(lo, hi) + ThinPlate::bendBound(lo, hi);
  }
  static double farBound(double) { return HUGE_VAL; }
};

/// Green's function of δ²∇² − ∇⁴ + τ²∇⁶ up to its sign: (1 + a e^(−fr) − b e^(−sr)) / (4π δ² r)
/// with f² and s² = (1 ± √(1 − 4τ²δ²)) / (2τ²), a = s²/(f² − s²), b = f²/(f² − s²). Its Fourier
/// transform 1/(δ²ξ² + ξ⁴ + τ²ξ⁶) is positive. τ and δ are in mean particle spacings.
struct LaplacianShape {
  static constexpr double kTau = 0.02, kDelta = 5;
  double fast, slow;  ///< f and s of the formula above
  double a, b;        ///< b − a = 1
  double scale;       ///< factor that makes φ(0) = 1
  double bendAtZero;  ///< |φ″(0)|
  LaplacianShape() {
    const double root = std::sqrt(1 - 4 * kTau * kTau * kDelta * kDelta);
    const double f = (1 + root) / (2 * kTau * kTau), s = (1 - root) / (2 * kTau * kTau);
    fast = std::sqrt(f), slow = std::sqrt(s);
    a = s / (f - s), b = f / (f - s);
    scale = (fast + slow) / (fast * slow);
    bendAtZero = scale * fast * fast * slow * slow / (3 * (fast + slow));
  }
};
inline const LaplacianShape kLaplacian;

/// Multi-order Laplacian. Since its Fourier transform is positive, no second derivative exceeds the
/// one at 0 in magnitude.
struct Laplacian {
  static constexpr double kSign = 1;
  static double value(double r) {
    const LaplacianShape& k = kLaplacian;
    const double at = std::max(r, 1e-100);  // avoids 0/0 at r = 0, where φ has the limit 1
    return k.scale * (k.a * std::expm1(-k.fast * at) - k.b * std::expm1(-k.slow * at)) / at;
  }
  static double slope(double r) {
    const LaplacianShape& k = kLaplacian;
    // Linear near 0, where the closed form suffers cancellation.
    if (r < 3e-7) return -k.bendAtZero * r;
    const double f = k.fast, s = k.slow;
    return (k.scale * (k.b * s * std::exp(-s * r) - k.a * f * std::exp(-f * r)) - value(r)) / r;
  }
  static double sixth(double d) {
    const LaplacianShape& k = kLaplacian;
    const double squared = d * d;
    return k.scale * (1 + k.a * yukawa(k.fast * d) + k.b * yukawa(k.slow * d)) /
           (squared * squared * squared * d);
  }
  static double slopeBound(double lo, double hi) {
    const LaplacianShape& k = kLaplacian;
    const auto part = [&](double rate) { return std::exp(-rate * lo) * (rate * lo + 1); };
    const double far = k.scale * (1 + k.a * part(k.fast) + k.b * part(k.slow)) / (lo * lo);
    return std::min(k.bendAtZero * hi, far);
  }
  static double bendBound(double lo, double) {
    const LaplacianShape& k = kLaplacian;
    const auto part = [&](double rate) {
      const double x = rate * lo;
      return std::exp(-x) * (x * x + 2 * x + 2);
    };
    const double far = k.scale * (2 + k.a * part(k.fast) + k.b * part(k.slow)) / (lo * lo * lo);
    return std::min(k.bendAtZero, far);
  }
  static double farBound(double d) { return kLaplacian.scale / d; }

 private:
  /// Bound on the coefficient of exp(−κ√q)/√q, q = 1 − 2ct + t², at t⁶, by Cauchy's estimate. It
  /// uses circles of radius 6/7, where |√q| ≥ 1/7 and Re √q ≥ 0, and of radius 1/2, where Re √q ≥
  /// (1/2) cos(π/6).
  static double yukawa(double rate) { return std::min(17.66, 128 * std::exp(-0.433 * rate)); }
};

/// sixth() uses Cramér's inequality: |H₆(t)| exp(−t²/2) ≤ 1.0865 · 2³ √6!.
struct Gaussian {
  static constexpr double kSign = 1;
  static double value(double r) { return std::exp(-r * r); }
  static double slope(double r) { return -2 * r * std::exp(-r * r); }
  static double sixth(double d) { return 0.324 * std::exp(-0.5 * d * d); }
  static double slopeBound(double lo, double) {
    const double at = std::max(lo, M_SQRT1_2);  // position of the maximum of |φ′| for r ≥ lo
    return 2 * at * std::exp(-at * at);
  }
  static double bendBound(double lo, double) {
    // |φ″| = |4r² − 2| exp(−r²) is 2 at r = 0 and has a second maximum at r² = 3/2.
    const double squared = lo * lo;
    if (squared > 1.5) return (4 * squared - 2) * std::exp(-squared);
    return std::max(2 * std::exp(-squared), 4 * std::exp(-1.5));
  }
  static double farBound(double d) { return std::exp(-d * d); }
};

/// φ′ = −20 r (1 − r)³ and φ″ = 20 (1 − r)² (4r − 1). The fourth derivative jumps at r = 1.
struct Wendland {
  static constexpr double kSign = 1;
  static double value(double r) {
    const double t = std::max(1 - r, 0.0), squared = t * t;
    return squared * squared * (4 * r + 1);
  }
  static double slope(double r) {
    const double t = std::max(1 - r, 0.0);
    return -20 * r * t * t * t;
  }
  static double sixth(double d) { return d < 1 ? HUGE_VAL : 0; }
  static double slopeBound(double lo, double hi) {
    return -slope(std::clamp(0.25, lo, hi));  // |φ′| is largest at r = 1/4
  }
  static double bendBound(double lo, double) {
    // |φ′/r| decreases; |φ″| is less up to r = 2/5, and decreases from r = 1/2.
    const double t = std::max(1 - lo, 0.0), at = std::max(lo, 0.5), u = std::max(1 - at, 0.0);
    return std::max(20 * t * t * t, 20 * u * u * (4 * at - 1));
  }
  static double farBound(double d) { return value(d); }
};

}  // namespace kernels

/// True for a kernel that is 0 beyond its support radius, which is then the unit of r.
constexpr bool isCompact(RbfKernel kernel) {
  return kernel == RbfKernel::Wendland;
}

/// Calls `use` with an object of the kernel's struct in `rbf`.
template <typename Use>
decltype(auto) withKernel(RbfKernel kernel, const Use& use) {
  switch (kernel) {
    case RbfKernel::Triharmonic:
      return use(kernels::Triharmonic{});
    case RbfKernel::ThinPlate:
      return use(kernels::ThinPlate{});
    case RbfKernel::Sum:
      return use(kernels::Sum{});
    case RbfKernel::Laplacian:
      return use(kernels::Laplacian{});
    case RbfKernel::Gaussian:
      return use(kernels::Gaussian{});
    case RbfKernel::Wendland:
      return use(kernels::Wendland{});
    case RbfKernel::Biharmonic:
      break;
  }
  return use(kernels::Biharmonic{});
}

}  // namespace levelset::rbf
