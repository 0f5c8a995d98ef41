#include "mapping/patches/patch_mesh.h"

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace mapping {
namespace {

using levelset::TriMesh;
using VertexIndex = std::uint32_t;

/// Maps the particles of a layer to vertices of a mesh, which are consecutive from `first`.
struct SheetIndex {
  VertexIndex first;
  const ParticleLayer* layer;
  [[nodiscard]] VertexIndex at(std::size_t column, std::size_t row) const {
    return first + static_cast<VertexIndex>(row * layer->columns + column);
  }
  /// Vertices of a side, anticlockwise around the layer seen from above, starting at corner n.
  [[nodiscard]] std::vector<VertexIndex> side(int n) const {
    const std::size_t right = layer->columns - 1, top = layer->rows - 1;
    std::vector<VertexIndex> result;
    for (std::size_t i = 0; i <= (n % 2 == 0 ? right : top); ++i) {
      if (n == 0) result.push_back(at(i, 0));
      if (n == 1) result.push_back(at(right, i));
      if (n == 2) result.push_back(at(right - i, top));
      if (n == 3) result.push_back(at(0, top - i));
    }
    return result;
  }
};

SheetIndex addSheet(const ParticleLayer& layer, TriMesh& mesh) {
  const SheetIndex sheet{static_cast<VertexIndex>(mesh.positions.size()), &layer};
  mesh.positions.insert(mesh.positions.end(), layer.positions.begin(), layer.positions.end());
  return sheet;
}

/// Adds two triangles for each cell of a layer, facing along +w (`isUp`) or −w.
void addCells(const SheetIndex& sheet, bool isUp, TriMesh& mesh) {
  const auto add = [&](VertexIndex a, VertexIndex b, VertexIndex c) {
    if (isUp)
      mesh.triangles.push_back({a, b, c});
    else
      mesh.triangles.push_back({a, c, b});
  };
  for (std::size_t j = 0; j + 1 < sheet.layer->rows; ++j)
    for (std::size_t i = 0; i + 1 < sheet.layer->columns; ++i) {
      add(sheet.at(i, j), sheet.at(i + 1, j), sheet.at(i + 1, j + 1));
      add(sheet.at(i, j), sheet.at(i + 1, j + 1), sheet.at(i, j + 1));
    }
}

/// Adds the triangles between one side of a layer and that side of the next layer, possibly with
/// different counts. Each triangle advances on the side of which the smaller share is done.
void addWall(const std::vector<VertexIndex>& low, const std::vector<VertexIndex>& high,
             TriMesh& mesh) {
  std::size_t i = 0, j = 0;
  const std::size_t lows = low.size() - 1, highs = high.size() - 1;
  while (i < lows || j < highs) {
    const bool advancesLow = j == highs || (i < lows && (i + 1) * highs <= (j + 1) * lows);
    if (advancesLow) {
      mesh.triangles.push_back({low[i], low[i + 1], high[j]});
      ++i;
    } else {
      mesh.triangles.push_back({low[i], high[j + 1], high[j]});
      ++j;
    }
  }
}

}  // namespace

TriMesh patchMesh(const Patch& patch, PatchMeshKind kind) {
  TriMesh mesh;
  if (kind == PatchMeshKind::Sheets) {
    for (const ParticleLayer& layer : patch.layers) addCells(addSheet(layer, mesh), true, mesh);
  } else {
    // Inner layers need only the vertices on their borders: other vertices would have no triangle.
    std::vector<std::array<std::vector<VertexIndex>, 4>> borders;
    for (const ParticleLayer& layer : patch.layers) {
      const bool isEnd = &layer == &patch.layers.front() || &layer == &patch.layers.back();
      std::array<std::vector<VertexIndex>, 4> border;
      if (isEnd) {
        const SheetIndex sheet = addSheet(layer, mesh);
        addCells(sheet, &layer == &patch.layers.back(), mesh);
        for (int n = 0; n < 4; ++n) border[static_cast<std::size_t>(n)] = sheet.side(n);
      } else {
        const SheetIndex inLayer{0, &layer};
        const auto first = static_cast<VertexIndex>(mesh.positions.size());
        for (int n = 0; n < 4; ++n) {
          const std::vector<VertexIndex> side = inLayer.side(n);
          for (std::size_t i = 0; i < side.size(); ++i) {
            const bool isLast = i + 1 == side.size();  // the first vertex of the next side
            border[static_cast<std::size_t>(n)].push_back(
                isLast && n == 3 ? first : static_cast<VertexIndex>(mesh.positions.size()));
            if (!isLast) mesh.positions.push_back(layer.positions[side[i]]);
          }
        }
      }
      borders.push_back(std::move(border));
    }
    for (std::size_t k = 0; k + 1 < borders.size(); ++k)
      for (std::size_t n = 0; n < 4; ++n) addWall(borders[k][n], borders[k + 1][n], mesh);
  }
  if (patch.mirrored)
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

}  // namespace mapping
