#include "render/bezier/bezier_judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <utility>

namespace render {

// Homogeneous coordinates: w x, w y, w z, w (attribute − isovalue), w.
inline constexpr std::size_t kJudgedParts = 5;
/// Coefficients of the parts as polynomials in t ∈ [−1, 1]³, which covers a box; part fastest.
using TaylorForm = std::vector<double>;

/// A patch with one attribute.
struct JudgedPatch {
  std::array<int, 3> degree{};
  std::vector<double> control;  ///< parts of the control points
  std::array<double, kJudgedParts> most{};
  std::unordered_map<std::uint64_t, TaylorForm> kept = {};  ///< empty form: no sign change

  [[nodiscard]] std::size_t order(std::size_t axis) const {
    return static_cast<std::size_t>(degree[axis] + 1);
  }
};

namespace {

using Imath::V3d;

constexpr int kJudgedLevels = 24;
// Taylor forms up to this level are kept: their indices fit into a key.
constexpr int kKeptLevels = 8;
constexpr std::size_t kKeptBytes = std::size_t{256} << 20;
// Boxes overlap by this share of their edge, so that a root on a face is inside of one.
constexpr double kOverlap = 1e-3;
constexpr double kOutside = 1e-9;  // of the patch, that counts as inside
// Rounding error of a Taylor coefficient, as a share of the largest control point.
constexpr double kTaylorRounding = 4e-15;
constexpr std::size_t kMostBoxes = 400'000;

/// Box of parameters: an edge of 2^-level.
struct ParameterBox {
  int level = 0;
  std::array<std::uint32_t, 3> cell = {};
};

/// Powers of t of the Bernstein polynomials of one degree at centre + radius t:
/// entry [a * (degree + 1) + i] is the factor of t^i in the polynomial a.
std::vector<double> taylorMatrix(int degree, double centre, double radius) {
  const auto order = static_cast<std::size_t>(degree + 1);
  std::vector<double> rows(order * order, 0.0), next(order * order, 0.0);
  rows[0] = 1;
  for (std::size_t q = 1; q < order; ++q) {
    std::fill(next.begin(), next.end(), 0.0);
    // B_a of degree q is (1 − x) B_a + x B_(a−1) of degree q − 1, with x = centre + radius t.
    for (std::size_t a = 0; a < q; ++a)
      for (std::size_t i = 0; i < q; ++i) {
        const double c = rows[a * order + i];
        next[a * order + i] += (1 - centre) * c;
        next[a * order + i + 1] -= radius * c;
        next[(a + 1) * order + i] += centre * c;
        next[(a + 1) * order + i + 1] += radius * c;
      }
    std::swap(rows, next);
  }
  return rows;
}

double centreOf(const ParameterBox& box, std::size_t axis) {
  return std::ldexp(static_cast<double>(box.cell[axis]) + 0.5, -box.level);
}
double radiusOf(const ParameterBox& box) {
  return std::ldexp(0.5 * (1 + kOverlap), -box.level);
}

TaylorForm taylorForm(const JudgedPatch& patch, const ParameterBox& box) {
  std::vector<double> from = patch.control;
  // One axis after the other; the axis that is transformed moves to the end of the index, so after
  // three rounds the order is the first one again.
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double> matrix =
        taylorMatrix(patch.degree[axis], centreOf(box, axis), radiusOf(box));
    const std::size_t order = patch.order(axis), rest = from.size() / kJudgedParts / order;
    std::vector<double> to(from.size(), 0.0);
    for (std::size_t a = 0; a < order; ++a)
      for (std::size_t n = 0; n < rest; ++n)
        for (std::size_t i = 0; i < order; ++i) {
          const double factor = matrix[a * order + i];
          const double* source = from.data() + (a * rest + n) * kJudgedParts;
          double* target = to.data() + (n * order + i) * kJudgedParts;
          for (std::size_t part = 0; part < kJudgedParts; ++part)
            target[part] += factor * source[part];
        }
    from = std::move(to);
  }
  return from;
}

/// Polynomial in t with bounds of rounding errors.
struct TaylorLine {
  std::vector<double> c;
  double noise = 0;

