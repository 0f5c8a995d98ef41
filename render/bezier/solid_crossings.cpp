#include "render/bezier/solid_crossings.h"

#include <Imath/ImathBox.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace render {
namespace {

using Imath::V3d;

/// Faces closer than this are one, and faces of less area are collapsed; shares of the diagonal of
/// the volume and of its square.
constexpr double kSameFace = 1e-8, kLeastArea = 1e-10;
/// Samples of a face along each parameter.
constexpr int kFaceSamples = 17;
/// Samples of a patch along each parameter, and of all patches together.
constexpr double kMostPatchSamples = 9, kFewestPatchSamples = 2, kMostSamples = 1e6;
/// Step of differences, and the least Jacobian that has a sign over the cube of the diagonal of a
/// patch.
constexpr double kFoldStep = 1e-4, kLeastJacobian = 1e-7;

struct PatchFace {
  std::size_t patch;
  int axis;
  double end;  ///< value of the parameter of the axis, 0 or 1
  V3d centre{0};
  double moment = 0;  ///< root mean square distance of the control points from the centre
  std::array<V3d, 4> corners{};
  V3d inward{0};  ///< towards the next control points of the patch
  bool isShared = false;
};

/// Control points of a face, row by row. @param layer  0: on the face, 1: next to it in the patch
std::vector<std::vector<V3d>> netOf(const BezierPatch& patch, const PatchFace& face, int layer) {
  const int across = (face.axis + 1) % 3, down = (face.axis + 2) % 3;
  std::vector<std::vector<V3d>> net;
  std::array<int, 3> at{};
  at[static_cast<std::size_t>(face.axis)] =
      face.end == 0 ? layer : patch.degree[static_cast<std::size_t>(face.axis)] - layer;
  for (int i = 0; i <= patch.degree[static_cast<std::size_t>(across)]; ++i) {
    net.emplace_back();
    for (int j = 0; j <= patch.degree[static_cast<std::size_t>(down)]; ++j) {
      at[static_cast<std::size_t>(across)] = i;
      at[static_cast<std::size_t>(down)] = j;
      net.back().push_back(patch.points[patch.index(at[0], at[1], at[2])]);
    }
  }
  return net;
}

/// Returns the face, or one that counts as shared if it is collapsed.
PatchFace patchFace(const BezierVolume& volume, std::size_t patch, int axis, double end,
                    double diagonal) {
  PatchFace face{patch, axis, end};
  const std::vector<std::vector<V3d>> net = netOf(volume.patches[patch], face, 0);
  face.corners = {net.front().front(), net.front().back(), net.back().front(), net.back().back()};
  double count = 0, squares = 0, area = 0;
  for (const std::vector<V3d>& row : net)
    for (const V3d& p : row) {
      face.centre += p;
      ++count;
    }
  face.centre /= count;
  for (const std::vector<V3d>& row : net)
    for (const V3d& p : row) squares += (p - face.centre).length2();
  face.moment = std::sqrt(squares / count);
  for (std::size_t i = 0; i + 1 < net.size(); ++i)
    for (std::size_t j = 0; j + 1 < net[i].size(); ++j)
      area += (net[i + 1][j + 1] - net[i][j]).cross(net[i + 1][j] - net[i][j + 1]).length();
  for (const std::vector<V3d>& row : netOf(volume.patches[patch], face, 1))
    for (const V3d& p : row) face.inward += p;
  face.inward = face.inward / count - face.centre;
  face.isShared = area <= kLeastArea * diagonal * diagonal;
  return face;
}

/// Returns true for faces at one place whose patches lie on opposite sides.
bool isSameFace(const PatchFace& a, const PatchFace& b, double tolerance) {
  return (b.centre - a.centre).length() <= tolerance &&
         std::abs(b.moment - a.moment) <= tolerance && a.inward.dot(b.inward) < 0 &&
         std::all_of(a.corners.begin(), a.corners.end(), [&](const V3d& p) {
           return std::any_of(b.corners.begin(), b.corners.end(),
                              [&](const V3d& q) { return (p - q).length() <= tolerance; });
         });
}

/// Marks faces that belong to two patches, or to two ends of one.
void joinFaces(std::vector<PatchFace>& faces, double tolerance) {
  // A direction in which few lattices have many faces at one place.
  const V3d way(0.61, 0.53, 0.59);
  std::sort(faces.begin(), faces.end(), [&](const PatchFace& a, const PatchFace& b) {
    return a.centre.dot(way) < b.centre.dot(way);
  });
  for (std::size_t a = 0; a < faces.size(); ++a)
    for (std::size_t b = a + 1;
         b < faces.size() && (faces[b].centre - faces[a].centre).dot(way) <= tolerance; ++b)
      if (isSameFace(faces[a], faces[b], tolerance)) faces[a].isShared = faces[b].isShared = true;
}

/// Returns true if the object contains a point. @param inside  as of insideAt()
bool isInObject(const std::vector<int>& expression, const std::vector<char>& inside) {
  if (expression.empty()) return inside.front() != 0;
  std::vector<char> stack;
  for (const int step : expression) {
    if (step >= 0) {
      stack.push_back(inside[static_cast<std::size_t>(step)]);
      continue;
    }
    const bool b = stack.back() != 0;
    stack.pop_back();
    const bool a = stack.back() != 0;
    stack.back() = (step == -1 ? a || b : step == -2 ? a && b : a && !b) ? 1 : 0;
  }
  return stack.back() != 0;
}

/// Samples a face for points inside the object.
bool reachesFace(const BezierVolume& volume, const PatchFace& face) {
  for (int i = 0; i < kFaceSamples; ++i)
    for (int j = 0; j < kFaceSamples; ++j) {
      V3d parameter;
      parameter[face.axis] = face.end;
      parameter[(face.axis + 1) % 3] = static_cast<double>(i) / (kFaceSamples - 1);
      parameter[(face.axis + 2) % 3] = static_cast<double>(j) / (kFaceSamples - 1);
      if (isInObject(volume.expression,
                     insideAt(volume.patches[face.patch], volume.isovalue, parameter)))
        return true;
    }
  return false;
}

double jacobianAt(const BezierPatch& patch, const V3d& parameter) {
  V3d slopes[3];
  for (int axis = 0; axis < 3; ++axis) {
    V3d step(0);
    step[axis] = kFoldStep;
    slopes[axis] = (positionAt(patch, parameter + step) - positionAt(patch, parameter - step)) /
                   (2 * kFoldStep);
  }
  return slopes[0].dot(slopes[1].cross(slopes[2]));
}

/// Returns true for a patch of a parametric surface: both layers along w are the same.
bool isSurfacePatch(const BezierPatch& patch) {
  if (patch.trim) return true;
  if (patch.degree[2] != 1) return false;
  for (std::size_t n = 0; n + 1 < patch.points.size(); n += 2)
    if (patch.points[n] != patch.points[n + 1]) return false;
  return true;
}

/// Crossings of roots in order. A singular root counts where its neighbours need it.
SolidCrossings joinedLayers(std::span<const BezierRoot> roots, bool startsOutside) {
  SolidCrossings result;
  std::size_t layers = 0;  // of the solid in front of the roots so far, from the end of the ray
  const BezierRoot* pending = nullptr;  // singular root behind the next one
  const auto add = [&](const BezierRoot& root, bool isEntry) {
    result.roots.push_back(root);
    result.roots.back().isEntry = isEntry;
  };
  const auto leave = [&](const BezierRoot& root) {
    if (layers++ == 0) add(root, false);
  };
  const auto enter = [&](const BezierRoot& root) {
    if (--layers == 0) add(root, true);
  };
  for (std::size_t n = roots.size(); n-- > 0;) {
    const BezierRoot& root = roots[n];
    if (root.isSingular) {
      pending = &root;
      continue;
    }
    if (root.isEntry) {
      if (layers == 0 && pending) leave(*pending);
      if (layers > 0)
        enter(root);
      else
        result.isOpen = true;
    } else {
      if (layers > 0 && pending) enter(*pending);
      leave(root);
    }
    pending = nullptr;
  }
  if (startsOutside && layers > 0) {
    if (pending && layers == 1)
      enter(*pending);
    else
      result.isOpen = true;
  }
  std::reverse(result.roots.begin(), result.roots.end());
  return result;
}

/// Returns true for a patch in which the map folds inside the object.
bool foldsInObject(const BezierVolume& volume, const BezierPatch& patch, int samples) {
  Imath::Box3d box;
  for (const V3d& p : patch.points) box.extendBy(p);
  const double diagonal = box.size().length(),
               least = kLeastJacobian * diagonal * diagonal * diagonal;
  bool isPositive = false, isNegative = false;
  for (int n = 0; n < samples * samples * samples; ++n) {
    const V3d parameter =
        (V3d(n % samples, n / samples % samples, n / (samples * samples)) + V3d(0.5)) / samples;
    if (!isInObject(volume.expression, insideAt(patch, volume.isovalue, parameter))) continue;
    const double jacobian = jacobianAt(patch, parameter);
    isPositive = isPositive || jacobian > least;
    isNegative = isNegative || jacobian < -least;
  }
  return isPositive && isNegative;
}

}  // namespace

