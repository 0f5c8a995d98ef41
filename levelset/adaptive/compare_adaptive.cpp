#include "levelset/adaptive/compare_adaptive.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "levelset/adaptive/adaptive_csg.h"
#include "levelset/adaptive/adaptive_to_mesh.h"
#include "levelset/error.h"
#include "levelset/inspect/surface_difference.h"
#include "levelset/progress_gate.h"

namespace levelset {
namespace {

using Imath::V3d;

/// Distances of one surface from another.
struct OneSided {
  double largest = 0, mean = 0;
};

OneSided distances(const TriMesh& from, const TriangleSurface& to, double spacing,
                   const Progress& progress) {
  const std::size_t count = from.triangles.size();
  std::vector<double> largest(count, 0), sums(count, 0), areas(count, 0);
  ProgressGate gate(progress, count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t t) {
    std::array<V3d, 3> p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = from.positions[from.triangles[t][k]];
    double side = 0;
    for (std::size_t k = 0; k < 3; ++k) side = std::max(side, (p[(k + 1) % 3] - p[k]).length());
    const int parts = std::max(1, static_cast<int>(std::ceil(side / spacing)));
    const V3d u = (p[1] - p[0]) / parts, v = (p[2] - p[0]) / parts;
    const auto distance = [&](double i, double j) {
      return to.distance(p[0] + u * i + v * j, std::numeric_limits<double>::infinity());
    };
    double sum = 0, most = 0;
    for (int j = 0; j <= parts; ++j)
      for (int i = 0; i + j <= parts; ++i) {
        most = std::max(most, distance(i, j));        // a corner of parts
        for (const double at : {1.0 / 3, 2.0 / 3}) {  // the middle of the two parts beside it
          if (i + j + (at < 0.5 ? 1 : 2) > parts) continue;
          const double middle = distance(i + at, j + at);
          sum += middle;
          most = std::max(most, middle);
        }
      }
    areas[t] = u.cross(v).length() / 2 * parts * parts;
    sums[t] = sum / (double(parts) * parts) * areas[t];
    largest[t] = most;
    gate.advance(1);
  });
  OneSided result;
  double sum = 0, area = 0;
  for (std::size_t t = 0; t < count; ++t) {
    result.largest = std::max(result.largest, largest[t]);
    sum += sums[t];
    area += areas[t];
  }
  result.mean = area > 0 ? sum / area : 0;
  return result;
}

/// Volume inside both solids; 0 for solids that are apart.
double volumeOfBoth(const AdaptiveField& a, const AdaptiveField& b, std::size_t maxMemory,
                    const Progress& progress) {
  const std::array both{a, b};
  try {
    return signedVolume(
        adaptiveToMesh(combineAdaptive(CsgOperation::Intersection, both,
                                       {.tolerance = std::min(a.tolerance(), b.tolerance()),
                                        .maxMemory = maxMemory,
                                        .progress = progress})));
  } catch (const NoSurface&) {
    return 0;
  }
}

}  // namespace

Comparison compare(const AdaptiveField& a, const AdaptiveField& b, const CompareOptions& options) {
  const Progress& progress = options.progress;
  TriMesh ofA = adaptiveToMesh(
      a, {.maxMemory = options.maxMemory, .progress = subProgress(progress, 0, 0.1)});
  TriMesh ofB = adaptiveToMesh(
      b, {.maxMemory = options.maxMemory, .progress = subProgress(progress, 0.1, 0.2)});
  if (ofA.isEmpty() || ofB.isEmpty())
    throw InvalidInput("an operand has no surface; there is nothing to compare");
  const TriangleSurface surfaceA(ofA), surfaceB(ofB);
  Imath::Box3d box = bounds(ofA);
  box.extendBy(bounds(ofB));
  constexpr double kParts = 500;
  const double spacing = std::max({a.tolerance(), b.tolerance(), box.size().length() / kParts});
  const OneSided there = distances(ofA, surfaceB, spacing, subProgress(progress, 0.2, 0.4));
  const OneSided back = distances(ofB, surfaceA, spacing, subProgress(progress, 0.4, 0.6));
  Comparison result;
  result.hausdorffAtoB = there.largest;
  result.hausdorffBtoA = back.largest;
  result.meanAtoB = there.mean;
  result.meanBtoA = back.mean;
  const double both = volumeOfBoth(a, b, options.maxMemory, subProgress(progress, 0.6, 1));
  result.symmetricDifference = std::max(0.0, signedVolume(ofA) + signedVolume(ofB) - 2 * both);
  return result;
}

}  // namespace levelset