  [[nodiscard]] bool mayVanish() const {
    double spread = noise;
    for (std::size_t n = 1; n < c.size(); ++n) spread += std::abs(c[n]);
    return std::abs(c[0]) <= spread;
  }
};

}  // namespace

class BezierJudge::Search {
 public:
  explicit Search(const BezierVolume& volume)
      : volume_(volume), attributes_(volume.attributeCount()), expression_(volume.expression) {
    const std::size_t attributes = volume.attributeCount();
    for (std::size_t number = 0; number < volume.patches.size() * attributes; ++number) {
      const BezierPatch& patch = volume.patches[number / attributes];
      JudgedPatch judged;
      judged.degree = patch.degree;
      for (std::size_t n = 0; n < patch.points.size(); ++n) {
        const double w = patch.weights.empty() ? 1 : patch.weights[n];
        const V3d& p = patch.points[n];
        const double parts[kJudgedParts] = {
            w * p.x, w * p.y, w * p.z,
            w * (patch.attributes[number % attributes][n] - volume.isovalue), w};
        for (std::size_t part = 0; part < kJudgedParts; ++part) {
          judged.control.push_back(parts[part]);
          judged.most[part] = std::max(judged.most[part], std::abs(parts[part]));
        }
      }
      patches_.push_back(std::move(judged));
    }
  }

  std::vector<JudgedRoot> roots(const Camera::Ray& ray) {
    ray_ = ray;
    // Planes through the ray: of the two coordinate axes that are least along it.
    V3d first(0);
    int least = 0;
    for (int c = 1; c < 3; ++c)
      if (std::abs(ray.direction[c]) < std::abs(ray.direction[least])) least = c;
    first[least] = 1;
    planes_[0] = (first - ray.direction * first.dot(ray.direction)).normalized();
    planes_[1] = ray.direction.cross(planes_[0]);
    found_.clear();
    for (std::size_t n = 0; n < patches_.size(); ++n) {
      boxes_ = 0;
      search(n, {});
    }
    std::sort(found_.begin(), found_.end(),
              [](const JudgedRoot& a, const JudgedRoot& b) { return a.distance < b.distance; });
    return found_;
  }

 private:
  /// Returns the Taylor form of a box, or null if the attribute has no zero in it.
  const TaylorForm* formOf(JudgedPatch& patch, const ParameterBox& box, TaylorForm& own) {
    const bool isKept = box.level <= kKeptLevels && keptBytes_ < kKeptBytes;
    std::uint64_t key = static_cast<std::uint64_t>(box.level);
    for (const std::uint32_t c : box.cell) key = key << 16 | c;
    if (box.level <= kKeptLevels)
      if (const auto known = patch.kept.find(key); known != patch.kept.end())
        return known->second.empty() ? nullptr : &known->second;
    own = taylorForm(patch, box);
    double spread = kTaylorRounding * patch.most[3];
    for (std::size_t n = kJudgedParts; n < own.size(); n += kJudgedParts)
      spread += std::abs(own[n + 3]);
    const bool hasZero = std::abs(own[3]) <= spread;
    if (!isKept) return hasZero ? &own : nullptr;
    keptBytes_ += sizeof(double) * (hasZero ? own.size() : 0) + 64;
    const TaylorForm& stored = patch.kept[key] = hasZero ? own : TaylorForm{};
    return hasZero ? &stored : nullptr;
  }

  TaylorLine line(const JudgedPatch& patch, const TaylorForm& form, const V3d& plane,
                  double offset) const {
    TaylorLine result;
    result.c.resize(form.size() / kJudgedParts);
    for (std::size_t n = 0; n < result.c.size(); ++n) {
      const double* part = form.data() + n * kJudgedParts;
      result.c[n] = plane.x * part[0] + plane.y * part[1] + plane.z * part[2] - offset * part[4];
    }
    result.noise = kTaylorRounding * (patch.most[0] + patch.most[1] + patch.most[2] +
                                      (std::abs(offset) + ray_.origin.length()) * patch.most[4]);
    return result;
  }

