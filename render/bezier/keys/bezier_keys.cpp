#include "render/bezier/keys/bezier_keys.h"

#include <fmt/core.h>

#include <cstddef>

#include "levelset/error.h"

namespace render {
namespace {

bool haveSameTrims(const BezierPatch& a, const BezierPatch& b) {
  if (!a.trim || !b.trim) return !a.trim && !b.trim;
  return a.trim->box == b.trim->box &&
         (a.trim->region == b.trim->region || a.trim->region->loops() == b.trim->region->loops());
}

/// Part in which two volumes differ, in words; null: none.
const char* differenceOf(const BezierVolume& a, const BezierVolume& b) {
  if (a.isovalue != b.isovalue) return "the isovalue";
  if (a.expression != b.expression) return "the expression";
  if (a.patches.size() != b.patches.size()) return "the number of patches";
  for (std::size_t n = 0; n < a.patches.size(); ++n) {
    const BezierPatch &p = a.patches[n], &q = b.patches[n];
    if (p.degree != q.degree) return "the degree of a patch";
    if (p.attributes.size() != q.attributes.size()) return "the number of attributes";
    if (p.weights.empty() != q.weights.empty()) return "weights";
    if (!haveSameTrims(p, q)) return "trimming loops";
  }
  return nullptr;
}

}  // namespace

void requireSameVolumes(const std::vector<BezierVolume>& keys) {
  for (std::size_t k = 1; k < keys.size(); ++k)
    if (const char* part = differenceOf(keys.front(), keys[k]))
      throw levelset::InvalidInput(
          fmt::format("Bézier volume {} and Bézier volume 1 differ in {}; give volumes that differ "
                      "in the numbers of their control points only",
                      k + 1, part));
}

BezierVolume volumeBetween(const std::vector<BezierVolume>& keys,
                           const std::vector<levelset::KeyWeight>& weights) {
  if (weights.size() == 1) return keys[weights.front().key];
  BezierVolume between = keys.front();
  for (std::size_t p = 0; p < between.patches.size(); ++p) {
    BezierPatch& patch = between.patches[p];
    const auto of = [&](std::size_t key) -> const BezierPatch& { return keys[key].patches[p]; };
    for (std::size_t n = 0; n < patch.points.size(); ++n)
      patch.points[n] =
          levelset::blendOf(weights, [&](std::size_t key) { return of(key).points[n]; });
    for (std::size_t a = 0; a < patch.attributes.size(); ++a)
      for (std::size_t n = 0; n < patch.attributes[a].size(); ++n)
        patch.attributes[a][n] =
            levelset::blendOf(weights, [&](std::size_t key) { return of(key).attributes[a][n]; });
    for (std::size_t n = 0; n < patch.weights.size(); ++n)
      patch.weights[n] =
          levelset::blendOf(weights, [&](std::size_t key) { return of(key).weights[n]; });
  }
  requireBezierVolume(between);
  return between;
}

}  // namespace render
