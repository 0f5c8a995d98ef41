#include "levelset/terrain/ground_mesh.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/error.h"
#include "levelset/terrain/ground_triangles.h"
#include "levelset/transform/crop.h"

namespace levelset {
namespace {

using terrain::GroundCell;

/// Triangles about a sample, as sectors counter-clockwise from the direction of x. The diagonals of
/// the cells divide the first and the third quadrant.
constexpr std::size_t kSectors = 6;

/// For each set of sectors with a triangle: the numbers of the fans that they form, one for each
/// sector, and the number of fans. A fan is a run of neighbouring sectors.
struct GroundFans {
  struct Entry {
    std::array<std::uint8_t, kSectors> fan{};
    std::uint8_t count = 0;
  };
  std::array<Entry, 1 << kSectors> entries{};

  GroundFans() {
    for (std::size_t set = 0; set < entries.size(); ++set) {
      Entry& entry = entries[set];
      const auto has = [&](std::size_t sector) { return (set >> sector % kSectors & 1) != 0; };
      std::size_t gap = 0;  // a sector without a triangle, if there is one
      while (gap < kSectors && has(gap)) ++gap;
      if (gap == kSectors) {
        entry.count = 1;
        continue;
      }
      for (std::size_t n = 1; n <= kSectors; ++n) {
        const std::size_t sector = (gap + n) % kSectors;
        if (!has(sector)) continue;
        if (!has(gap + n + kSectors - 1)) ++entry.count;
        entry.fan[sector] = static_cast<std::uint8_t>(entry.count - 1);
      }
    }
  }
};

/// Builds the meshes of one height field.
class GroundMesher {
 public:
  explicit GroundMesher(const HeightField& field, std::size_t maxMemory)
      : field_(field), maxMemory_(maxMemory) {
    countTriangles();
  }

  /// Makes the ground. @param base  makes the base and the walls, too; null: only the ground
  [[nodiscard]] TriMesh mesh(const double* base) const {
    TriMesh result;
    std::vector<std::uint32_t> first = addVertices(result, base != nullptr);
    for (int row = 0; row + 1 < field_.rows; ++row)
      for (int column = 0; column + 1 < field_.columns; ++column)
        addGround(result, first, column, row);
    if (base) addBase(result, first, *base);
    return result;
  }

 private:
  [[nodiscard]] bool isCell(int column, int row) const {
    return column >= 0 && row >= 0 && column + 1 < field_.columns && row + 1 < field_.rows;
  }
  [[nodiscard]] bool hasLower(int column, int row) const {
    return isCell(column, row) && GroundCell(field_, column, row).hasLower();
  }
  [[nodiscard]] bool hasUpper(int column, int row) const {
    return isCell(column, row) && GroundCell(field_, column, row).hasUpper();
  }

  /// Set of the sectors about a sample that have a triangle.
  [[nodiscard]] std::size_t sectorsAt(int column, int row) const {
    return static_cast<std::size_t>(hasLower(column, row)) |
           static_cast<std::size_t>(hasUpper(column, row)) << 1 |
           static_cast<std::size_t>(hasLower(column - 1, row)) << 2 |
           static_cast<std::size_t>(hasUpper(column - 1, row - 1)) << 3 |
           static_cast<std::size_t>(hasLower(column - 1, row - 1)) << 4 |
           static_cast<std::size_t>(hasUpper(column, row - 1)) << 5;
  }

  void countTriangles() {
    for (int row = 0; row + 1 < field_.rows; ++row)
      for (int column = 0; column + 1 < field_.columns; ++column) {
        const GroundCell cell(field_, column, row);
        triangles_ +=
            static_cast<std::size_t>(cell.hasLower()) + static_cast<std::size_t>(cell.hasUpper());
      }
  }

  [[nodiscard]] const GroundFans::Entry& fansAt(int column, int row) const {
    static const GroundFans fans;
    return fans.entries[sectorsAt(column, row)];
  }
  [[nodiscard]] std::uint32_t vertex(const std::vector<std::uint32_t>& first, int column, int row,
                                     std::size_t sector) const {
    return first[field_.index(column, row)] + fansAt(column, row).fan[sector];
  }