  void search(std::size_t number, const ParameterBox& box) {
    if (++boxes_ > kMostBoxes) return;
    JudgedPatch& patch = patches_[number];
    TaylorForm own;
    const TaylorForm* form = formOf(patch, box, own);
    if (!form) return;
    std::array<TaylorLine, 3> lines;
    for (std::size_t n = 0; n < 2; ++n) {
      lines[n] = line(patch, *form, planes_[n], planes_[n].dot(ray_.origin));
      if (!lines[n].mayVanish()) return;
    }
    // Depths: d·p − near must not be negative everywhere, nor d·p − far positive.
    const double start = ray_.direction.dot(ray_.origin);
    for (const bool isFar : {false, true}) {
      const double end = isFar ? ray_.far : ray_.near;
      if (!(std::abs(end) < 1e200)) continue;
      const TaylorLine depth = line(patch, *form, ray_.direction, start + end);
      if (!depth.mayVanish() && (depth.c[0] < 0) != isFar) return;
    }
    lines[2].c.resize(lines[0].c.size());
    for (std::size_t n = 0; n < lines[2].c.size(); ++n)
      lines[2].c[n] = (*form)[n * kJudgedParts + 3];
    lines[2].noise = kTaylorRounding * patch.most[3];
    const Verdict verdict = krawczyk(patch, lines);
    if (verdict == Verdict::None) return;
    if (verdict == Verdict::One && newton(number, box, *form, lines)) return;
    if (box.level >= kJudgedLevels) {
      add(number, box, *form, {0, 0, 0}, true);
      return;
    }
    for (std::uint32_t n = 0; n < 8; ++n)
      search(number, {box.level + 1,
                      {2 * box.cell[0] + (n >> 2), 2 * box.cell[1] + (n >> 1 & 1),
                       2 * box.cell[2] + (n & 1)}});
  }

  enum class Verdict { None, One, Open };

  /// Offsets of the linear coefficients.
  static std::array<std::size_t, 3> linear(const JudgedPatch& patch) {
    return {patch.order(1) * patch.order(2), patch.order(2), 1};
  }

