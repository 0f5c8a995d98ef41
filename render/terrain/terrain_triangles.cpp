#include <array>
#include <cmath>
#include <unordered_map>

#include "render/terrain/patch_borders.h"
#include "render/terrain/resident_patches.h"
#include "render/terrain/terrain_detail.h"

namespace render {
namespace {

/// Adds the triangles of patches to a mesh. Vertices with the same sample are one.
class TerrainMesher {
 public:
  explicit TerrainMesher(const levelset::GroundLayout& layout)
      : grid_(layout), sets_(layout.pyramid.cells) {}

  void add(const TerrainSelection::Part& part) {
    const TerrainPatch patch{part.level, part.column, part.row};
    const std::span<const std::uint16_t> numbers = sets_.triangles(part.coarserSides);
    for (std::size_t n = 0; n < numbers.size(); n += 3) {
      const std::array<Sample, 3> corners = {sampleOf(part, patch, numbers[n]),
                                             sampleOf(part, patch, numbers[n + 1]),
                                             sampleOf(part, patch, numbers[n + 2])};
      if (std::isnan(corners[0].height + corners[1].height + corners[2].height)) continue;
      // At the border of the field, vertices of a patch coincide.
      if (corners[0].key == corners[1].key || corners[1].key == corners[2].key ||
          corners[2].key == corners[0].key)
        continue;
      mesh_.triangles.push_back({vertex(corners[0]), vertex(corners[1]), vertex(corners[2])});
    }
  }

  levelset::TriMesh made() { return std::move(mesh_); }

 private:
  struct Sample {
    std::uint64_t key;
    int column, row;
    double height;
  };

  [[nodiscard]] Sample sampleOf(const TerrainSelection::Part& part, const TerrainPatch& patch,
                                std::uint16_t number) const {
    const int side = grid_.layout().pyramid.cells + 1;
    const int column = grid_.sampleColumn(patch, number % side),
              row = grid_.sampleRow(patch, number / side);
    const std::uint64_t key = static_cast<std::uint64_t>(static_cast<unsigned>(row)) << 32 |
                              static_cast<unsigned>(column);
    return {key, column, row, static_cast<double>(part.heights->heights[number])};
  }

  std::uint32_t vertex(const Sample& sample) {
    const auto [place, isNew] =
        numbers_.emplace(sample.key, static_cast<std::uint32_t>(mesh_.positions.size()));
    if (isNew) {
      const levelset::GroundLayout& layout = grid_.layout();
      mesh_.positions.emplace_back(layout.origin.x + sample.column * layout.spacing.x,
                                   layout.origin.y + sample.row * layout.spacing.y, sample.height);
    }
    return place->second;
  }

  PatchGrid grid_;
  PatchBorderSets sets_;
  levelset::TriMesh mesh_;
  std::unordered_map<std::uint64_t, std::uint32_t> numbers_;
};

}  // namespace

levelset::TriMesh terrainTriangles(const levelset::GroundLayout& layout,
                                   const TerrainSelection& selection) {
  TerrainMesher mesher(layout);
  for (const TerrainSelection::Part& part : selection.parts) mesher.add(part);
  return mesher.made();
}

}  // namespace render