  /// Adds a vertex for each fan. @return the first vertex of each sample
  [[nodiscard]] std::vector<std::uint32_t> addVertices(TriMesh& result, bool isSolid) const {
    const std::size_t samples = field_.heights.size(), copies = isSolid ? 2 : 1;
    // A solid has walls beside its two sides; their triangles are few unless the holes are many.
    const double bytes =
        static_cast<double>(samples) *
            (sizeof(std::uint32_t) + sizeof(Imath::V3d) * static_cast<double>(copies)) +
        static_cast<double>(triangles_ * copies) * 3 * sizeof(std::uint32_t);
    requireMemory(bytes, maxMemory_);
    // A sample has at most three fans.
    if (3.0 * static_cast<double>(copies) * static_cast<double>(samples) >= 4294967296.0)
      throw ResourceLimit(
          fmt::format("the mesh of {} samples has more vertices than 32-bit indices can number; "
                      "crop the terrain",
                      samples));
    std::vector<std::uint32_t> first(samples, 0);
    result.triangles.reserve(triangles_ * copies);
    result.positions.reserve(samples * copies);
    for (int row = 0; row < field_.rows; ++row)
      for (int column = 0; column < field_.columns; ++column) {
        first[field_.index(column, row)] = static_cast<std::uint32_t>(result.positions.size());
        const std::uint8_t count = fansAt(column, row).count;
        for (std::uint8_t n = 0; n < count; ++n)
          result.positions.push_back(field_.point(column, row));
      }
    return first;
  }

  void addGround(TriMesh& result, const std::vector<std::uint32_t>& first, int column,
                 int row) const {
    const GroundCell cell(field_, column, row);
    if (cell.hasLower())
      result.triangles.push_back({vertex(first, column, row, 0), vertex(first, column + 1, row, 2),
                                  vertex(first, column + 1, row + 1, 4)});
    if (cell.hasUpper())
      result.triangles.push_back({vertex(first, column, row, 1),
                                  vertex(first, column + 1, row + 1, 3),
                                  vertex(first, column, row + 1, 5)});
  }

  /// Adds the base below the triangles so far, and walls below the edges with one triangle.
  void addBase(TriMesh& result, const std::vector<std::uint32_t>& first, double base) const {
    const auto depth = static_cast<std::uint32_t>(result.positions.size());
    for (std::uint32_t n = 0; n < depth; ++n) {
      const Imath::V3d above = result.positions[n];
      result.positions.emplace_back(above.x, above.y, base);
    }
    for (std::size_t n = 0; n < triangles_; ++n) {
      const auto [a, b, c] = result.triangles[n];
      result.triangles.push_back({a + depth, c + depth, b + depth});
    }
    const auto addWall = [&](std::uint32_t from, std::uint32_t to) {
      result.triangles.push_back({from + depth, to + depth, to});
      result.triangles.push_back({from + depth, to, from});
    };
    for (int row = 0; row + 1 < field_.rows; ++row)
      for (int column = 0; column + 1 < field_.columns; ++column) {
        const GroundCell cell(field_, column, row);
        if (cell.hasLower()) {
          const std::uint32_t a = vertex(first, column, row, 0),
                              b = vertex(first, column + 1, row, 2),
                              c = vertex(first, column + 1, row + 1, 4);
          if (!hasUpper(column, row - 1)) addWall(a, b);
          if (!hasUpper(column + 1, row)) addWall(b, c);
          if (!cell.hasUpper()) addWall(c, a);
        }
        if (cell.hasUpper()) {
          const std::uint32_t a = vertex(first, column, row, 1),
                              b = vertex(first, column + 1, row + 1, 3),
                              c = vertex(first, column, row + 1, 5);
          if (!cell.hasLower()) addWall(a, b);
          if (!hasLower(column, row + 1)) addWall(b, c);
          if (!hasLower(column - 1, row)) addWall(c, a);
        }
      }
  }

  const HeightField& field_;
  std::size_t maxMemory_;
  std::size_t triangles_ = 0;

