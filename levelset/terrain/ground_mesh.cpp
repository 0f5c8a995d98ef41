#include "levelset/terrain/ground_mesh.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"
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
  GroundMesher(const HeightField& field, std::size_t maxMemory)
      : field_(field), maxMemory_(maxMemory), isWhole_(field.missingCount() == 0) {
    countParts();
  }

  [[nodiscard]] bool isEmpty() const { return triangles_ == 0; }

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
  /// A corner of a triangle: its sample, and the sector of the triangle about it.
  struct CellCorner {
    int column, row;
    std::size_t sector;
  };

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

  /// Calls `visit(begin, end)` for the edges with one triangle, which is on their left.
  template <typename Visit>
  void forEachBorderEdge(const Visit& visit) const {
    for (int row = 0; row + 1 < field_.rows; ++row)
      for (int column = 0; column + 1 < field_.columns; ++column) {
        const GroundCell cell(field_, column, row);
        const int right = column + 1, top = row + 1;
        if (cell.hasLower()) {
          const CellCorner a{column, row, 0}, b{right, row, 2}, c{right, top, 4};
          if (!hasUpper(column, row - 1)) visit(a, b);
          if (!hasUpper(right, row)) visit(b, c);
          if (!cell.hasUpper()) visit(c, a);
        }
        if (cell.hasUpper()) {
          const CellCorner a{column, row, 1}, b{right, top, 3}, c{column, top, 5};
          if (!cell.hasLower()) visit(a, b);
          if (!hasLower(column, top)) visit(b, c);
          if (!hasLower(column - 1, row)) visit(c, a);
        }
      }
  }

  void countParts() {
    for (int row = 0; row + 1 < field_.rows; ++row)
      for (int column = 0; column + 1 < field_.columns; ++column) {
        const GroundCell cell(field_, column, row);
        triangles_ +=
            static_cast<std::size_t>(cell.hasLower()) + static_cast<std::size_t>(cell.hasUpper());
      }
    forEachBorderEdge([&](const CellCorner&, const CellCorner&) { ++borderEdges_; });
  }

  [[nodiscard]] const GroundFans::Entry& fansAt(int column, int row) const {
    static const GroundFans fans;
    return fans.entries[sectorsAt(column, row)];
  }
  [[nodiscard]] std::uint32_t vertex(const std::vector<std::uint32_t>& first,
                                     const CellCorner& at) const {
    const std::uint32_t of = first[field_.index(at.column, at.row)];
    return isWhole_ ? of : of + fansAt(at.column, at.row).fan[at.sector];
  }

  /// Adds a vertex for each fan. @return the first vertex of each sample
  [[nodiscard]] std::vector<std::uint32_t> addVertices(TriMesh& result, bool isSolid) const {
    const std::size_t samples = field_.heights.size(), sides = isSolid ? 2 : 1;
    // Each further fan of a sample ends at a border edge of its own.
    const std::size_t vertices = sides * (samples + borderEdges_),
                      triangles = sides * triangles_ + (isSolid ? 2 * borderEdges_ : 0);
    requireMemory(static_cast<double>(samples) * sizeof(std::uint32_t) +
                      static_cast<double>(vertices) * sizeof(Imath::V3d) +
                      static_cast<double>(triangles) * 3 * sizeof(std::uint32_t),
                  memoryLeft(memoryLimit(maxMemory_)));
    if (vertices >= std::size_t{1} << 32)
      throw ResourceLimit(
          fmt::format("the mesh of {} samples has more vertices than 32-bit indices can number; "
                      "crop the terrain",
                      samples));
    std::vector<std::uint32_t> first(samples, 0);
    result.triangles.reserve(triangles);
    result.positions.reserve(vertices);
    for (int row = 0; row < field_.rows; ++row)
      for (int column = 0; column < field_.columns; ++column) {
        first[field_.index(column, row)] = static_cast<std::uint32_t>(result.positions.size());
        const int count = isWhole_ ? 1 : fansAt(column, row).count;
        for (int n = 0; n < count; ++n) result.positions.push_back(field_.point(column, row));
      }
    return first;
  }

  void addGround(TriMesh& result, const std::vector<std::uint32_t>& first, int column,
                 int row) const {
    const GroundCell cell(field_, column, row);
    const int right = column + 1, top = row + 1;
    if (cell.hasLower())
      result.triangles.push_back({vertex(first, {column, row, 0}), vertex(first, {right, row, 2}),
                                  vertex(first, {right, top, 4})});
    if (cell.hasUpper())
      result.triangles.push_back({vertex(first, {column, row, 1}), vertex(first, {right, top, 3}),
                                  vertex(first, {column, top, 5})});
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
    forEachBorderEdge([&](const CellCorner& begin, const CellCorner& end) {
      const std::uint32_t from = vertex(first, begin), to = vertex(first, end);
      result.triangles.push_back({from + depth, to + depth, to});
      result.triangles.push_back({from + depth, to, from});
    });
  }

  const HeightField& field_;
  std::size_t maxMemory_;
  bool isWhole_;  ///< no sample is missing, so each one has a single fan
  std::size_t triangles_ = 0, borderEdges_ = 0;
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

HeightField loweredEdges(HeightField field, double depth) {
  if (!(depth >= 0) || !std::isfinite(depth))
    throw UsageError(
        fmt::format("the edges cannot be lowered by {}; give a length of 0 or more", depth));
  const auto lower = [&](int column, int row) {
    float& height = field.heights[field.index(column, row)];
    height = static_cast<float>(static_cast<double>(height) - depth);
  };
  for (int row = 0; row < field.rows; ++row) {
    const bool isEnd = row == 0 || row == field.rows - 1;
    for (int column = 0; column < field.columns; ++column)
      if (isEnd || column == 0 || column == field.columns - 1) lower(column, row);
  }
  return field;
}

MeshToBandResult solidify(const HeightField& field, double base, double voxelSize,
                          const SolidifyOptions& options) {
  TriMesh mesh = groundSolidMesh(
      field, base, {.allowMissing = options.allowMissing, .maxMemory = options.maxMemory});
  // The mesh is closed and meets itself nowhere, so the search for intersections would find none.
  return meshToBand(mesh, voxelSize,
                    {.halfWidth = options.halfWidth,
                     .sign = SignMode::Closed,
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
  if (!options.box.hasVolume())
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
