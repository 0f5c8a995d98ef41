#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "levelset/splines/barycentric.h"
#include "levelset/splines/elimination.h"
#include "levelset/splines/smoothness.h"

namespace levelset {

/// Linear system of the C¹ conditions of splines of a degree on tetrahedra. The unknowns are the
/// coefficients of the continuous splines, one for each domain point. For small meshes: the rank is
/// found by dense elimination.
template <int Degree, class Scalar>
class SmoothnessSystem {
 public:
  using Point = std::array<Scalar, 3>;
  using Exponents = std::array<int, 4>;
  /// Decides if a condition of the system is imposed. Its arguments are the tetrahedron, and the
  /// exponents of its face coefficients, of which the vertex opposite the face has exponent 0.
  using Filter = std::function<bool(int tetrahedron, const Exponents& face)>;

  /// @param tetrahedra  four vertex numbers each; neighbours share three of them
  /// @throws InvalidInput if a tetrahedron is flat
  SmoothnessSystem(const std::vector<Point>& vertices,
                   const std::vector<std::array<int, 4>>& tetrahedra, const Filter& isImposed = {})
      : tetrahedra_(tetrahedra) {
    for (const auto& tetrahedron : tetrahedra_)
      for (const Exponents& e : bernsteinExponents<4, Degree>())
        numbers_.try_emplace(key(tetrahedron, e), static_cast<int>(numbers_.size()));
    std::map<std::array<int, 3>, int> open;
    for (int t = 0; t < static_cast<int>(tetrahedra_.size()); ++t)
      for (int apex = 0; apex < 4; ++apex) {
        std::array<int, 3> triangle{};
        for (int v = 0, n = 0; v < 4; ++v)
          if (v != apex) triangle[n++] = tetrahedra_[t][v];
        std::sort(triangle.begin(), triangle.end());
        const auto [other, isNew] = open.try_emplace(triangle, t);
        if (!isNew) addFace(vertices, other->second, t, isImposed);
      }
  }

  /// Number of domain points.
  [[nodiscard]] int coefficientCount() const { return static_cast<int>(numbers_.size()); }

  /// Number of the unknown that a coefficient of a tetrahedron is.
  [[nodiscard]] int unknown(int tetrahedron, const Exponents& exponents) const {
    return numbers_.at(key(tetrahedra_[tetrahedron], exponents));
  }

  /// Dimension of the space of splines that meet the conditions.
  [[nodiscard]] int dimension() const { return coefficientCount() - rankOf(conditions_); }

  /// Returns true if the conditions determine all coefficients from those of the set.
  /// @param set  numbers of unknowns; repeated ones count once
  [[nodiscard]] bool isDeterminingSet(const std::vector<int>& set) const {
    std::vector<bool> isKnown(numbers_.size(), false);
    for (const int n : set) isKnown[n] = true;
    std::vector<std::vector<Scalar>> rows;
    for (const auto& condition : conditions_) {
      std::vector<Scalar> row;
      for (std::size_t n = 0; n < condition.size(); ++n)
        if (!isKnown[n]) row.push_back(condition[n]);
      rows.push_back(std::move(row));
    }
    const auto open = std::count(isKnown.begin(), isKnown.end(), false);
    return rankOf(std::move(rows)) == static_cast<int>(open);
  }

 private:
  /// A domain point by the vertices of its coefficient and their exponents, for any order of the
  /// vertices in the tetrahedron.
  using Key = std::vector<std::pair<int, int>>;

  static Key key(const std::array<int, 4>& tetrahedron, const Exponents& exponents) {
    Key result;
    for (int v = 0; v < 4; ++v)
      if (exponents[v] > 0) result.emplace_back(tetrahedron[v], exponents[v]);
    std::sort(result.begin(), result.end());
    return result;
  }

  void addFace(const std::vector<Point>& vertices, int a, int b, const Filter& isImposed) {
    const auto face = sharedFace(tetrahedra_[a], tetrahedra_[b]);
    if (!face) return;
    std::array<Point, 4> corners;
    for (int v = 0; v < 4; ++v) corners[v] = vertices[tetrahedra_[a][v]];
    const auto apex =
        barycentricMap(corners).coordinates(vertices[tetrahedra_[b][face->secondApex]]);
    constexpr auto kExponents = bernsteinExponents<4, Degree>();
    for (const auto& condition : smoothnessConditions<1, Degree, Scalar>(*face, apex)) {
      Exponents onFace{};
      for (int v = 0; v < 3; ++v) onFace[face->first[v]] = condition.face[v];
      if (isImposed && !isImposed(a, onFace)) continue;
      std::vector<Scalar> row(numbers_.size(), Scalar(0));
      row[unknown(b, kExponents[condition.target])] = Scalar(1);
      for (int s = 0; s < condition.kTerms; ++s)
        row[unknown(a, kExponents[condition.sources[s]])] -= condition.factors[s];
      conditions_.push_back(std::move(row));
    }
  }

  std::vector<std::array<int, 4>> tetrahedra_;
  std::map<Key, int> numbers_;
  std::vector<std::vector<Scalar>> conditions_;
};

}  // namespace levelset