 public:
  [[nodiscard]] bool isEmpty() const { return triangles_ == 0; }
};

void requireGround(const HeightField& field, bool allowMissing) {
  requireHeights(field);
  requireLengths(field);
  if (field.columns < 2 || field.rows < 2)
    throw InvalidInput(
        fmt::format("the terrain has {}x{} samples, but a surface needs at least 2x2; give more",
                    field.columns, field.rows));
  if (const std::size_t missing = field.missingCount(); missing > 0 && !allowMissing)
    throw InvalidInput(
        fmt::format("{} of {} samples have no data; fill them with 'terrain --fill', or accept "
                    "holes with --allow-missing",
                    missing, field.heights.size()));
}

TriMesh meshOfGround(const HeightField& field, const double* base,
                     const GroundMeshOptions& options) {
  requireGround(field, options.allowMissing);
  const GroundMesher mesher(field, options.maxMemory);
  if (mesher.isEmpty())
    throw InvalidInput(
        "no three neighbouring samples have data, so there is no ground; fill the terrain with "
        "'terrain --fill'");
  return mesher.mesh(base);
}

}  // namespace

TriMesh groundMesh(const HeightField& field, const GroundMeshOptions& options) {
  return meshOfGround(field, nullptr, options);
}

TriMesh groundSolidMesh(const HeightField& field, double base, const GroundMeshOptions& options) {
  requireGround(field, options.allowMissing);
  const Imath::Box3d bounds = field.bounds();
  if (!std::isfinite(base) || (!bounds.isEmpty() && !(base < bounds.min.z)))
    throw InvalidInput(
        fmt::format("the base is at {:.9g}, but the lowest sample is at {:.9g}; give a lower base",
                    base, bounds.min.z));
  return meshOfGround(field, &base, options);
}

MeshToBandResult solidify(const HeightField& field, double base, double voxelSize,
                          const SolidifyOptions& options) {
  TriMesh mesh = groundSolidMesh(
      field, base, {.allowMissing = options.allowMissing, .maxMemory = options.maxMemory});
  // The mesh is closed and meets itself nowhere, so the search for intersections would find none.
  return meshToBand(mesh, voxelSize,
                    {.halfWidth = options.halfWidth,
                     .sign = SignMode::Closed,
                     .roi = options.roi,
                     .maxMemory = options.maxMemory,
                     .progress = options.progress,
                     .onMeshRead = [&mesh] { mesh = TriMesh(); }});
}

SurfaceBandResult groundBand(const HeightField& field, double voxelSize,
                             const GroundBandOptions& options) {
  requireHeights(field);
  requireLengths(field);
  if (isEverywhere(options.box)) {
    const TriMesh mesh =
        groundMesh(field, {.allowMissing = options.allowMissing, .maxMemory = options.maxMemory});
    return surfaceBand(mesh, voxelSize,
                       {.halfWidth = options.halfWidth,
                        .maxMemory = options.maxMemory,
                        .progress = options.progress});
  }
  if (options.box.isEmpty() || options.box.hasVolume() == false)
    throw UsageError("the box of the band is empty; give its lower corner first");
  // The blocks that meet the box reach at most 7 voxels beyond it, and their closest points lie
  // within the half width. Cells that are cut there must be complete.
  const double reach = (options.halfWidth + 8) * voxelSize;
  Imath::Box3d around = options.box;
  around.min -= Imath::V3d(reach) + Imath::V3d(field.spacing.x, field.spacing.y, 0);
  around.max += Imath::V3d(reach) + Imath::V3d(field.spacing.x, field.spacing.y, 0);
  const HeightField part = croppedHeights(field, around);
  const TriMesh mesh =
      groundMesh(part, {.allowMissing = options.allowMissing, .maxMemory = options.maxMemory});
  SurfaceBandResult result = surfaceBand(mesh, voxelSize,
                                         {.halfWidth = options.halfWidth,
                                          .maxMemory = options.maxMemory,
                                          .progress = options.progress});
  result.band =
      cropped(std::move(result.band), {.halfWidth = options.halfWidth, .region = options.box});
  if (result.band.isEmpty())
    throw InvalidInput(
        "the box has no ground within the half width of the band; move or enlarge the box");
  return result;
}

}  // namespace levelset
