#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"
#include "levelset/mesh.h"

namespace levelset {
namespace {

using Imath::V3d;

/// Checks that one list has an entry for each vertex and that all its values are finite.
template <typename Vector>
void requireList(const std::vector<Vector>& list, std::size_t vertices, const char* name) {
  if (list.empty()) return;
  if (list.size() != vertices) {
    throw InvalidInput(
        fmt::format("the mesh has {} {}s for {} vertices; give one for each vertex, or "
                    "none",
                    list.size(), name, vertices));
  }
  for (std::size_t v = 0; v < vertices; ++v)
    for (unsigned axis = 0; axis < Vector::dimensions(); ++axis)
      if (!std::isfinite(list[v][static_cast<int>(axis)])) {
        throw InvalidInput(
            fmt::format("the {} of vertex {} holds {}, which is not a finite number; "
                        "repair the mesh, or remove its {}s",
                        name, v, list[v][static_cast<int>(axis)], name));
      }
}

double largestPart(const V3d& v) {
  return std::max(std::max(std::abs(v.x), std::abs(v.y)), std::abs(v.z));
}

template <typename Vector>
void appendList(std::vector<Vector>& list, std::size_t before, const std::vector<Vector>& other,
                std::size_t more) {
  if (list.size() != before || other.size() != more) return list.clear();
  list.insert(list.end(), other.begin(), other.end());
}

}  // namespace

std::string describe(const MeshAttributes& attributes) {
  std::vector<const char*> names;
  if (!attributes.normals.empty()) names.push_back("normals");
  if (!attributes.uvs.empty()) names.push_back("texture coordinates");
  if (!attributes.colors.empty()) names.push_back("colours");
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 < names.size() ? ", " : " and ";
    text += names[i];
  }
  return text;
}

void requireAttributes(const TriMesh& mesh) {
  const std::size_t count = mesh.positions.size();
  requireList(mesh.attributes.normals, count, "normal");
  requireList(mesh.attributes.uvs, count, "texture coordinate");
  requireList(mesh.attributes.colors, count, "colour");
}

V3d transformedNormal(const V3d& normal, const std::array<V3d, 3>& slopes, double hand) {
  // Divides the Jacobian and the normal by their largest components, so that no product overflows.
  double inA = largestPart(slopes[0]), inB = largestPart(slopes[1]), inC = largestPart(slopes[2]);
  const double size = std::max(std::max(inA, inB), inC);
  const double length = largestPart(normal);
  constexpr double kMinMagnitude = 1e-300;  // its inverse is still finite
  if (!(size > kMinMagnitude) || !(length > kMinMagnitude)) return V3d(0);
  const double bySize = 1 / size, byLength = 1 / length;
  const V3d a = slopes[0] * bySize, b = slopes[1] * bySize, c = slopes[2] * bySize,
            n = normal * byLength;
  // The cross products are the columns of the cofactor matrix of the Jacobian: the inverse
  // transpose times the determinant. The factor does not matter, since the result is normalised.
  const V3d moved = hand * (n.x * b.cross(c) + n.y * c.cross(a) + n.z * a.cross(b));
  // If the Jacobian is singular, `moved` consists of rounding errors only. `sum` bounds its terms.
  inA *= bySize, inB *= bySize, inC *= bySize;
  const double sum =
      std::abs(n.x) * inB * inC + std::abs(n.y) * inC * inA + std::abs(n.z) * inA * inB;
  const double scale = largestPart(moved);
  if (!(scale > 3e-14 * sum)) return V3d(0);
  const V3d scaled = moved * (1 / scale);
  return scaled * (1 / std::sqrt(scaled.length2()));
}

void append(TriMesh& mesh, const TriMesh& other) {
  const std::size_t before = mesh.positions.size(), more = other.positions.size();
  const auto first = static_cast<std::uint32_t>(before);
  if (before == 0) {
    mesh.precision = other.precision;
    mesh.spacing = other.spacing;
  } else if (more > 0) {
    // Takes the coarser precision of the two meshes, since the result has coordinates of both.
    if (other.precision == CoordinatePrecision::Float) mesh.precision = other.precision;
    mesh.spacing = std::max(mesh.spacing, other.spacing);
  }
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const auto& t : other.triangles)
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  MeshAttributes& to = mesh.attributes;
  const MeshAttributes& from = other.attributes;
  if (before == 0) {
    to = from;
    return;
  }
  appendList(to.normals, before, from.normals, more);
  appendList(to.uvs, before, from.uvs, more);
  appendList(to.colors, before, from.colors, more);
  if (from.precision == CoordinatePrecision::Double) to.precision = from.precision;
  if (from.colorPrecision == ColorPrecision::Float) to.colorPrecision = from.colorPrecision;
  to.hasAlpha = to.hasAlpha || from.hasAlpha;
}

}  // namespace levelset