SolidCrossings solidCrossings(std::span<const BezierRoot> roots, bool startsOutside) {
  // A surface that is touched has a singular root, which most rays do not need.
  std::vector<BezierRoot> plain;
  std::copy_if(roots.begin(), roots.end(), std::back_inserter(plain),
               [](const BezierRoot& root) { return !root.isSingular; });
  SolidCrossings result = joinedLayers(plain, startsOutside);
  return result.isOpen && plain.size() < roots.size() ? joinedLayers(roots, startsOutside) : result;
}

std::size_t findOpenPatch(const BezierVolume& volume) {
  const double diagonal = volume.bounds().size().length();
  std::vector<PatchFace> faces;
  for (std::size_t p = 0; p < volume.patches.size(); ++p) {
    if (isSurfacePatch(volume.patches[p])) return p;
    for (int axis = 0; axis < 3; ++axis)
      for (const double end : {0.0, 1.0})
        if (PatchFace face = patchFace(volume, p, axis, end, diagonal); !face.isShared)
          faces.push_back(face);
  }
  joinFaces(faces, kSameFace * diagonal);
  std::size_t open = volume.patches.size();
  for (const PatchFace& face : faces)
    if (!face.isShared && face.patch < open && reachesFace(volume, face)) open = face.patch;
  return open;
}

std::size_t findFoldedPatch(const BezierVolume& volume) {
  const auto patches = static_cast<double>(volume.patches.size());
  const int samples = static_cast<int>(
      std::clamp(std::cbrt(kMostSamples / patches), kFewestPatchSamples, kMostPatchSamples));
  // Callers hold a lock. A thread that waits here must not take a task that needs the same lock.
  return tbb::this_task_arena::isolate([&] {
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, volume.patches.size()), volume.patches.size(),
        [&](const tbb::blocked_range<std::size_t>& range, std::size_t least) {
          for (std::size_t p = range.begin(); p < std::min(range.end(), least); ++p)
            if (foldsInObject(volume, volume.patches[p], samples)) return p;
          return least;
        },
        [](std::size_t a, std::size_t b) { return std::min(a, b); });
  });
}

}  // namespace render