  static bool inverseOf(const JudgedPatch& patch, const std::array<TaylorLine, 3>& lines,
                        double (&inverse)[3][3]) {
    const std::array<std::size_t, 3> at = linear(patch);
    double a[3][6];
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c) {
        a[r][c] = lines[r].c[at[c]];
        a[r][c + 3] = r == c;
      }
    for (std::size_t c = 0; c < 3; ++c) {  // Gauss-Jordan with row pivots
      std::size_t pivot = c;
      for (std::size_t r = c + 1; r < 3; ++r)
        if (std::abs(a[r][c]) > std::abs(a[pivot][c])) pivot = r;
      if (!(std::abs(a[pivot][c]) > 1e-300)) return false;
      for (std::size_t n = 0; n < 6; ++n) std::swap(a[c][n], a[pivot][n]);
      const double scale = 1 / a[c][c];
      for (double& entry : a[c]) entry *= scale;
      for (std::size_t r = 0; r < 3; ++r) {
        if (r == c) continue;
        const double factor = a[r][c];
        for (std::size_t n = 0; n < 6; ++n) a[r][n] -= factor * a[c][n];
      }
    }
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c) {
        inverse[r][c] = a[r][c + 3];
        if (!std::isfinite(inverse[r][c])) return false;
      }
    return true;
  }

  static Verdict krawczyk(const JudgedPatch& patch, const std::array<TaylorLine, 3>& lines) {
    double inverse[3][3];
    if (!inverseOf(patch, lines, inverse)) return Verdict::Open;
    const std::array<std::size_t, 3> order = {patch.order(0), patch.order(1), patch.order(2)};
    bool isInside = true;
    for (std::size_t r = 0; r < 3; ++r) {
      const double* m = inverse[r];
      const double noise = std::abs(m[0]) * lines[0].noise + std::abs(m[1]) * lines[1].noise +
                           std::abs(m[2]) * lines[2].noise;
      double centre = 0, radius = 20 * noise;  // noise also in the derivatives
      for (std::size_t i = 0, n = 0; i < order[0]; ++i)
        for (std::size_t j = 0; j < order[1]; ++j)
          for (std::size_t k = 0; k < order[2]; ++k, ++n) {
            const double g = m[0] * lines[0].c[n] + m[1] * lines[1].c[n] + m[2] * lines[2].c[n];
            if (n == 0) {
              centre = -g;
            } else if (i + j + k == 1) {
              const bool isDiagonal =
                  (r == 0 && i == 1) || (r == 1 && j == 1) || (r == 2 && k == 1);
              radius += std::abs(g - (isDiagonal ? 1 : 0));
            } else {  // its derivatives by the three parameters
              radius += static_cast<double>(i + j + k) * std::abs(g);
            }
          }
      if (!std::isfinite(centre) || !std::isfinite(radius)) return Verdict::Open;
      if (centre - radius > 1 || centre + radius < -1) return Verdict::None;
      isInside = isInside && centre - radius > -1 && centre + radius < 1;
    }
    return isInside ? Verdict::One : Verdict::Open;
  }

  /// Value and derivatives of a polynomial in t.
  static std::array<double, 4> valueOf(const JudgedPatch& patch, const double* c,
                                       std::size_t stride, const V3d& t) {
    std::array<double, 4> sum{};
    double pu = 1, du = 0;
    for (std::size_t i = 0; i < patch.order(0); ++i) {
      double pv = 1, dv = 0;
      for (std::size_t j = 0; j < patch.order(1); ++j) {
        double pw = 1, dw = 0;
        for (std::size_t k = 0; k < patch.order(2); ++k, c += stride) {
          sum[0] += *c * pu * pv * pw;
          sum[1] += *c * du * pv * pw;
          sum[2] += *c * pu * dv * pw;
          sum[3] += *c * pu * pv * dw;
          dw = static_cast<double>(k + 1) * pw;
          pw *= t.z;
        }
        dv = static_cast<double>(j + 1) * pv;
        pv *= t.y;
      }
      du = static_cast<double>(i + 1) * pu;
      pu *= t.x;
    }
    return sum;
  }

  /// Refines the root that a box is proven to have. @return false if rounding prevents that
  bool newton(std::size_t number, const ParameterBox& box, const TaylorForm& form,
              const std::array<TaylorLine, 3>& lines) {
    const JudgedPatch& patch = patches_[number];
    V3d t(0);
    double before = 1e300;
    for (int step = 0; step < 60; ++step) {
      std::array<std::array<double, 4>, 3> at{};
      for (std::size_t r = 0; r < 3; ++r) at[r] = valueOf(patch, lines[r].c.data(), 1, t);
      const V3d r0(at[0][1], at[0][2], at[0][3]), r1(at[1][1], at[1][2], at[1][3]),
          r2(at[2][1], at[2][2], at[2][3]);
      const double determinant = r0.dot(r1.cross(r2));
      if (determinant == 0) return false;
      const V3d change =
          (r1.cross(r2) * at[0][0] + r2.cross(r0) * at[1][0] + r0.cross(r1) * at[2][0]) /
          -determinant;
      t += change;
      const double length = change.length();
      if (!(length < 1e3)) return false;
      if (length < 1e-14 || (length < 1e-7 && length >= before)) {
        add(number, box, form, t, false);
        return true;
      }
      before = length;
    }
    return false;
  }

  void add(std::size_t number, const ParameterBox& box, const TaylorForm& form, const V3d& t,
           bool isUndecided) {
    const JudgedPatch& patch = patches_[number];
    JudgedRoot root;
    root.patch = static_cast<std::uint32_t>(number / attributes_);
    root.attribute = static_cast<std::uint32_t>(number % attributes_);
    root.isUndecided = isUndecided;
    for (int c = 0; c < 3; ++c) {
      const double u = centreOf(box, static_cast<std::size_t>(c)) + radiusOf(box) * t[c];
      if (!isUndecided && (u < -kOutside || u > 1 + kOutside)) return;
      root.parameter[c] = u;
    }
    if (const PatchTrim* trim = volume_.patches[root.patch].trim.get();
        trim && !judgedContains(trim->region->loops(), trim->pointAt(root.parameter)))
      return;
    std::array<std::array<double, 4>, kJudgedParts> at{};
    for (std::size_t part = 0; part < kJudgedParts; ++part)
      at[part] = valueOf(patch, form.data() + part, kJudgedParts, t);
    const double w = at[4][0];
    const V3d position(at[0][0] / w, at[1][0] / w, at[2][0] / w);
    root.distance = (position - ray_.origin).dot(ray_.direction);
    if (root.distance < ray_.near || root.distance > ray_.far || !(root.distance > 0)) return;
    V3d tangents[3];
    double slopes[3];
    for (std::size_t j = 0; j < 3; ++j) {
      for (int c = 0; c < 3; ++c) {
        const auto part = static_cast<std::size_t>(c);
        tangents[j][c] = (at[part][j + 1] - position[c] * at[4][j + 1]) / w;
      }
      slopes[j] = (at[3][j + 1] - at[3][0] / w * at[4][j + 1]) / w;
    }
    const double volume = tangents[0].dot(tangents[1].cross(tangents[2]));
    root.normal = tangents[1].cross(tangents[2]) * slopes[0] +
                  tangents[2].cross(tangents[0]) * slopes[1] +
                  tangents[0].cross(tangents[1]) * slopes[2];
    root.normal.normalize();
    if (volume < 0) root.normal = -root.normal;
    if (attributes_ > 1) {
      std::vector<char> inside(attributes_);
      for (std::size_t a = 0; a < attributes_; ++a)
        inside[a] =
            powerValue(patches_[number / attributes_ * attributes_ + a], root.parameter) < 0;
      const SurfaceSide side = sideOf(expression_, root.attribute, inside);
      if (side == SurfaceSide::None) return;
      if (side == SurfaceSide::Flipped) root.normal = -root.normal;
    }
    for (const JudgedRoot& other : found_)
      if (other.patch == root.patch && other.attribute == root.attribute &&
          (other.parameter - root.parameter).length() <
              (other.isUndecided && root.isUndecided ? 1e-5 : 1e-9))
        return;
    found_.push_back(root);
  }

  /// Sign of an attribute at a parameter, by its Taylor form there.
  static double powerValue(const JudgedPatch& patch, const V3d& parameter) {
    double sum = 0;
    std::array<std::vector<double>, 3> rows;
    for (std::size_t axis = 0; axis < 3; ++axis)
      rows[axis] = taylorMatrix(patch.degree[axis], parameter[static_cast<int>(axis)], 0);
    const double* c = patch.control.data() + 3;
    for (std::size_t i = 0; i < patch.order(0); ++i)
      for (std::size_t j = 0; j < patch.order(1); ++j)
        for (std::size_t k = 0; k < patch.order(2); ++k, c += kJudgedParts)
          sum += *c * rows[0][i * patch.order(0)] * rows[1][j * patch.order(1)] *
                 rows[2][k * patch.order(2)];
    return sum;
  }

  const BezierVolume& volume_;
  std::size_t attributes_;
  std::vector<int> expression_;
  std::vector<JudgedPatch> patches_;  ///< for each patch, by attribute
  std::size_t keptBytes_ = 0, boxes_ = 0;
  Camera::Ray ray_;
  V3d planes_[2];
  std::vector<JudgedRoot> found_;
};

BezierJudge::BezierJudge(const BezierVolume& volume) : search_(std::make_unique<Search>(volume)) {}
BezierJudge::~BezierJudge() = default;
BezierJudge::BezierJudge(BezierJudge&&) noexcept = default;
BezierJudge& BezierJudge::operator=(BezierJudge&&) noexcept = default;

std::vector<JudgedRoot> BezierJudge::roots(const Camera::Ray& ray) {
  return search_->roots(ray);
}

}  // namespace render
